#pragma once
#include "kernels/manifold/body.h"

namespace tandem::manifold {

/// lower, upper, origin: as a file's header has them.
TANDEM_HD inline void set_bounds(const float (&lower)[3], const float (&upper)[3], const double (&origin)[3],
                                 Shape& shape) {
  const Vector3 from = {lower[0], lower[1], lower[2]}, to = {upper[0], upper[1], upper[2]};
  for (int k = 0; k < 3; ++k) shape.origin[k] = origin[k];
  shape.centre = 0.5 * (from + to);
  shape.diagonal = norm(to - from);
}

/// Returns what manifolds need to know of a level with these bounds. Condition: it has topology.
TANDEM_HD inline Shape shape_of(const LevelView& level, const float (&lower)[3], const float (&upper)[3],
                                const double (&origin)[3]) {
  Shape shape;
  shape.triangles = level.triangles;
  shape.topology = level.topology;
  shape.blocks = level.blocks;
  shape.oriented_blocks = level.oriented_blocks;
  set_bounds(lower, upper, origin, shape);
  shape.triangle_count = level.triangle_count;
  shape.closed = level.closed;
  return shape;
}

}  // namespace tandem::manifold
