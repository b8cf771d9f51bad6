#pragma once
#include <oneapi/tbb/parallel_for.h>

#include <bit>
#include <cmath>

#include "sweep.h"

namespace tandem::build {

/// Groups below this size are worked on by one thread.
inline constexpr std::uint32_t kSerialSize = 8192;

/// Calls body(0), body(1), body(2), at once if the group is large.
template <typename Body>
void for_each_axis(Range range, const Body& body) {
  if (range.size() < kSerialSize) {
    for (int axis = 0; axis < 3; ++axis) body(axis);
  } else {
    oneapi::tbb::parallel_for(0, 3, body);
  }
}

template <typename IsLegal>
Split SortedTriangles::best_split_on(int axis, Range range, const IsLegal& is_legal) {
  const std::uint32_t n = range.size();
  const std::uint32_t* order = order_[axis].data() + range.begin;
  std::uint32_t* right_cost = scratch_[axis].data() + range.begin;
  Bounds right;
  for (std::uint32_t i = n - 1; i > 0; --i) {
    right.grow(bounds_[order[i]]);
    right_cost[i] = std::bit_cast<std::uint32_t>(right.surface() * static_cast<float>(n - i));
  }
  Split best;
  best.axis = axis;
  Bounds left;
  // A trace of a penalty for uneven splits decides where costs are equal, as among coincident triangles:
  // without it such groups would be peeled triangle by triangle.
  const float uneven = 1e-5f / static_cast<float>(n);
  for (std::uint32_t i = 1; i < n; ++i) {
    left.grow(bounds_[order[i - 1]]);
    const float area_cost = left.surface() * static_cast<float>(i) + std::bit_cast<float>(right_cost[i]);
    const float cost = area_cost * (1 + uneven * std::abs(static_cast<float>(n) - 2 * static_cast<float>(i)));
    if (cost < best.cost && is_legal(i)) {
      best.cost = cost;
      best.left = i;
    }
  }
  return best;
}

template <typename IsLegal>
Split SortedTriangles::even_split(Range range, const IsLegal& is_legal) const {
  const std::uint32_t n = range.size(), middle = n / 2;
  Split split;
  split.axis = longest_axis(range);
  for (std::uint32_t distance = 0; split.left == 0 && distance <= middle + 1; ++distance) {
    if (distance < middle && is_legal(middle - distance)) split.left = middle - distance;
    if (split.left == 0 && middle + distance < n && is_legal(middle + distance))
      split.left = middle + distance;
  }
  return split;
}

template <typename IsLegal>
Split SortedTriangles::best_split(Range range, const IsLegal& is_legal) {
  Split splits[3];
  for_each_axis(range, [&](int axis) { splits[axis] = best_split_on(axis, range, is_legal); });
  Split best = splits[0];
  for (const Split& split : splits) {
    if (split.cost < best.cost) best = split;
  }
  return best;
}

}  // namespace tandem::build
