#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace tandem::build {

using Point = std::array<double, 3>;

/// A vertex index that names no vertex, whatever their number: what a reader stores for an index that cannot
/// be represented (negative, 0 in an OBJ file, beyond 2^32 - 2).
inline constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;

/// A run of consecutive faces that the file gives a name: an OBJ object or group, a glTF mesh at a node, an
/// STL solid.
struct SourcePart {
  std::string name;  ///< of the mesh, object, group or solid; may be empty
  std::string
      node_path;  ///< names of the scene nodes from the root, joined by '/'; empty where files have none
  std::uint64_t first_face = 0;
  std::uint64_t face_count = 0;
};

/// What a file holds instead of faces. Readers leave it out.
struct LeftOut {
  bool points = false, lines = false;
  bool strip_turns = false;  ///< triangles of a strip that name a vertex twice: they only lead it elsewhere
};

/// What a reader hands over: the polygons of a file, in the file's order, with the file's float64
/// coordinates. Nothing in it is checked but its shape: indices may be out of range, coordinates not finite,
/// polygons degenerate. Points and lines of formats that tell them from faces are left out. Whatever the file
/// calls a face counts, also one of fewer than three corners: face f is the f-th that the modeller wrote.
struct PolygonMesh {
  std::vector<Point> points;
  std::vector<std::uint32_t> corners;        ///< vertex indices of all faces, one face after the other
  std::vector<std::uint32_t> face_begin{0};  ///< face f has corners [face_begin[f], face_begin[f + 1])
  std::vector<SourcePart> parts;             ///< ascending, without gaps, together all faces
  LeftOut left_out;
  std::string reader;             ///< who read the file, for the report: "tandem PLY", "assimp 5.2.5"
  bool single_precision = false;  ///< the reader keeps only float32 of each coordinate
  std::vector<std::string>
      remarks;  ///< oddities worth telling, at most a few: "line 12: face index 99 of 8 vertices"

  std::size_t face_count() const { return face_begin.size() - 1; }
};

}  // namespace tandem::build
