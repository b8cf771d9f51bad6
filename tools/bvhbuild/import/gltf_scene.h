#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "gltf_model.h"
#include "import.h"

/// The way through the scene of a glTF file, which says in which order its vertices and triangles come.
namespace tandem::build {

/// The modes of a primitive; those from kTriangles to kTriangleFan make triangles.
enum GltfMode { kPoints = 0, kTriangles = 4, kTriangleStrip = 5, kTriangleFan = 6 };

inline bool has_triangles(const GltfPrimitive& primitive) {
  return primitive.mode >= kTriangles && primitive.mode <= kTriangleFan;
}

/// Names an item for messages: "nodes[3] 'wheel'".
std::string described(const char* list, std::size_t index, std::string_view name);

/// The name of a node or mesh for paths and parts. Those without a name are told apart by their number.
std::string name_or_number(const std::string& name, const char* list, std::size_t index);

/// The place of a node. Below a long path, nodes share it.
struct GltfPlace {
  Affine world = kIdentity;
  std::shared_ptr<const std::string> path = std::make_shared<std::string>();
};

/// Calls `visit(index, place)` for all nodes of the scene, depth first, parents before their children. No
/// node is visited twice, so the way ends. Throws a GltfError for nodes that are no tree, or that are not
/// there.
void walk_scene(const GltfModel& model,
                const std::function<void(std::size_t node, const GltfPlace& place)>& visit);

/// Calls `use(primitive, name)` for the primitives of a mesh; errors begin with the name.
void each_primitive(const GltfMesh& mesh, std::size_t index,
                    const std::function<void(const GltfPrimitive& primitive, const std::string& name)>& use);

/// The JSON of a glTF file and the model in it.
struct ParsedGltf {
  nlohmann::json json;
  GltfModel model;
};

/// Reads the model of a glTF file, text or binary. `bytes` must outlive it. Throws a GltfError.
ParsedGltf parse_gltf(std::string_view bytes, const std::filesystem::path& folder, const ReadLimits& limits);

}  // namespace tandem::build
