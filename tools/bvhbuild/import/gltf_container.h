#pragma once
#include <string>
#include <string_view>

namespace tandem::build {

/// Where the JSON of a glTF file lies, which is either text or a binary container (GLB).
struct GltfContainer {
  std::string error;  ///< empty, or what is wrong with the container
  bool is_binary = false;
  unsigned version = 2;  ///< of the container; nothing else is known of another than 2
  std::string_view json;
};

/// Finds the JSON by what the bytes are, whatever the file's ending, and makes sure that the chunks of a GLB
/// lie inside the file (glTF 2.0, section 4.4).
GltfContainer open_gltf_container(std::string_view bytes);

}  // namespace tandem::build
