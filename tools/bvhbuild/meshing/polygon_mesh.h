#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "tandem/build/mesh.h"

namespace tandem::build {

/// A vertex index that names no vertex, whatever their number: what a reader stores for an index that cannot
/// be represented (negative, 0 in an OBJ file, beyond 2^32 - 2).
inline constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;

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
