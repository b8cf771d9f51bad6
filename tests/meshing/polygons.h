#pragma once
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "bvhbuild/meshing/meshing.h"

namespace tandem::build {

/// A polygon of integer points in the plane: its areas can be computed exactly.
struct GridPoint {
  std::int64_t x = 0;
  std::int64_t y = 0;
  bool operator==(const GridPoint&) const = default;
};
using GridPolygon = std::vector<GridPoint>;

/// Twice the signed area of a triangle, exact.
std::int64_t twice_area(const GridPoint& a, const GridPoint& b, const GridPoint& c);
/// Twice the signed area of a polygon, exact.
std::int64_t twice_area(const GridPolygon& polygon);

/// Adds a face over existing points.
void add_face(PolygonMesh& mesh, std::initializer_list<std::uint32_t> corners);

/// One face over its own points, in the plane z = 0.
PolygonMesh flat_face(const GridPolygon& polygon);

/// Whether the triangles, as indices into `polygon`, tile it: all have its orientation and some area, their
/// areas add up exactly, and each edge of the outline belongs to one of them while every other edge belongs
/// to two, once in each direction.
bool tiles(const std::vector<TriangleIndices>& triangles, const GridPolygon& polygon);

}  // namespace tandem::build
