#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "polygon_mesh.h"
#include "tandem/build/clean_report.h"

namespace tandem::build {

/// Threads take so many triangles of a mesh at once.
inline constexpr std::size_t kTrianglesAtOnce = 1 << 14;

/// The triangles of a file with its float64 coordinates. Every index is below points.size(), every coordinate
/// that a triangle uses is finite and at most kMaxCoordinate in magnitude.
struct TriangleMesh {
  std::vector<Point> points;
  std::vector<TriangleIndices> triangles;
  std::vector<std::uint32_t> face;  ///< of each triangle: the face of the file that it is a piece of
};

/// Whether a face can be split into triangles: its indices are in range, it has three corners or more, and
/// their coordinates are finite and at most kMaxCoordinate in magnitude. Else it is counted, under the first
/// of these that fails.
bool is_usable(std::span<const Point> points, std::span<const std::uint32_t> corners, CleanReport& report);

/// Of so many points: those that none of the corners names.
std::uint64_t count_unreferenced(std::size_t points, std::span<const std::uint32_t> corners);

/// What triangulate() makes of a mesh whose faces are triangles: those that are usable, in their order, the
/// others counted. face: of each triangle; empty: triangle i is face i.
TriangleMesh take_triangles(std::span<const Point> points, std::span<const TriangleIndices> triangles,
                            std::span<const std::uint32_t> face, CleanReport& report);

}  // namespace tandem::build
