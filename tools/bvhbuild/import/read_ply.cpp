#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/printable.h"
#include "mesh_assembly.h"
#include "readers.h"
#include "scanner.h"

namespace tandem::build {
namespace {

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t ply_type_bytes(PlyType type) {
  constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

bool is_real(PlyType type) {
  return type == PlyType::float32 || type == PlyType::float64;
}

struct PlyProperty {
  std::string_view name;
  PlyType type;
  bool is_list = false;
  PlyType count_type = PlyType::uint8;  ///< of a list's length
};

struct PlyElement {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

/// The header of a PLY file. The names look into the file's bytes.
struct PlyHeader {
  PlyFormat format = PlyFormat::ascii;
  std::vector<PlyElement> elements;
  std::size_t data_begin = 0;  ///< offset of the first byte after the header
};

struct TypeName {
  std::string_view name;
  PlyType type;
};

constexpr TypeName kTypeNames[] = {
    {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
    {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
    {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
    {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
    {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
    {"float64", PlyType::float64}};

class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, PlyHeader& header) : bytes_(bytes), header_(header) {
    if (bytes.starts_with("\xEF\xBB\xBF")) next_ = 3;
  }

  std::string read() {
    if (!magic()) return error_;
    while (next_line()) {
      if (line_ == "end_header") {
        header_.data_begin = next_;
        return has_format_ ? "" : "the header has no 'format' line";
      }
      if (!statement()) return error_;
    }
    return "the header has no 'end_header' line: the file was cut in its header";
  }

 private:
  // A line counts only with its end, because the one that a cut file stops in may be half of another word;
  // unless nothing can be missing from it.
  bool next_line() {
    std::size_t end = bytes_.find(line_end_, next_);
    if (end == std::string_view::npos) {
      if (trimmed(bytes_.substr(next_)) != "end_header") return false;
      end = bytes_.size();
    }
    ++line_number_;
    line_ = bytes_.substr(next_, end - next_);
    if (line_.ends_with('\r')) line_.remove_suffix(1);
    line_ = trimmed(line_);
    next_ = std::min(end + 1, bytes_.size());
    return true;
  }

  // The file's first line end is that of all header lines: LF (with or without a CR before it) or CR.
  bool magic() {
    const std::size_t first_end = bytes_.find_first_of("\r\n", next_);
    const bool only_cr = first_end != std::string_view::npos && bytes_[first_end] == '\r' &&
                         bytes_.substr(first_end + 1, 1) != "\n";
    if (only_cr) line_end_ = '\r';
    next_line();
    return line_ == "ply" || fail("the first line is not 'ply'");
  }

  bool statement() {
    const std::string_view keyword = take_word();
    if (keyword == "format") return format();
    if (keyword == "element") return element();
    if (keyword == "property") return property();
    if (keyword == "comment" || keyword == "obj_info" || keyword.empty()) return true;
    return fail(in_quotes(keyword) + " is no keyword of a PLY header");
  }

  bool format() {
    const std::string_view name = take_word();
    const std::string_view version = take_word();
    has_format_ = true;
    if (version != "1.0") return fail("PLY version " + in_quotes(version) + " is not 1.0");
    if (name == "ascii") {
      header_.format = PlyFormat::ascii;
    } else if (name == "binary_little_endian") {
      header_.format = PlyFormat::binary_little_endian;
    } else if (name == "binary_big_endian") {
      header_.format = PlyFormat::binary_big_endian;
    } else {
      return fail(in_quotes(name) + " is no format of a PLY file");
    }
    return true;
  }

  bool element() {
    PlyElement element;
    element.name = take_word();
    const std::string_view word = take_word();
    const char* const end = word.data() + word.size();
    std::int64_t count = 0;
    const bool is_count = !word.empty() && parse_integer(word.data(), end, count) == end && count >= 0;
    if (!is_count) return fail(in_quotes(word) + " is no count of " + in_quotes(element.name));
    element.count = static_cast<std::uint64_t>(count);
    header_.elements.push_back(std::move(element));
    return true;
  }

  bool property() {
    if (header_.elements.empty()) return fail("a property before the first element");
    PlyProperty property{};
    TextScanner ahead(line_);
    property.is_list = ahead.word() == "list";
    if (property.is_list) {
      take_word();
      if (!type(property.count_type)) return false;
      if (is_real(property.count_type)) return fail("the length of a list is no integer");
    }
    if (!type(property.type)) return false;
    property.name = take_word();
    if (property.name.empty()) return fail("a property without a name");
    header_.elements.back().properties.push_back(property);
    return true;
  }

  bool type(PlyType& type) {
    const std::string_view word = take_word();
    for (const TypeName& candidate : kTypeNames) {
      if (candidate.name != word) continue;
      type = candidate.type;
      return true;
    }
    return fail(in_quotes(word) + " is no type of a PLY property");
  }

  std::string_view take_word() {
    TextScanner scanner(line_);
    scanner.skip_blanks();
    const std::string_view word = scanner.word();
    line_ = trimmed(line_.substr(static_cast<std::size_t>(word.data() - line_.data()) + word.size()));
    return word;
  }

  bool fail(std::string reason) {
    error_ = "line " + std::to_string(line_number_) + ": " + std::move(reason);
    return false;
  }

  std::string_view bytes_;
  PlyHeader& header_;
  char line_end_ = '\n';
  std::size_t next_ = 0;  // offset of the line after the one at hand
  std::size_t line_number_ = 0;
  std::string_view line_;  // what is left of the line at hand
  bool has_format_ = false;
  std::string error_;
};

/// Reads the header of a PLY file into `header`.
///
/// The first line decides how lines end, so that binary data may begin with a byte that looks like a
/// line end.
/// Result: empty, or the reason why the header cannot be read, with its line.
std::string read_ply_header(std::string_view bytes, PlyHeader& header) {
  return HeaderReader(bytes, header).read();
}

/// The state of reading the values of a PLY file. Once it is not `good` it stays so, and all further values
/// are zero.
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

/// Reads the values of a PLY file in text, where every record of an element has a line of its own.
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

// Says what a property is to a mesh.
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
    mesh_.reserve_faces(
        element.count,
        std::min<std::uint64_t>(3 * element.count, values_.room() / Values::least_item_bytes(type)));
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
