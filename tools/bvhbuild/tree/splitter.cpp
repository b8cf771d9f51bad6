#include "splitter.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "parallel/parallel.h"

namespace tandem::build {
namespace {

// Calls body(0), body(1), ... for so many orders, at once if the group is large.
template <typename Body>
void for_each_order(int orders, Range range, const Body& body) {
  if (range.size() < kSerialSize) {
    for (int axis = 0; axis < orders; ++axis) body(axis);
  } else {
    parallel::for_each(static_cast<std::size_t>(orders),
                       [&](std::size_t axis) { body(static_cast<int>(axis)); });
  }
}

constexpr int kBins = 32;
constexpr std::size_t kGrain = 1 << 15;

// The least and greatest centre in each order.
template <int kOrders>
struct CentreRange {
  float lo[kOrders], hi[kOrders];

  CentreRange() {
    std::fill_n(lo, kOrders, std::numeric_limits<float>::infinity());
    std::fill_n(hi, kOrders, -std::numeric_limits<float>::infinity());
  }
  void grow(int order, float centre) {
    lo[order] = std::min(lo[order], centre);
    hi[order] = std::max(hi[order], centre);
  }
  void grow(const CentreRange& other) {
    for (int k = 0; k < kOrders; ++k) {
      lo[k] = std::min(lo[k], other.lo[k]);
      hi[k] = std::max(hi[k], other.hi[k]);
    }
  }
};

// Says how centres in one order fall into bins.
struct Binning {
  float lo = 0, scale = 0;

  // Bounds that nearly coincide or lie too far apart for float32 give no finite place; then there is one bin.
  int bin(float centre) const {
    const float place = (centre - lo) * scale;
    return std::isfinite(place) ? std::clamp(static_cast<int>(place), 0, kBins - 1) : 0;
  }
};

template <typename Bounds>
struct Bin {
  Bounds bounds;
  std::uint32_t count = 0;
};

template <typename Bounds>
using Bins = std::array<std::array<Bin<Bounds>, kBins>, Bounds::kOrders>;

template <typename Bounds>
void merge(Bins<Bounds>& into, const Bins<Bounds>& from) {
  for (int axis = 0; axis < Bounds::kOrders; ++axis) {
    for (int b = 0; b < kBins; ++b) {
      into[axis][b].bounds.grow(from[axis][b].bounds);
      into[axis][b].count += from[axis][b].count;
    }
  }
}

// Keys ascend by centre, then by triangle.
std::uint64_t key_of(float centre, std::uint32_t triangle) {
  const auto bits = std::bit_cast<std::uint32_t>(centre + 0.0f);  // -0 is 0
  const std::uint32_t ascending = bits ^ (bits >> 31 != 0 ? 0xffffffffu : 0x80000000u);
  return std::uint64_t{ascending} << 32 | triangle;
}
std::uint32_t triangle_of(std::uint64_t key) {
  return static_cast<std::uint32_t>(key);
}

// Sorts keys whose triangles ascend: three passes over the centres' bits, 11 of them at a time, each of which
// leaves equal ones in their order.
void sort_by_centre(std::vector<std::uint64_t>& keys, std::vector<std::uint64_t>& scratch) {
  constexpr std::size_t kFew = 256;  // std::sort takes less time for so many
  constexpr int kBits = 11;
  if (keys.size() <= kFew) return std::sort(keys.begin(), keys.end());
  scratch.resize(keys.size());
  for (int shift = 32; shift < 64; shift += kBits) {
    const auto digit = [&](std::uint64_t key) { return (key >> shift) & ((1u << kBits) - 1); };
    std::array<std::uint32_t, 1 << kBits> first = {};
    for (const std::uint64_t key : keys) ++first[digit(key)];
    std::exclusive_scan(first.begin(), first.end(), first.begin(), 0u);
    for (const std::uint64_t key : keys) scratch[first[digit(key)]++] = key;
    keys.swap(scratch);
  }
}

// The legal split nearest to `wanted`; legal ones lie at most 12 apart away from the ends. 0 if there is none
// so near.
std::uint32_t nearest_legal(std::uint32_t wanted, std::uint32_t n, const IsLegal& is_legal) {
  for (std::uint32_t distance = 0; distance <= 16; ++distance) {
    if (wanted > distance && is_legal(wanted - distance)) return wanted - distance;
    if (wanted + distance < n && is_legal(wanted + distance)) return wanted + distance;
  }
  return 0;
}

// The cheapest split of one axis between two bins. The few triangles between a bin's edge and the nearest
// legal split hardly change the costs, so those of the bins stand for them.
template <typename Bounds>
Split best_of(int axis, const std::array<Bin<Bounds>, kBins>& bins, std::uint32_t n,
              const IsLegal& is_legal) {
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

template <typename Bounds>
TriangleSplitter<Bounds>::TriangleSplitter(std::span<const Bounds> bounds) : bounds_(bounds) {
  const auto n = static_cast<std::uint32_t>(bounds.size());
  goes_left_.resize(n);
  for (int axis = 0; axis < Bounds::kOrders; ++axis) {
    scratch_[axis].resize(n);
    order_[axis].resize(n);
  }
  std::iota(order_[0].begin(), order_[0].end(), 0u);
  if (n <= kSweepSize) sort({0, n});
}

// Fills all three orders of a group from the first.
template <typename Bounds>
void TriangleSplitter<Bounds>::sort(Range range) {
  const std::vector<std::uint32_t> triangles(order_[0].begin() + range.begin, order_[0].begin() + range.end);
  for_each_order(Bounds::kOrders, range, [&](int axis) {
    std::vector<std::uint64_t> keys, scratch;
    keys.reserve(triangles.size());
    for (const std::uint32_t t : triangles) keys.push_back(key_of(centre(t, axis), t));
    sort_by_centre(keys, scratch);
    std::uint32_t* order = order_[axis].data() + range.begin;
    for (const std::uint64_t key : keys) *order++ = triangle_of(key);
  });
}

template <typename Bounds>
Split TriangleSplitter<Bounds>::best_split(Range range, const IsLegal& is_legal) {
  if (range.size() > kSweepSize) return best_binned_split(range, is_legal);
  Split splits[Bounds::kOrders];
  for_each_order(Bounds::kOrders, range, [&](int axis) { splits[axis] = sweep(axis, range, is_legal); });
  return *std::min_element(splits, splits + Bounds::kOrders,
                           [](const Split& a, const Split& b) { return a.cost < b.cost; });
}

template <typename Bounds>
Split TriangleSplitter<Bounds>::even_split(Range range, const IsLegal& is_legal) const {
  Bounds bounds;
  for (const std::uint32_t t : order(range)) bounds.grow(bounds_[t]);
  Split split;
  for (int axis = 1; axis < 3; ++axis) {
    if (bounds.extent(axis) > bounds.extent(split.axis)) split.axis = axis;
  }
  const std::uint32_t n = range.size(), middle = n / 2;
  for (std::uint32_t distance = 0; split.left == 0 && distance <= middle; ++distance) {
    if (distance < middle && is_legal(middle - distance)) split.left = middle - distance;
    if (split.left == 0 && middle + distance < n && is_legal(middle + distance))
      split.left = middle + distance;
  }
  return split;
}

// Tries all splits along one axis: costs of right sides from the right, then of left sides from the left.
template <typename Bounds>
Split TriangleSplitter<Bounds>::sweep(int axis, Range range, const IsLegal& is_legal) {
  const std::uint32_t n = range.size();
  const std::uint32_t* order = order_[axis].data() + range.begin;
  std::uint32_t* right_cost = scratch_[axis].data() + range.begin;
  const std::uint32_t step = is_legal.step;
  Bounds right;
  for (std::uint32_t i = n, legal = (n - 1) / step * step; legal > 0; legal -= step) {
    while (i > legal) right.grow(bounds_[order[--i]]);
    right_cost[legal] = std::bit_cast<std::uint32_t>(right.visit_cost() * static_cast<float>(n - legal));
  }
  Split best;
  best.axis = axis;
  Bounds left;
  const UnevenPenalty penalty(n);
  for (std::uint32_t i = 0, legal = step; legal < n; legal += step) {
    while (i < legal) left.grow(bounds_[order[i++]]);
    const float total =
        left.visit_cost() * static_cast<float>(legal) + std::bit_cast<float>(right_cost[legal]);
    const float cost = total * penalty.factor(legal);
    if (cost < best.cost && is_legal(legal)) {
      best.cost = cost;
      best.left = legal;
    }
  }
  return best;
}

// Sets goes_left_ of all triangles of the group.
template <typename Bounds>
void TriangleSplitter<Bounds>::mark_left_side(Range range, const Split& split) {
  if (range.size() <= kSweepSize) {
    const std::uint32_t* sorted = order_[split.axis].data() + range.begin;
    for (std::uint32_t i = 0; i < range.size(); ++i) goes_left_[sorted[i]] = i < split.left;
    return;
  }
  std::vector<std::uint64_t> keys;
  keys.reserve(range.size());
  for (const std::uint32_t t : order(range)) keys.push_back(key_of(centre(t, split.axis), t));
  std::nth_element(keys.begin(), keys.begin() + split.left, keys.end());
  const std::uint64_t first_right = keys[split.left];
  for (const std::uint32_t t : order(range)) goes_left_[t] = key_of(centre(t, split.axis), t) < first_right;
}

// Brings the left side's triangles to the front, keeping the order on both sides.
template <typename Bounds>
void TriangleSplitter<Bounds>::partition(int axis, Range range, std::uint32_t left) {
  std::uint32_t* order = order_[axis].data() + range.begin;
  std::uint32_t* right = scratch_[axis].data() + range.begin;
  std::uint32_t lefts = 0, rights = 0;
  for (std::uint32_t i = 0; i < range.size(); ++i) {
    const std::uint32_t t = order[i];
    const bool goes_left = goes_left_[t] != 0;
    order[lefts] = t;  // overwritten by the next one if this one goes right
    right[rights] = t;
    lefts += goes_left;
    rights += !goes_left;
  }
  std::copy(right, right + rights, order + left);
}

template <typename Bounds>
void TriangleSplitter<Bounds>::apply(Range range, const Split& split) {
  mark_left_side(range, split);
  if (range.size() <= kSweepSize) {
    for_each_order(Bounds::kOrders, range, [&](int axis) {
      if (axis != split.axis) partition(axis, range, split.left);
    });
    return;
  }
  partition(0, range, split.left);
  const std::uint32_t middle = range.begin + split.left;
  for (const Range side : {Range{range.begin, middle}, Range{middle, range.end}}) {
    if (side.size() <= kSweepSize) sort(side);
  }
}

// Unions and sums in any order give the same bits, so threads may share the work without changing the result.
template <typename Bounds>
Split TriangleSplitter<Bounds>::best_binned_split(Range range, const IsLegal& is_legal) const {
  const auto triangles = order(range);
  const auto centres = parallel::reduce(
      triangles.size(), kGrain, CentreRange<Bounds::kOrders>(),
      [&](CentreRange<Bounds::kOrders>& range_of, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
          for (int k = 0; k < Bounds::kOrders; ++k) range_of.grow(k, centre(triangles[i], k));
        }
      },
      [](auto& sum, const auto& other) { sum.grow(other); });
  Binning binning[Bounds::kOrders];
  for (int k = 0; k < Bounds::kOrders; ++k) {
    const float length = centres.hi[k] - centres.lo[k];
    binning[k] = {centres.lo[k], length > 0 ? static_cast<float>(kBins) / length : 0};
  }
  const auto bins = parallel::reduce(
      triangles.size(), kGrain, Bins<Bounds>(),
      [&](Bins<Bounds>& partial, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
          for (int k = 0; k < Bounds::kOrders; ++k) {
            Bin<Bounds>& bin = partial[k][binning[k].bin(centre(triangles[i], k))];
            bin.bounds.grow(bounds_[triangles[i]]);
            ++bin.count;
          }
        }
      },
      merge<Bounds>);
  Split best;
  for (int axis = 0; axis < Bounds::kOrders; ++axis) {
    const Split split = best_of(axis, bins[axis], range.size(), is_legal);
    if (split.cost < best.cost) best = split;
  }
  return best;
}

#define TANDEM_INSTANTIATE(Bounds) template class TriangleSplitter<Bounds>;
TANDEM_FOR_EACH_BOUNDS(TANDEM_INSTANTIATE)
#undef TANDEM_INSTANTIATE

}  // namespace tandem::build
