#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::build {

/// A buffer as the JSON of a glTF file announces it.
struct GltfBufferSource {
  std::string name;
  std::string uri;  ///< empty: the binary chunk of a GLB file
  std::uint64_t bytes = 0;
};

/// What must be known of a glTF file's JSON before a library is let at it.
struct GltfJson {
  std::string error;  ///< empty, or what is wrong with it
  std::string version;
  std::vector<GltfBufferSource> buffers;
  std::vector<std::string> extensions_used;
  std::vector<std::string> extensions_required;
};

/// Scans the JSON of a glTF file without building anything of it.
///
/// tinygltf passes over what has the wrong type (a mesh "0" leaves its node without one) and cuts integers to
/// 32 bits, so all members that say where triangles are must have their type here. Null counts as left out.
/// Errors: text that is no JSON or nested more than 500 deep (what walks through it may recurse); a member
/// of the wrong type: "nodes[3].mesh is no unsigned integer below 2147483648".
GltfJson scan_gltf_json(std::string_view text);

}  // namespace tandem::build
