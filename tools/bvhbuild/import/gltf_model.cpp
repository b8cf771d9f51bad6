#include "gltf_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/printable.h"

namespace tandem::build {
namespace {

constexpr const char* kGltf1 = "is glTF 1; Tandem reads glTF 2";
constexpr const char* kDraco =
    "its meshes are compressed with KHR_draco_mesh_compression, which Tandem's glTF reader does not decode";

/// Required extensions that say nothing about where triangles are, or nothing that we do not do anyway.
bool leaves_triangles_alone(std::string_view extension) {
  for (const char* start : {"KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_"})
    if (extension.starts_with(start)) return true;
  return extension == "KHR_mesh_quantization";
}

void check_required_extensions(const std::vector<std::string>& required, std::vector<std::string>& remarks) {
  constexpr std::size_t kMostRemarks = 2;
  for (const std::string& name : required) {
    if (name == "KHR_draco_mesh_compression") throw GltfError(kDraco);
    // assimp 5.2.5 passes over these two and reads whatever bytes lie in their place.
    if (name == "EXT_meshopt_compression" || name == "KHR_meshopt_compression")
      throw GltfError("its buffers are compressed with " + name + ", which Tandem does not decode");
    if (name == "EXT_mesh_gpu_instancing")
      throw GltfError("its meshes are repeated by EXT_mesh_gpu_instancing, which Tandem does not read");
    if (!leaves_triangles_alone(name) && remarks.size() < kMostRemarks)
      remarks.push_back("requires the extension " + in_quotes(name) + ", which is passed over");
  }
}

GltfBufferSource buffer_source(const GltfObject& buffer, std::size_t index) {
  const std::string name = buffer.text("name");
  return {numbered("buffers", index) + (name.empty() ? "" : " " + in_quotes(name)), buffer.text("uri"),
          buffer.size("byteLength")};
}

GltfView view(const GltfObject& from) {
  return {from.index("buffer"), from.size("byteOffset"), from.size("byteLength"), from.size("byteStride")};
}

int components(const std::string& type) {
  for (const auto& [name, count] : {std::pair{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}})
    if (type == name) return count;
  return 0;  // matrices included: no position and no index is one
}

GltfAccessor accessor(const GltfObject& from) {
  GltfAccessor to{from.index("bufferView"),
                  from.size("byteOffset"),
                  from.required_size("count"),
                  from.index("componentType", 0),
                  components(from.text("type")),
                  from.truth("normalized"),
                  {}};
  from.with("sparse", [&to](const GltfObject& sparse) {
    to.sparse.emplace().count = sparse.required_size("count");
    sparse.with("indices", [&to](const GltfObject& indices) {
      to.sparse->index_view = indices.index("bufferView");
      to.sparse->index_offset = indices.size("byteOffset");
      to.sparse->index_type = indices.index("componentType", 0);
    });
    sparse.with("values", [&to](const GltfObject& values) {
      to.sparse->value_view = values.index("bufferView");
      to.sparse->value_offset = values.size("byteOffset");
    });
  });
  return to;
}

bool has_extension(const GltfObject& object, const char* name) {
  bool has = false;
  object.with("extensions", [&](const GltfObject& extensions) { has = extensions.has(name); });
  return has;
}

GltfPrimitive primitive(const GltfObject& from) {
  GltfPrimitive to{from.index("mode", 4), -1, from.index("indices"),
                   has_extension(from, "KHR_draco_mesh_compression")};
  from.with("attributes", [&to](const GltfObject& all) { to.positions = all.index("POSITION"); });
  return to;
}

bool has_weights(const GltfObject& object) {
  const std::vector<double> weights = object.list<double>("weights");
  return std::any_of(weights.begin(), weights.end(), [](double w) { return w != 0; });
}

GltfMesh mesh(const GltfObject& from) {
  GltfMesh to{from.text("name"), {}, has_weights(from)};
  from.each("primitives", [&to](const GltfObject& item) { to.primitives.push_back(primitive(item)); });
  return to;
}

/// Draco's data may be there without being required; then the plain accessors hold the triangles, or nothing.
void check_draco(const GltfModel& model) {
  for (const GltfMesh& mesh : model.meshes)
    for (const GltfPrimitive& primitive : mesh.primitives) {
      const auto index = static_cast<std::size_t>(primitive.positions);
      const bool is_known = primitive.positions >= 0 && index < model.accessors.size();
      if (primitive.has_draco && is_known && model.accessors[index].view == -1) throw GltfError(kDraco);
    }
}

/// A list of numbers that is there with the right length, or not at all.
std::vector<double> numbers(const GltfObject& node, const char* name, std::size_t wanted) {
  std::vector<double> result = node.list<double>(name);
  if (!result.empty() && result.size() != wanted)
    throw GltfError(node.path(name) + " has " + std::to_string(result.size()) + " numbers, not " +
                    std::to_string(wanted));
  return result;
}

/// Scale, then rotation by a quaternion x y z w, then translation. A quaternion stored in decimal is never
/// quite of length 1; dividing by its length leaves a rotation.
Affine from_parts(const GltfObject& node) {
  const std::vector<double> q = numbers(node, "rotation", 4), s = numbers(node, "scale", 3),
                            t = numbers(node, "translation", 3);
  Affine result = kIdentity;
  if (!q.empty()) {
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    if (x == 0 && y == 0 && z == 0 && w == 0)
      throw GltfError(node.path("rotation") + " is zero, which is no rotation");
    const double f = 2 / (x * x + y * y + z * z + w * w);
    result = {{{1 - f * (y * y + z * z), f * (x * y - z * w), f * (x * z + y * w), 0},
               {f * (x * y + z * w), 1 - f * (x * x + z * z), f * (y * z - x * w), 0},
               {f * (x * z - y * w), f * (y * z + x * w), 1 - f * (x * x + y * y), 0}}};
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3 && !s.empty(); ++column) result[row][column] *= s[column];
    if (!t.empty()) result[row][3] = t[row];
  }
  return result;
}

/// The map from a node to its parent. glTF keeps matrices column by column; their fourth row has no meaning
/// but 0 0 0 1.
Affine local_transform(const GltfObject& node) {
  const Affine parts = from_parts(node);
  const std::vector<double> m = numbers(node, "matrix", 16);
  if (m.empty()) return parts;
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || std::abs(m[15] - 1) >= 1e-6)
    throw GltfError(node.path("matrix") + " is not affine: its last row is not 0 0 0 1");
  Affine t{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) t[row][column] = m[4 * column + row];
  return t;
}

GltfNode node(const GltfObject& from) {
  return {from.text("name"),
          from.index("mesh"),
          from.list<int>("children"),
          local_transform(from),
          from.has("skin"),
          has_weights(from),
          has_extension(from, "EXT_mesh_gpu_instancing")};
}

/// The nodes that are no other's child, in their order.
std::vector<int> all_roots(const std::vector<GltfNode>& nodes) {
  std::vector<bool> is_child(nodes.size());
  for (const GltfNode& node : nodes)
    for (const int child : node.children)
      if (static_cast<std::size_t>(child) < nodes.size()) is_child[child] = true;
  std::vector<int> roots;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (!is_child[i]) roots.push_back(static_cast<int>(i));
  if (roots.empty() && !nodes.empty()) throw GltfError("its nodes are a cycle: each is another one's child");
  return roots;
}

void choose_scene(const GltfObject& root, GltfModel& model) {
  std::vector<std::vector<int>> scenes;
  root.each("scenes", [&](const GltfObject& scene) { scenes.push_back(scene.list<int>("nodes")); });
  const int chosen = root.index("scene", 0);
  if (scenes.empty()) {
    model.roots = all_roots(model.nodes);
    return;
  }
  const std::string of_all = numbered("scenes", chosen) + " of " + std::to_string(scenes.size());
  if (static_cast<std::size_t>(chosen) >= scenes.size()) throw GltfError("its default scene is " + of_all);
  model.roots = std::move(scenes[chosen]);
  if (scenes.size() > 1) model.remarks.push_back(of_all + " is read");
}

}  // namespace

std::string numbered(const char* list, std::int64_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

void check_gltf_version(const std::string& version) {
  if (version.empty()) throw GltfError("is no glTF: its JSON names no asset.version");
  if (version.starts_with("1.") || version == "1") throw GltfError(kGltf1);
  if (version.starts_with("2.") || version == "2") return;
  throw GltfError("is glTF " + in_quotes(version) + "; Tandem reads glTF 2");
}

GltfModel read_gltf_model(const GltfObject& root, GltfBufferPlaces places) {
  std::string version;
  root.with("asset", [&](const GltfObject& asset) { version = asset.text("version"); });
  check_gltf_version(version);
  GltfModel model;
  check_required_extensions(root.list<std::string>("extensionsRequired"), model.remarks);
  root.each("buffers", [&](const GltfObject& item) {
    model.buffers.push_back(read_gltf_buffer(buffer_source(item, model.buffers.size()), places));
  });
  for (const auto& [identity, file] : places.files) model.bytes_held += file->size();
  root.each("bufferViews", [&](const GltfObject& item) { model.views.push_back(view(item)); });
  root.each("accessors", [&](const GltfObject& item) { model.accessors.push_back(accessor(item)); });
  root.each("meshes", [&](const GltfObject& item) { model.meshes.push_back(mesh(item)); });
  check_draco(model);
  root.each("nodes", [&](const GltfObject& item) { model.nodes.push_back(node(item)); });
  choose_scene(root, model);
  return model;
}

bool is_for_another_gltf_reader(std::string_view error) {
  return error == kGltf1 || error == kDraco;
}

}  // namespace tandem::build
