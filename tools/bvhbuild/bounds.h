#pragma once
#include <algorithm>
#include <limits>

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

  /// What the surface-area heuristic weighs: half the surface, plus a trace of the edge lengths and a
  /// constant, so that flat, thin and point-like sets are still told apart and no cost is zero. Condition:
  /// coordinates are scaled to about 1 (see Normalization in splitter.cpp).
  float surface() const {
    const float x = hi[0] - lo[0], y = hi[1] - lo[1], z = hi[2] - lo[2];
    return x * y + (y + x) * z + 1e-6f * (x + y + z) + 1e-20f;
  }

 private:
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
};

}  // namespace tandem::build
