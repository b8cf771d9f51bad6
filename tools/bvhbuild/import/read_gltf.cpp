#include "read_gltf.h"

#include "gltf_container.h"
#include "gltf_json.h"
#include "gltf_model.h"
#include "gltf_scene.h"

namespace tandem::build {
namespace {

GltfModel read_model(std::string_view bytes, const std::filesystem::path& folder, const ReadLimits& limits) {
  const GltfContainer file = open_gltf_container(bytes);
  const nlohmann::json json = parse_gltf_json(file.json, limits.memory_bytes);
  GltfModel model =
      read_gltf_model(GltfObject(json), {folder, file.is_binary, file.chunk, limits.memory_bytes, {}});
  model.bytes_held += bytes.size();
  return model;
}

}  // namespace

ReadResult read_gltf(std::string_view bytes, const std::filesystem::path& folder, const ReadLimits& limits) {
  try {
    return flatten_gltf(read_model(bytes, folder, limits), limits);
  } catch (const GltfError& error) {
    return read_failure(error.what());
  }
}

}  // namespace tandem::build
