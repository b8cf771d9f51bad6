#include "sweep.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_sort.h>

#include <numeric>

namespace tandem::build {
namespace {

using oneapi::tbb::blocked_range;
using oneapi::tbb::parallel_for;

Bounds bounds_of_triangle(const Geometry& geometry, std::uint32_t triangle, float scale) {
  Bounds bounds;
  for (const std::uint32_t vertex : geometry.triangles[triangle]) {
    for (int k = 0; k < 3; ++k) {
      const float x = geometry.points[vertex][k] * scale;
      bounds.lo[k] = std::min(bounds.lo[k], x);
      bounds.hi[k] = std::max(bounds.hi[k], x);
    }
  }
  return bounds;
}

// A power of two that brings the longest edge of the mesh's box to about 1, so that surfaces of huge or tiny
// meshes neither overflow nor vanish. Scaling by it is exact, but for what underflows beside the rest.
float normalizing_scale(const Geometry& geometry) {
  double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (const auto& triangle : geometry.triangles) {
    for (const std::uint32_t vertex : triangle) {
      for (int k = 0; k < 3; ++k) {
        lo[k] = std::min<double>(lo[k], geometry.points[vertex][k]);
        hi[k] = std::max<double>(hi[k], geometry.points[vertex][k]);
      }
    }
  }
  const double longest = std::max({hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]});
  if (longest == 0) return 1;
  return static_cast<float>(std::ldexp(1.0, -std::clamp(std::ilogb(longest), -126, 127)));
}

}  // namespace

SortedTriangles::SortedTriangles(const Geometry& geometry) {
  const auto n = static_cast<std::uint32_t>(geometry.triangles.size());
  bounds_.resize(n);
  goes_left_.resize(n);
  const float scale = normalizing_scale(geometry);
  parallel_for(blocked_range<std::uint32_t>(0, n), [&](const auto& part) {
    for (std::uint32_t t = part.begin(); t != part.end(); ++t)
      bounds_[t] = bounds_of_triangle(geometry, t, scale);
  });
  for (int axis = 0; axis < 3; ++axis) {
    scratch_[axis].resize(n);
    order_[axis].resize(n);
    std::iota(order_[axis].begin(), order_[axis].end(), 0u);
    const auto center = [&](std::uint32_t t) { return bounds_[t].lo[axis] + bounds_[t].hi[axis]; };
    oneapi::tbb::parallel_sort(order_[axis].begin(), order_[axis].end(),
                               [&](std::uint32_t a, std::uint32_t b) {
                                 const float x = center(a), y = center(b);
                                 return x < y || (x == y && a < b);
                               });
  }
}

int SortedTriangles::longest_axis(Range range) const {
  Bounds bounds;
  for (const std::uint32_t t : order(0, range)) bounds.grow(bounds_[t]);
  int longest = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (bounds.hi[axis] - bounds.lo[axis] > bounds.hi[longest] - bounds.lo[longest]) longest = axis;
  }
  return longest;
}

void SortedTriangles::partition(int axis, Range range, std::uint32_t left) {
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

void SortedTriangles::apply(Range range, const Split& split) {
  const auto sorted = order(split.axis, range);
  for (std::uint32_t i = 0; i < range.size(); ++i) goes_left_[sorted[i]] = i < split.left;
  for_each_axis(range, [&](int axis) {
    if (axis != split.axis) partition(axis, range, split.left);
  });
}

}  // namespace tandem::build
