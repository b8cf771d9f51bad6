#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tree.h"

namespace tandem::build {

/// Returns what a block of these edges costs in tandem queries: its surface to the power 3/4. Visits
/// grow more slowly than surfaces, since a block meets others of its own size; of the powers tried this one
/// led to the fewest block pairs (docs/decisions/trees.md). A trace of the edge lengths and a constant are
/// added to the surface, so that flat, thin and point-like sets are still told apart and no cost is zero.
/// It is made of square roots, which every machine rounds alike. Condition: coordinates are scaled to about 1
/// (normalized_bounds()).
inline float visit_cost(float x, float y, float z) {
  const float surface = x * y + (y + x) * z + 1e-6f * (x + y + z) + 1e-20f;
  return std::sqrt(surface * std::sqrt(surface));
}

/// Bounds of a set of triangles while a tree is built; starts as the empty set. The fourth lane is padding,
/// which lets a compiler use one vector for each end.
struct alignas(16) Bounds {
  float lo[4] = {kInfinity, kInfinity, kInfinity, 0};
  float hi[4] = {-kInfinity, -kInfinity, -kInfinity, 0};

  static Bounds at_zero() { return {{0, 0, 0, 0}, {0, 0, 0, 0}}; }

  void grow(const Bounds& other) {
    for (int k = 0; k < 4; ++k) {
      lo[k] = std::min(lo[k], other.lo[k]);
      hi[k] = std::max(hi[k], other.hi[k]);
    }
  }

  /// Returns what a block over these bounds costs in tandem queries: visit_cost() of its edges.
  float visit_cost() const { return build::visit_cost(hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]); }

  /// The orders in which splits look at triangles: by twice the centre along each axis.
  static constexpr int kOrders = 3;
  float centre(int order) const { return lo[order] + hi[order]; }
  float extent(int axis) const { return hi[axis] - lo[axis]; }

  bool operator==(const Bounds& other) const {
    return std::equal(lo, lo + 3, other.lo) && std::equal(hi, hi + 3, other.hi);
  }

 private:
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
};

/// Bounds of a set of triangles in each of several samples of an animation; starts as the empty set in all of
/// them. What a block costs is the sum over the samples, so a tree over these bounds is made for their mean.
template <int kSamples>
struct SampledBounds {
  float lo[3][kSamples], hi[3][kSamples];

  SampledBounds() {
    std::fill_n(&lo[0][0], 3 * kSamples, std::numeric_limits<float>::infinity());
    std::fill_n(&hi[0][0], 3 * kSamples, -std::numeric_limits<float>::infinity());
  }

  void set(int sample, const Bounds& bounds) {
    for (int k = 0; k < 3; ++k) lo[k][sample] = bounds.lo[k], hi[k][sample] = bounds.hi[k];
  }

  void grow(const SampledBounds& other) {
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < kSamples; ++i) {
        lo[k][i] = std::min(lo[k][i], other.lo[k][i]);
        hi[k][i] = std::max(hi[k][i], other.hi[k][i]);
      }
    }
  }

  float visit_cost() const {
    float sum = 0;
    for (int i = 0; i < kSamples; ++i)
      sum += build::visit_cost(hi[0][i] - lo[0][i], hi[1][i] - lo[1][i], hi[2][i] - lo[2][i]);
    return sum;
  }

  /// The orders are by the centre along each axis, first over all samples and then in the first few samples.
  /// Four of them gave trees that are 2 % cheaper than none did, and eight no better ones
  /// (docs/deformables.md).
  static constexpr int kOrderedSamples = std::min(kSamples, 4);
  static constexpr int kOrders = 3 + 3 * kOrderedSamples;
  float centre(int order) const {
    const int axis = order % 3;
    if (order >= 3) {
      const int sample = order / 3 - 1;
      return lo[axis][sample] + hi[axis][sample];
    }
    float sum = 0;
    for (int i = 0; i < kSamples; ++i) sum += lo[axis][i] + hi[axis][i];
    return sum;
  }
  float extent(int axis) const {
    float sum = 0;
    for (int i = 0; i < kSamples; ++i) sum += hi[axis][i] - lo[axis][i];
    return sum;
  }

  bool operator==(const SampledBounds& other) const {
    return std::equal(&lo[0][0], &lo[0][0] + 3 * kSamples, &other.lo[0][0]) &&
           std::equal(&hi[0][0], &hi[0][0] + 3 * kSamples, &other.hi[0][0]);
  }
};

/// Calls use(type) for all types of bounds that trees are built over.
#define TANDEM_FOR_EACH_BOUNDS(use)                                              \
  use(Bounds) use(SampledBounds<4>) use(SampledBounds<8>) use(SampledBounds<16>) \
      use(SampledBounds<kMostTreeSamples>)

/// The bounds of all triangles, moved and scaled so that the lower corner of the mesh lies at zero and its
/// longest edge between 1 and 2: surfaces of huge, tiny or far meshes neither overflow nor vanish.
/// Coordinates are finite floats; their differences and the scaled ones are taken in float64.
std::vector<Bounds> normalized_bounds(const Geometry& geometry);

/// Returns the numbers below `count`, with `first` of them that are spread evenly over all before the others.
std::vector<std::size_t> spread_first(std::size_t count, std::size_t first);

/// The same in each sample of an animation: in that of the geometry and in each of its poses, or, where there
/// are more than kSamples, in as many that are spread evenly. A few that are spread over these come first,
/// for the orders of splits. Where there are fewer, all triangles lie at the lower corner in the others,
/// which costs next to nothing.
template <int kSamples>
std::vector<SampledBounds<kSamples>> normalized_samples(const Geometry& geometry) {
  std::vector<std::size_t> chosen = spread_first(1 + geometry.poses.size(), kSamples);
  chosen.resize(std::min<std::size_t>(chosen.size(), kSamples));
  const std::vector<std::size_t> order =
      spread_first(chosen.size(), SampledBounds<kSamples>::kOrderedSamples);
  std::vector<SampledBounds<kSamples>> all(geometry.triangles.size());
  for (int sample = 0; sample < kSamples; ++sample) {
    const auto place = static_cast<std::size_t>(sample);
    std::vector<Bounds> bounds;
    if (place < order.size()) bounds = normalized_bounds(geometry.sample(chosen[order[place]]));
    for (std::size_t t = 0; t < all.size(); ++t)
      all[t].set(sample, bounds.empty() ? Bounds::at_zero() : bounds[t]);
  }
  return all;
}

}  // namespace tandem::build
