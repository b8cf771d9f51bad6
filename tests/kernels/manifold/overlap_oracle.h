#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "tandem/kernels/detail/vector3.h"

/// The overlap of two solids, cut out exactly by CGAL.
namespace tandem::test {

using OracleTriangles = std::vector<std::array<manifold::Vector3, 3>>;

/// A connected piece of the overlap: its surface, outward normals by the order of corners.
struct OverlapPiece {
  OracleTriangles triangles;
  std::vector<bool> is_of_a;  ///< whether a triangle lies in the surface of a
  manifold::Vector3 area;     ///< of a's surface in it, as a vector along a's outward normal
  double whole_area_a = 0;    ///< the sum of its triangles' areas
  double whole_area_b = 0;    ///< the same of b's
  double volume = 0;
};

/// A closed surface that does not meet itself, its triangles counter-clockwise as seen from outside.
struct OracleSolid {
  std::vector<manifold::Vector3> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Returns whether a surface is what an OracleSolid has to be.
bool bounds_a_solid(const OracleSolid& solid);

/// Returns the pieces of the overlap. Coordinates are rounded at the very end only.
std::vector<OverlapPiece> overlap_of(const OracleSolid& a, const OracleSolid& b);

}  // namespace tandem::test
