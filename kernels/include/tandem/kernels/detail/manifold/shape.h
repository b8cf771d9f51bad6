#pragma once
#include "tandem/kernels/detail/manifold/body.h"

namespace tandem::manifold {

/// What manifolds need to know of a level of an asset. Condition: it has topology.
inline Shape shape_of(const FileHeader& header, const LevelView& level) {
  Shape shape;
  shape.triangles = level.triangles;
  shape.topology = level.topology;
  shape.blocks = level.blocks;
  shape.oriented_blocks = level.oriented_blocks;
  double lower[3], upper[3];
  for (int k = 0; k < 3; ++k) {
    shape.origin[k] = header.origin[k];
    lower[k] = double{header.lower[k]}, upper[k] = double{header.upper[k]};
  }
  shape.center = {(lower[0] + upper[0]) / 2, (lower[1] + upper[1]) / 2, (lower[2] + upper[2]) / 2};
  shape.diagonal = norm(Vector3{upper[0], upper[1], upper[2]} - Vector3{lower[0], lower[1], lower[2]});
  shape.closed = level.closed;
  return shape;
}

}  // namespace tandem::manifold
