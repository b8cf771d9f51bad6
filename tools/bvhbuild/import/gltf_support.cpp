#include "import/gltf_support.h"

#include <algorithm>

#include "import/printable.h"

namespace tandem::build {
namespace {

constexpr std::string_view kGltf1 = "is glTF 1; Tandem reads glTF 2";
constexpr std::string_view kDraco =
    "its meshes are compressed with KHR_draco_mesh_compression, which Tandem's "
    "glTF reader does not decode";

bool contains(const std::vector<std::string>& names, const char* name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Required extensions that say nothing about where triangles are, or nothing that we do not do anyway.
bool leaves_triangles_alone(std::string_view extension) {
  for (const char* start : {"KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_"})
    if (extension.starts_with(start)) return true;
  return extension == "KHR_mesh_quantization";
}

}  // namespace

std::string check_gltf_version(const std::string& version) {
  if (version.empty()) return "is no glTF: its JSON names no asset.version";
  if (version.starts_with("1.") || version == "1") return std::string(kGltf1);
  if (version.starts_with("2.") || version == "2") return {};
  return "is glTF " + quoted(version) + "; Tandem reads glTF 2";
}

std::string check_required_extensions(const GltfJson& json) {
  if (contains(json.extensions_required, "KHR_draco_mesh_compression")) return needs_draco();
  // assimp 5.2.5 passes over these two and reads whatever bytes lie in their place.
  for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
    if (contains(json.extensions_required, name))
      return "its buffers are compressed with " + std::string(name) + ", which Tandem does not decode";
  if (contains(json.extensions_required, "EXT_mesh_gpu_instancing"))
    return "its meshes are repeated by EXT_mesh_gpu_instancing, which Tandem does not read";
  return {};
}

std::vector<std::string> remarks_on_extensions(const GltfJson& json) {
  constexpr std::size_t kMost = 2;
  std::vector<std::string> remarks;
  for (const std::string& name : json.extensions_required)
    if (!leaves_triangles_alone(name) && remarks.size() < kMost)
      remarks.push_back("requires the extension " + quoted(name) + ", which is passed over");
  return remarks;
}

bool uses_draco(const GltfJson& json) {
  return contains(json.extensions_used, "KHR_draco_mesh_compression");
}

std::string needs_draco() {
  return std::string(kDraco);
}

bool is_for_another_gltf_reader(std::string_view error) {
  return error == kGltf1 || error == kDraco;
}

}  // namespace tandem::build
