#include <algorithm>
#include <array>
#include <cmath>

#include "parallel/parallel.h"
#include "splitter.h"

namespace tandem::build {
namespace {

constexpr int kBins = 32;
constexpr std::size_t kGrain = 1 << 15;

// How centres along one axis fall into bins.
struct Binning {
  float lo = 0, scale = 0;

  // Bounds that nearly coincide or lie too far apart for float32 give no finite place; then there is one bin.
  int bin(float center) const {
    const float place = (center - lo) * scale;
    return std::isfinite(place) ? std::clamp(static_cast<int>(place), 0, kBins - 1) : 0;
  }
};

struct Bin {
  Bounds bounds;
  std::uint32_t count = 0;
};

using Bins = std::array<std::array<Bin, kBins>, 3>;

void merge(Bins& into, const Bins& from) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int b = 0; b < kBins; ++b) {
      into[axis][b].bounds.grow(from[axis][b].bounds);
      into[axis][b].count += from[axis][b].count;
    }
  }
}

// The legal split nearest to `wanted`; legal ones lie at most 12 apart away from the ends. 0 if there is none
// so near.
std::uint32_t nearest_legal(std::uint32_t wanted, std::uint32_t n,
                            const TriangleSplitter::IsLegal& is_legal) {
  for (std::uint32_t distance = 0; distance <= 16; ++distance) {
    if (wanted > distance && is_legal(wanted - distance)) return wanted - distance;
    if (wanted + distance < n && is_legal(wanted + distance)) return wanted + distance;
  }
  return 0;
}

// The cheapest split of one axis between two bins. The few triangles between a bin's edge and the nearest
// legal split hardly change the costs, so those of the bins stand for them.
Split best_of(int axis, const std::array<Bin, kBins>& bins, std::uint32_t n,
              const TriangleSplitter::IsLegal& is_legal) {
  float right_each[kBins];
  Bounds right;
  for (int b = kBins - 1; b > 0; --b) {
    right.grow(bins[b].bounds);
    right_each[b] = right.visit_cost();
  }
  Split best;
  best.axis = axis;
  Bounds left;
  std::uint32_t count = 0;
  const UnevenPenalty penalty(n);
  for (int b = 1; b < kBins; ++b) {
    left.grow(bins[b - 1].bounds);
    count += bins[b - 1].count;
    if (count == 0 || count == n) continue;
    const std::uint32_t split = nearest_legal(count, n, is_legal);
    const float total =
        left.visit_cost() * static_cast<float>(split) + right_each[b] * static_cast<float>(n - split);
    const float cost = total * penalty.factor(split);
    if (split != 0 && cost < best.cost) {
      best.cost = cost;
      best.left = split;
    }
  }
  return best;
}

}  // namespace

// Unions and sums in any order give the same bits, so threads may share the work without changing the result.
Split TriangleSplitter::best_binned_split(Range range, const IsLegal& is_legal) const {
  const auto triangles = order(range);
  const Bounds centers = parallel::reduce(
      triangles.size(), kGrain, Bounds(),
      [&](Bounds& bounds, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
          for (int k = 0; k < 3; ++k) {
            const float c = center(triangles[i], k);
            bounds.lo[k] = std::min(bounds.lo[k], c);
            bounds.hi[k] = std::max(bounds.hi[k], c);
          }
        }
      },
      [](Bounds& sum, const Bounds& other) { sum.grow(other); });
  Binning binning[3];
  for (int k = 0; k < 3; ++k) {
    const float length = centers.hi[k] - centers.lo[k];
    binning[k] = {centers.lo[k], length > 0 ? static_cast<float>(kBins) / length : 0};
  }
  const Bins bins = parallel::reduce(
      triangles.size(), kGrain, Bins(),
      [&](Bins& partial, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
          for (int k = 0; k < 3; ++k) {
            Bin& bin = partial[k][binning[k].bin(center(triangles[i], k))];
            bin.bounds.grow(bounds_[triangles[i]]);
            ++bin.count;
          }
        }
      },
      merge);
  Split best;
  for (int axis = 0; axis < 3; ++axis) {
    const Split split = best_of(axis, bins[axis], range.size(), is_legal);
    if (split.cost < best.cost) best = split;
  }
  return best;
}

}  // namespace tandem::build
