#pragma once
#include <string_view>

namespace tandem::build {

/// Where the parts of a glTF file lie, which is either JSON text or a binary container (GLB).
struct GltfContainer {
  bool is_binary = false;
  std::string_view json;
  std::string_view chunk;  ///< the binary one; empty when there is none
};

/// Finds the parts by what the bytes are, whatever the file's ending. Chunks of a GLB begin where the one
/// before ends, padded or not; those of other types are passed over (glTF 2.0, section 4.4).
///
/// Throws a GltfError for chunks that reach out of the file, and for another version than 2.
GltfContainer open_gltf_container(std::string_view bytes);

}  // namespace tandem::build
