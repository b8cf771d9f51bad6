#pragma once
#include <cstdint>
#include <span>

#include "tandem/build/clean_report.h"
#include "triangle_mesh.h"

namespace tandem::build {

/// What triangulate() makes of a mesh whose faces are triangles: those that are usable, in their order, the
/// others counted. face: of each triangle; empty: triangle i is face i.
TriangleMesh take_triangles(std::span<const Point> points, std::span<const TriangleIndices> triangles,
                            std::span<const std::uint32_t> face, CleanReport& report);

}  // namespace tandem::build
