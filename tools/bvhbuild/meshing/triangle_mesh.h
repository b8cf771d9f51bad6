#pragma once
#include <cstdint>
#include <vector>

#include "polygon_mesh.h"

namespace tandem::build {

/// The triangles of a file with its float64 coordinates. Every index is below points.size(), every coordinate
/// that a triangle uses is finite and at most kMaxCoordinate in magnitude.
struct TriangleMesh {
  std::vector<Point> points;
  std::vector<TriangleIndices> triangles;
  std::vector<std::uint32_t> face;  ///< of each triangle: the face of the file that it is a piece of
};

}  // namespace tandem::build
