#include "read_ply.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "mesh_assembly.h"
#include "ply_header.h"
#include "ply_values.h"
#include "triangle_strip.h"

namespace tandem::build {
namespace {

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

  ReadResult read();

 private:
  bool element(const PlyElement& element);
  bool has_room(const PlyElement& element);
  void reserve(const PlyElement& element);
  bool record();
  void list(const PlyProperty& property, Role role);
  void index(PlyType type);
  void remark_index(std::int64_t index);
  void remark_long_line();
  void finish_record();
  bool check_record();
  bool fail(std::string reason);

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

template <class Values>
ReadResult PlyReader<Values>::read() {
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

template <class Values>
bool PlyReader<Values>::element(const PlyElement& element) {
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
template <class Values>
bool PlyReader<Values>::has_room(const PlyElement& element) {
  std::size_t record_bytes = 0;
  for (const PlyProperty& property : element.properties) record_bytes += Values::least_bytes(property);
  const std::size_t most = values_.room() / record_bytes;
  if (element.count <= most) return true;
  return fail("the header promises " + counted(element.count, element.name) +
              ", the file has room for at most " + std::to_string(most));
}

template <class Values>
void PlyReader<Values>::reserve(const PlyElement& element) {
  if (kind_ == ElementKind::vertex) mesh_.reserve_points(element.count);
  if (kind_ != ElementKind::face) return;
  const auto corners = std::find(roles_.begin(), roles_.end(), Role::corners) - roles_.begin();
  const PlyType type = element.properties[static_cast<std::size_t>(corners)].type;
  mesh_.reserve_faces(element.count,
                      std::min(3 * element.count, values_.room() / Values::least_item_bytes(type)));
}

template <class Values>
bool PlyReader<Values>::record() {
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

template <class Values>
void PlyReader<Values>::list(const PlyProperty& property, Role role) {
  const std::int64_t length = values_.integer(property.count_type);
  if (length < 0) defect_ = "a list of length " + std::to_string(length);
  if (length <= 0) return;
  const auto items = static_cast<std::uint64_t>(length);
  if (role == Role::none) return values_.skip(property.type, items);
  for (std::uint64_t i = 0; i < items && values_.state() == PlyState::good; ++i) index(property.type);
}

template <class Values>
void PlyReader<Values>::index(PlyType type) {
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

template <class Values>
void PlyReader<Values>::remark_index(std::int64_t index) {
  std::string place;
  if constexpr (std::is_same_v<Values, PlyTextValues>) {
    place = values_.line() + ": face index";
  } else {
    place = std::string(element_->name) + " " + std::to_string(record_) + ": index";
  }
  if (index == kNoIndex) return mesh_.remark_index(place + " is no integer");
  mesh_.remark_index(place, index, vertices_promised_);
}

template <class Values>
void PlyReader<Values>::remark_long_line() {
  if constexpr (std::is_same_v<Values, PlyTextValues>) {
    if (!std::exchange(any_long_line_, true))
      mesh_.remark(values_.line() + ": more values than the header lists for " + in_quotes(element_->name));
  }
}

template <class Values>
bool PlyReader<Values>::check_record() {
  constexpr std::size_t kMostNameBytes = 40;
  if (values_.state() == PlyState::bad) return fail(values_.reason());
  if (values_.state() == PlyState::ended)
    return fail("the header promises " + counted(element_->count, element_->name) + ", the data ends after " +
                std::to_string(record_));
  if (!defect_.empty())
    return fail(printable(element_->name, kMostNameBytes) + " " + std::to_string(record_) + " has " +
                defect_);
  return true;
}

template <class Values>
void PlyReader<Values>::finish_record() {
  if (kind_ == ElementKind::vertex) mesh_.add_point(point_);
  if (kind_ == ElementKind::face) mesh_.end_face();
  if (kind_ == ElementKind::strips) strip_.restart();
}

template <class Values>
bool PlyReader<Values>::fail(std::string reason) {
  error_ = std::move(reason);
  return false;
}

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
