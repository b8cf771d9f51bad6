#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "tandem/build/clean_report.h"
#include "triangle_mesh.h"

namespace tandem::build {

/// The geometry as the .bvh file keeps it: a vertex lies at origin + point, rounded once.
struct StoredMesh {
  Point origin{};                            ///< float64; zero when every coordinate is a float32 number
  std::vector<std::array<float, 3>> points;  ///< relative to origin, finite
  std::vector<TriangleIndices> triangles;
  std::vector<std::uint32_t> face;    ///< source face of each triangle
  double largest_rounding_error = 0;  ///< of any coordinate: |origin + point - vertex|, in the file's unit
};

/// Rounds a mesh to float32, the one rounding that geometry suffers here.
///
/// Effect: takes everything out of `mesh`; counts in `report` the triangles that become flat by the rounding.
/// They stay: a flat triangle is the hull of its points.
///
/// The origin is zero when every coordinate is a
/// float32 number already, so that nothing is rounded. Otherwise it is, axis by axis, zero when the box lies
/// near zero (|centre| <= half extent of the longest axis: moving could win at most one bit), else the centre
/// of the box on a coarse grid.
///
/// mesh: cleaned (no unused vertices, which would take part in the box)
StoredMesh to_single_precision(TriangleMesh& mesh, CleanReport& report);

}  // namespace tandem::build
