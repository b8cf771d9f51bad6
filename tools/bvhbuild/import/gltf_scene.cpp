#include "gltf_scene.h"

#include <utility>
#include <vector>

#include "common/printable.h"

namespace tandem::build {
namespace {

constexpr std::size_t kLongEnough = 2000;  ///< of names, more than any report shows

GltfPlace child_place(const GltfPlace& parent, const GltfNode& node, std::size_t index) {
  GltfPlace place{combined(parent.world, node.local), parent.path};
  if (parent.path->size() < kLongEnough)
    place.path = std::make_shared<std::string>(*parent.path + (parent.path->empty() ? "" : "/") +
                                               name_or_number(node.name, "nodes", index));
  return place;
}

/// A node on the way through the forest. The way is kept in a list: trees of hostile files are deeper than a
/// stack.
struct Step {
  int node;
  std::shared_ptr<const GltfPlace> parent;
};

void push_backwards(const std::vector<int>& nodes, const std::shared_ptr<const GltfPlace>& parent,
                    std::vector<Step>& pending) {
  for (std::size_t i = nodes.size(); i-- > 0;) pending.push_back({nodes[i], parent});
}

}  // namespace

std::string described(const char* list, std::size_t index, std::string_view name) {
  return name.empty() ? numbered(list, index) : numbered(list, index) + " " + in_quotes(name);
}

// Nobody sees the end of a long name.
std::string name_or_number(const std::string& name, const char* list, std::size_t index) {
  return name.empty() ? numbered(list, index) : name.substr(0, kLongEnough);
}

void walk_scene(const GltfModel& model,
                const std::function<void(std::size_t node, const GltfPlace& place)>& visit) {
  std::vector<bool> seen(model.nodes.size());
  std::vector<Step> pending;
  push_backwards(model.roots, std::make_shared<GltfPlace>(), pending);
  while (!pending.empty()) {
    const Step step = std::move(pending.back());
    pending.pop_back();
    const auto index = static_cast<std::size_t>(step.node);
    if (step.node < 0 || index >= model.nodes.size())
      throw GltfError(numbered("nodes", index) + " is named, but there are " +
                      std::to_string(model.nodes.size()));
    const GltfNode& node = model.nodes[index];
    if (seen[index])
      throw GltfError(described("nodes", index, node.name) +
                      " is reached twice: nodes must form trees, without cycles and second parents");
    seen[index] = true;
    const auto place = std::make_shared<const GltfPlace>(child_place(*step.parent, node, index));
    visit(index, *place);
    push_backwards(node.children, place, pending);
  }
}

void each_primitive(const GltfMesh& mesh, std::size_t index,
                    const std::function<void(const GltfPrimitive& primitive, const std::string& name)>& use) {
  for (std::size_t i = 0; i < mesh.primitives.size(); ++i) {
    const std::string name = described("meshes", index, mesh.name) + ", primitive " + std::to_string(i);
    try {
      use(mesh.primitives[i], name);
    } catch (const GltfError& error) {
      throw GltfError(name + ": " + error.what());
    }
  }
}

ParsedGltf parse_gltf(std::string_view bytes, const std::filesystem::path& folder, const ReadLimits& limits) {
  const GltfContainer file = open_gltf_container(bytes);
  ParsedGltf parsed{parse_gltf_json(file.json, limits.memory_bytes), {}};
  parsed.model = read_gltf_model(GltfObject(parsed.json), {folder, file.is_binary, file.chunk,
                                                           limits.memory_bytes, limits.outside_files});
  parsed.model.bytes_held += bytes.size();
  return parsed;
}

}  // namespace tandem::build
