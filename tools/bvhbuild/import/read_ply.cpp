#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/printable.h"
#include "mesh_assembly.h"
#include "ply_header.h"
#include "readers.h"
#include "scanner.h"

namespace tandem::build {
namespace {

/// How reading the values of a PLY file stands. Once it is not `good` it stays so, and all further values are
/// zero.
enum class PlyState { good, ended, bad };

/// An index that is no integer, or too large for one: it names no vertex.
constexpr std::int64_t kNoIndex = std::numeric_limits<std::int64_t>::min();

std::int64_t index_from_real(double value) {
  constexpr double kMost = 4'294'967'296.0;
  return std::abs(value) <= kMost && value == std::floor(value) ? static_cast<std::int64_t>(value) : kNoIndex;
}

/// The values in the data of a binary PLY file, one after the other.
template <std::endian Order>
class PlyBinaryValues {
 public:
  PlyBinaryValues(std::string_view bytes, std::size_t data_begin)
      : cursor_(bytes.data() + data_begin), end_(bytes.data() + bytes.size()) {}

  static std::size_t least_bytes(const PlyProperty& property) {
    return ply_type_bytes(property.is_list ? property.count_type : property.type);
  }
  static std::size_t least_item_bytes(PlyType type) { return ply_type_bytes(type); }
  std::size_t room() const { return bytes_left(); }
  std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - cursor_); }

  PlyState state() const { return state_; }
  std::string reason() const { return {}; }

  void begin_record() {}
  bool end_record() { return true; }

  double real(PlyType type) {
    switch (type) {
      case PlyType::float32:
        return take<float>();
      case PlyType::float64:
        return take<double>();
      default:
        return static_cast<double>(integer(type));
    }
  }
  std::int64_t integer(PlyType type) {
    switch (type) {
      case PlyType::int8:
        return take<std::int8_t>();
      case PlyType::uint8:
        return take<std::uint8_t>();
      case PlyType::int16:
        return take<std::int16_t>();
      case PlyType::uint16:
        return take<std::uint16_t>();
      case PlyType::int32:
        return take<std::int32_t>();
      case PlyType::uint32:
        return take<std::uint32_t>();
      case PlyType::float32:
        return index_from_real(take<float>());
      case PlyType::float64:
        return index_from_real(take<double>());
    }
    return kNoIndex;
  }
  void skip(PlyType type, std::uint64_t count) {
    if (count > bytes_left() / ply_type_bytes(type)) return end();
    cursor_ += count * ply_type_bytes(type);
  }

 private:
  template <class T>
  T take() {
    if (bytes_left() < sizeof(T)) {
      end();
      return T{};
    }
    const T value = load_number<T, Order>(cursor_);
    cursor_ += sizeof(T);
    return value;
  }
  void end() {
    state_ = PlyState::ended;
    cursor_ = end_;
  }

  const char* cursor_;
  const char* end_;
  PlyState state_ = PlyState::good;
};

/// The same for a PLY file in text, where every record of an element has a line of its own.
class PlyTextValues {
 public:
  PlyTextValues(std::string_view bytes, std::size_t data_begin) : text_(bytes) {
    text_.skip_bytes(data_begin - static_cast<std::size_t>(text_.cursor() - bytes.data()));
  }

  // A digit, and the blank or line end behind it.
  static std::size_t least_bytes(const PlyProperty&) { return 2; }
  static std::size_t least_item_bytes(PlyType) { return 2; }
  std::size_t room() const { return text_.bytes_left() + 1; }  // the last line end may be missing
  std::size_t bytes_left() {
    text_.skip_space();
    return text_.bytes_left();
  }

  PlyState state() const { return state_; }
  std::string reason() const { return reason_; }
  std::string line() const { return text_.line(); }

  void begin_record() {
    text_.skip_space();
    if (text_.at_end()) state_ = PlyState::ended;
  }
  /// False when the line holds more than the record.
  bool end_record() {
    text_.skip_blanks();
    const bool is_whole = text_.at_line_end();
    text_.skip_to_line_end();
    return is_whole;
  }

  double real(PlyType) {
    double value = 0;
    if (at_value() && !text_.read_real(value)) fail(in_quotes(text_.word()) + " is not a number");
    return value;
  }
  std::int64_t integer(PlyType type) {
    if (is_real(type)) return index_from_real(real(type));
    std::int64_t value = 0;
    if (at_value() && !text_.read_integer(value)) fail(in_quotes(text_.word()) + " is not an integer");
    return value;
  }
  void skip(PlyType, std::uint64_t count) {
    for (; count > 0 && at_value(); --count) text_.skip_word();
  }

 private:
  bool at_value() {
    if (state_ != PlyState::good) return false;
    text_.skip_blanks();
    if (!text_.at_line_end()) return true;
    if (text_.at_end()) {
      state_ = PlyState::ended;
    } else {
      fail("the line ends before its values do");
    }
    return false;
  }
  void fail(std::string_view reason) {
    state_ = PlyState::bad;
    reason_ = text_.line() + ": " + std::string(reason);
  }

  TextScanner text_;
  PlyState state_ = PlyState::good;
  std::string reason_;
};

// What a property is to a mesh.
enum class Role { none, x, y, z, corners };

enum class ElementKind { vertex, face, strips, other };

ElementKind kind_of(const PlyElement& element) {
  if (element.name == "vertex") return ElementKind::vertex;
  if (element.name == "face") return ElementKind::face;
  return element.name == "tristrips" ? ElementKind::strips : ElementKind::other;
}

Role role_of(const PlyProperty& property, ElementKind kind) {
  if (kind == ElementKind::vertex && !property.is_list) {
    if (property.name == "x") return Role::x;
    if (property.name == "y") return Role::y;
    if (property.name == "z") return Role::z;
  }
  const bool holds_indices = kind == ElementKind::face || kind == ElementKind::strips;
  const bool named_so = property.name == "vertex_indices" || property.name == "vertex_index";
  return holds_indices && property.is_list && named_so ? Role::corners : Role::none;
}

std::vector<Role> roles_of(const PlyElement& element) {
  std::vector<Role> roles;
  for (const PlyProperty& property : element.properties) {
    const Role role = role_of(property, kind_of(element));
    const bool comes_again = role != Role::none && std::find(roles.begin(), roles.end(), role) != roles.end();
    roles.push_back(comes_again ? Role::none : role);
  }
  return roles;
}

std::string counted(std::uint64_t count, std::string_view element) {
  const std::string number = std::to_string(count) + " ";
  if (element == "vertex") return number + "vertices";
  return number + (element == "face" ? "faces" : "elements " + in_quotes(element));
}

// The reason why the elements make no mesh, or nothing.
std::string defect_of(const PlyHeader& header) {
  const auto is_vertex = [](const PlyElement& element) { return kind_of(element) == ElementKind::vertex; };
  const auto vertex_elements = std::count_if(header.elements.begin(), header.elements.end(), is_vertex);
  if (vertex_elements != 1)
    return "the header has " + std::to_string(vertex_elements) + " elements 'vertex', not one";
  for (const PlyElement& element : header.elements) {
    const std::vector<Role> roles = roles_of(element);
    const auto lacks = [&](Role role) { return std::find(roles.begin(), roles.end(), role) == roles.end(); };
    const ElementKind kind = kind_of(element);
    if (element.count == 0 || kind == ElementKind::other) continue;
    if (kind != ElementKind::vertex && lacks(Role::corners))
      return "the element " + in_quotes(element.name) + " has no list 'vertex_indices'";
    if (kind == ElementKind::vertex && (lacks(Role::x) || lacks(Role::y) || lacks(Role::z)))
      return "the element 'vertex' has no x, y and z";
  }
  return {};
}

template <class Values>
class PlyReader {
 public:
  PlyReader(std::string_view bytes, const PlyHeader& header)
      : header_(header),
        values_(bytes, header.data_begin),
        mesh_("tandem PLY", bytes.size()),
        strip_(mesh_) {}

  ReadResult read() {
    for (const PlyElement& element : header_.elements)
      if (kind_of(element) == ElementKind::vertex) vertices_promised_ = element.count;
    for (const PlyElement& next : header_.elements)
      if (!element(next)) return read_failure(std::move(error_));
    for (const PlyElement& left : header_.elements)
      if (left.name == "edge" && left.count > 0) mesh_.leave_out_lines();
    if (values_.bytes_left() > 0)
      mesh_.remark(std::to_string(values_.bytes_left()) + " bytes after the last element are passed over");
    return mesh_.finish();
  }

 private:
  bool element(const PlyElement& element) {
    // Records without properties take no bytes: a count of them may be anything. Without records, an element
    // need not have the properties that a mesh needs.
    if (element.properties.empty() || element.count == 0) return true;
    if (!has_room(element)) return false;
    element_ = &element;
    kind_ = kind_of(element);
    roles_ = roles_of(element);
    reserve(element);
    for (record_ = 0; record_ < element.count; ++record_)
      if (!record()) return false;
    return true;
  }

  // Before anything is reserved by a count, the file must be able to hold what it counts.
  bool has_room(const PlyElement& element) {
    std::size_t record_bytes = 0;
    for (const PlyProperty& property : element.properties) record_bytes += Values::least_bytes(property);
    const std::size_t most = values_.room() / record_bytes;
    if (element.count <= most) return true;
    return fail("the header promises " + counted(element.count, element.name) +
                ", the file has room for at most " + std::to_string(most));
  }

  void reserve(const PlyElement& element) {
    if (kind_ == ElementKind::vertex) mesh_.reserve_points(element.count);
    if (kind_ != ElementKind::face) return;
    const auto corners = std::find(roles_.begin(), roles_.end(), Role::corners) - roles_.begin();
    const PlyType type = element.properties[static_cast<std::size_t>(corners)].type;
    mesh_.reserve_faces(element.count,
                        std::min(3 * element.count, values_.room() / Values::least_item_bytes(type)));
  }

  bool record() {
    values_.begin_record();
    for (std::size_t i = 0; i < roles_.size(); ++i) {
      const PlyProperty& property = element_->properties[i];
      if (property.is_list) {
        list(property, roles_[i]);
      } else if (roles_[i] == Role::none) {
        values_.skip(property.type, 1);
      } else {
        point_[static_cast<std::size_t>(roles_[i]) - static_cast<std::size_t>(Role::x)] =
            values_.real(property.type);
      }
    }
    if (!check_record()) return false;
    if (!values_.end_record()) remark_long_line();
    finish_record();
    return true;
  }

  void list(const PlyProperty& property, Role role) {
    const std::int64_t length = values_.integer(property.count_type);
    if (length < 0) defect_ = "a list of length " + std::to_string(length);
    if (length <= 0) return;
    const auto items = static_cast<std::uint64_t>(length);
    if (role == Role::none) return values_.skip(property.type, items);
    for (std::uint64_t i = 0; i < items && values_.state() == PlyState::good; ++i) index(property.type);
  }

  void index(PlyType type) {
    const std::int64_t index = values_.integer(type);
    if (values_.state() != PlyState::good) return;
    if (kind_ == ElementKind::strips && (index == -1 || index == kNoVertex)) return strip_.restart();
    if (kind_ == ElementKind::strips) {
      strip_.add(index);
    } else {
      mesh_.add_corner(index);
    }
    const bool names_a_vertex = index >= 0 && static_cast<std::uint64_t>(index) < vertices_promised_;
    if (!names_a_vertex && mesh_.wants_index_remark()) remark_index(index);
  }

  void remark_index(std::int64_t index) {
    std::string place;
    if constexpr (std::is_same_v<Values, PlyTextValues>) {
      place = values_.line() + ": face index";
    } else {
      place = std::string(element_->name) + " " + std::to_string(record_) + ": index";
    }
    if (index == kNoIndex) return mesh_.remark_index(place + " is no integer");
    mesh_.remark_index(place, index, vertices_promised_);
  }

  void remark_long_line() {
    if constexpr (std::is_same_v<Values, PlyTextValues>) {
      if (!std::exchange(any_long_line_, true))
        mesh_.remark(values_.line() + ": more values than the header lists for " + in_quotes(element_->name));
    }
  }

  void finish_record() {
    if (kind_ == ElementKind::vertex) mesh_.add_point(point_);
    if (kind_ == ElementKind::face) mesh_.end_face();
    if (kind_ == ElementKind::strips) strip_.restart();
  }

  bool check_record() {
    constexpr std::size_t kMostNameBytes = 40;
    if (values_.state() == PlyState::bad) return fail(values_.reason());
    if (values_.state() == PlyState::ended)
      return fail("the header promises " + counted(element_->count, element_->name) +
                  ", the data ends after " + std::to_string(record_));
    if (!defect_.empty())
      return fail(printable(element_->name, kMostNameBytes) + " " + std::to_string(record_) + " has " +
                  defect_);
    return true;
  }

  bool fail(std::string reason) {
    error_ = std::move(reason);
    return false;
  }

  const PlyHeader& header_;
  Values values_;
  MeshAssembly mesh_;
  TriangleStrip strip_;
  std::uint64_t vertices_promised_ = 0;
  const PlyElement* element_ = nullptr;  // the one at hand, its kind and roles, and the record at hand
  ElementKind kind_ = ElementKind::other;
  std::vector<Role> roles_;
  std::uint64_t record_ = 0;
  Point point_{};
  std::string defect_;  // of the record at hand
  bool any_long_line_ = false;
  std::string error_;
};

}  // namespace

ReadResult read_ply(std::string_view bytes) {
  if (bytes.empty()) return read_failure("the file is empty");
  PlyHeader header;
  std::string defect = read_ply_header(bytes, header);
  if (defect.empty()) defect = defect_of(header);
  if (!defect.empty()) return read_failure(std::move(defect));
  switch (header.format) {
    case PlyFormat::ascii:
      return PlyReader<PlyTextValues>(bytes, header).read();
    case PlyFormat::binary_little_endian:
      return PlyReader<PlyBinaryValues<std::endian::little>>(bytes, header).read();
    case PlyFormat::binary_big_endian:
      return PlyReader<PlyBinaryValues<std::endian::big>>(bytes, header).read();
  }
  return read_failure("a format that is none");
}

}  // namespace tandem::build
