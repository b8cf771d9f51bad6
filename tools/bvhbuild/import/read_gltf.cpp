#include "read_gltf.h"

#include "gltf_container.h"
#include "gltf_json.h"
#include "gltf_model.h"
#include "gltf_scene.h"

namespace tandem::build {
namespace {

GltfModel read_model(std::string_view bytes, const std::filesystem::path& folder, std::uint64_t most_bytes) {
  const GltfContainer file = open_gltf_container(bytes);
  const nlohmann::json json = parse_gltf_json(file.json, most_bytes);
  return read_gltf_model(GltfObject(json), {folder, file.is_binary, file.chunk, most_bytes});
}

}  // namespace

ReadResult read_gltf(std::string_view bytes, const std::filesystem::path& folder, std::uint64_t most_bytes) {
  try {
    return flatten_gltf(read_model(bytes, folder, most_bytes), most_bytes);
  } catch (const GltfError& error) {
    return read_failure(error.what());
  }
}

}  // namespace tandem::build
