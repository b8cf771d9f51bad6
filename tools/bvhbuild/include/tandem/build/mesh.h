#pragma once
#include <array>
#include <cstdint>
#include <string>

namespace tandem::build {

using Point = std::array<double, 3>;
using TriangleIndices =
    std::array<std::uint32_t, 3>;  ///< vertex indices, in the order that the face goes round

/// A run of consecutive faces that the file gives a name: an OBJ object or group, a glTF mesh at a node, an
/// STL solid.
struct SourcePart {
  std::string name;  ///< of the mesh, object, group or solid; may be empty
  std::string
      node_path;  ///< names of the scene nodes from the root, joined by '/'; empty where files have none
  std::uint64_t first_face = 0;
  std::uint64_t face_count = 0;
};

}  // namespace tandem::build
