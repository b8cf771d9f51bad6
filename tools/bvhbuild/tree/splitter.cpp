#include "splitter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

#include "parallel/parallel.h"

namespace tandem::build {
namespace {

// Calls body(0), body(1), body(2), at once if the group is large.
template <typename Body>
void for_each_axis(Range range, const Body& body) {
  if (range.size() < kSerialSize) {
    for (int axis = 0; axis < 3; ++axis) body(axis);
  } else {
    parallel::for_each(3, [&](std::size_t axis) { body(static_cast<int>(axis)); });
  }
}

}  // namespace

TriangleSplitter::TriangleSplitter(std::span<const Bounds> bounds) : bounds_(bounds) {
  const auto n = static_cast<std::uint32_t>(bounds.size());
  goes_left_.resize(n);
  for (int axis = 0; axis < 3; ++axis) {
    scratch_[axis].resize(n);
    order_[axis].resize(n);
  }
  std::iota(order_[0].begin(), order_[0].end(), 0u);
  if (n <= kSweepSize) sort({0, n});
}

// Fills all three orders of a group from the first.
void TriangleSplitter::sort(Range range) {
  const std::vector<std::uint32_t> triangles(order_[0].begin() + range.begin, order_[0].begin() + range.end);
  for_each_axis(range, [&](int axis) {
    std::vector<std::pair<float, std::uint32_t>> keys;
    keys.reserve(triangles.size());
    for (const std::uint32_t t : triangles) keys.emplace_back(center(t, axis), t);
    std::sort(keys.begin(), keys.end());
    std::uint32_t* order = order_[axis].data() + range.begin;
    for (const auto& key : keys) *order++ = key.second;
  });
}

Split TriangleSplitter::best_split(Range range, const IsLegal& is_legal) {
  if (range.size() > kSweepSize) return best_binned_split(range, is_legal);
  Split splits[3];
  for_each_axis(range, [&](int axis) { splits[axis] = sweep(axis, range, is_legal); });
  return *std::min_element(splits, splits + 3,
                           [](const Split& a, const Split& b) { return a.cost < b.cost; });
}

Split TriangleSplitter::even_split(Range range, const IsLegal& is_legal) const {
  Bounds bounds;
  for (const std::uint32_t t : order(range)) bounds.grow(bounds_[t]);
  Split split;
  for (int axis = 1; axis < 3; ++axis) {
    if (bounds.hi[axis] - bounds.lo[axis] > bounds.hi[split.axis] - bounds.lo[split.axis]) split.axis = axis;
  }
  const std::uint32_t n = range.size(), middle = n / 2;
  for (std::uint32_t distance = 0; split.left == 0 && distance <= middle; ++distance) {
    if (distance < middle && is_legal(middle - distance)) split.left = middle - distance;
    if (split.left == 0 && middle + distance < n && is_legal(middle + distance))
      split.left = middle + distance;
  }
  return split;
}

// One axis, all splits: costs of right sides from the right, then left sides from the left.
Split TriangleSplitter::sweep(int axis, Range range, const IsLegal& is_legal) {
  const std::uint32_t n = range.size();
  const std::uint32_t* order = order_[axis].data() + range.begin;
  std::uint32_t* right_cost = scratch_[axis].data() + range.begin;
  Bounds right;
  for (std::uint32_t i = n - 1; i > 0; --i) {
    right.grow(bounds_[order[i]]);
    right_cost[i] = std::bit_cast<std::uint32_t>(right.visit_cost() * static_cast<float>(n - i));
  }
  Split best;
  best.axis = axis;
  Bounds left;
  const UnevenPenalty penalty(n);
  for (std::uint32_t i = 1; i < n; ++i) {
    left.grow(bounds_[order[i - 1]]);
    const float total = left.visit_cost() * static_cast<float>(i) + std::bit_cast<float>(right_cost[i]);
    const float cost = total * penalty.factor(i);
    if (cost < best.cost && is_legal(i)) {
      best.cost = cost;
      best.left = i;
    }
  }
  return best;
}

// Sets goes_left_ of all triangles of the group.
void TriangleSplitter::mark_left_side(Range range, const Split& split) {
  if (range.size() <= kSweepSize) {
    const std::uint32_t* sorted = order_[split.axis].data() + range.begin;
    for (std::uint32_t i = 0; i < range.size(); ++i) goes_left_[sorted[i]] = i < split.left;
    return;
  }
  std::vector<std::pair<float, std::uint32_t>> keys;
  keys.reserve(range.size());
  for (const std::uint32_t t : order(range)) keys.emplace_back(center(t, split.axis), t);
  std::nth_element(keys.begin(), keys.begin() + split.left, keys.end());
  for (std::uint32_t i = 0; i < range.size(); ++i) goes_left_[keys[i].second] = i < split.left;
}

// Brings the left side's triangles to the front, keeping the order on both sides.
void TriangleSplitter::partition(int axis, Range range, std::uint32_t left) {
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

void TriangleSplitter::apply(Range range, const Split& split) {
  mark_left_side(range, split);
  if (range.size() <= kSweepSize) {
    for_each_axis(range, [&](int axis) {
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

}  // namespace tandem::build
