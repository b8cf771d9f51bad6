#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tree.h"

namespace tandem::build {

/// Bounds of a set of triangles while a tree is built; starts as the empty set. The fourth lane is padding,
/// which lets a compiler use one vector for each end.
struct alignas(16) Bounds {
  float lo[4] = {kInfinity, kInfinity, kInfinity, 0};
  float hi[4] = {-kInfinity, -kInfinity, -kInfinity, 0};

  void grow(const Bounds& other) {
    for (int k = 0; k < 4; ++k) {
      lo[k] = std::min(lo[k], other.lo[k]);
      hi[k] = std::max(hi[k], other.hi[k]);
    }
  }

  /// Returns what a block over these bounds costs in tandem queries: its surface to the power 3/4. Visits
  /// grow more slowly than surfaces, since a block meets others of its own size; of the powers tried this one
  /// led to the fewest block pairs (docs/decisions/trees.md). A trace of the edge lengths and a constant are
  /// added to the surface, so that flat, thin and point-like sets are still told apart and no cost is zero.
  /// Made of square roots, which every machine rounds alike. Condition: coordinates are scaled to about 1
  /// (normalized_bounds()).
  float visit_cost() const {
    const float x = hi[0] - lo[0], y = hi[1] - lo[1], z = hi[2] - lo[2];
    const float surface = x * y + (y + x) * z + 1e-6f * (x + y + z) + 1e-20f;
    return std::sqrt(surface * std::sqrt(surface));
  }

 private:
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
};

/// The bounds of all triangles, moved and scaled so that the lower corner of the mesh lies at zero and its
/// longest edge between 1 and 2: surfaces of huge, tiny or far meshes neither overflow nor vanish.
/// Coordinates are finite floats; their differences and the scaled ones are taken in float64.
std::vector<Bounds> normalized_bounds(const Geometry& geometry);

}  // namespace tandem::build
