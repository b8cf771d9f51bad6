#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "triangle_mesh.h"

namespace tandem::build {

/// Splits polygons of any shape by a constrained Delaunay triangulation of their projection along a
/// coordinate axis. Keep one and use it for many polygons: it reuses its memory. One thread at a time.
class PolygonCdt {
 public:
  PolygonCdt();
  ~PolygonCdt();
  PolygonCdt(const PolygonCdt&) = delete;
  PolygonCdt& operator=(const PolygonCdt&) = delete;

  /// Effect: on success appends the triangles to `out`, as indices into `corners`, oriented as the polygon
  /// goes.
  ///
  /// Result: false, with `out` as it was, when two edges cross in the projection, when corners or edges that
  /// are apart in space touch in it, when all corners lie on one line in it, when nothing is inside, or when
  /// more than 10,000 corners run along each other again and again, which would take quadratic time.
  ///
  /// The outline may touch itself and may walk an edge to and fro (a bridge to a hole): the inside is what it
  /// winds round an odd number of times. A simple polygon of n corners gives exactly n - 2 triangles. Where
  /// several corners meet in the projection, a triangle uses the one whose angle it lies in.
  ///
  /// corners: at least 3, finite, no two consecutive ones at the same place
  /// axis: 0, 1 or 2, the coordinate that the projection leaves out
  bool triangulate(std::span<const Point> corners, int axis, std::vector<TriangleIndices>& out);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem::build
