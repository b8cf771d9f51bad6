#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tandem/kernels/manifold.h"

namespace tandem::manifold {

/// A k-d tree of a run of points, by their places in the coordinates of one of the bodies. It lies on the
/// stack and allocates nothing, so it holds kMost points at most. For a thread of a CPU.
class PointTree {
 public:
  static constexpr std::uint32_t kMost = 8192;
  using Place = double (ManifoldPoint::*)[3];

  /// Condition: count is from 1 to kMost; the points stay where they are.
  PointTree(const ManifoldPoint* points, std::uint32_t count, Place place)
      : points_(points), place_(place), count_(count) {
    for (std::uint32_t i = 0; i < count; ++i) node_[i] = static_cast<std::uint16_t>(i);
    box_ = box_of(0, count);
    build(0, count, box_);
  }

  /// Calls visit(i) of each point i that may be as near to a place as `least`, the square of a distance,
  /// which visit() may lessen; near ones come first.
  ///
  /// What is left out is farther away as distances are computed, too: differences, squares and sums round
  /// monotonically, so a point's computed square of the distance is no less than that of the box, or along an
  /// axis that of the plane, on whose other side it lies.
  template <typename Visit>
  void visit_near(const double (&at)[3], const double& least, const Visit& visit) const {
    double apart[3];
    for (int k = 0; k < 3; ++k) apart[k] = std::max({box_.lo[k] - at[k], at[k] - box_.hi[k], 0.0});
    if (apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2] <= least)
      visit_range(0, count_, at, least, visit);
  }

 private:
  struct Box {
    double lo[3], hi[3];
  };

  // A node is the number of a point and, from this bit on, the axis along which it divides its range: the
  // middle one of a range divides the others.
  static constexpr int kAxis = 13;
  static_assert(kMost <= 1u << kAxis);
  // Ranges of so many points are not divided.
  static constexpr std::uint32_t kFew = 6;

  std::uint32_t number(std::uint32_t i) const { return node_[i] & ((1u << kAxis) - 1); }
  const double (&place(std::uint32_t point) const)[3] { return points_[point].*place_; }

  Box box_of(std::uint32_t first, std::uint32_t end) const {
    Box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (std::uint32_t i = first; i < end; ++i) {
      for (int k = 0; k < 3; ++k) {
        box.lo[k] = std::min(box.lo[k], place(number(i))[k]);
        box.hi[k] = std::max(box.hi[k], place(number(i))[k]);
      }
    }
    return box;
  }

  // Divides a range along the longest side of its box.
  void build(std::uint32_t first, std::uint32_t end, const Box& box) {
    if (end - first <= kFew) return;
    int axis = 0;
    for (int k = 1; k < 3; ++k) {
      if (box.hi[k] - box.lo[k] > box.hi[axis] - box.lo[axis]) axis = k;
    }
    const std::uint32_t middle = first + (end - first) / 2;
    std::nth_element(node_ + first, node_ + middle, node_ + end,
                     [&](std::uint16_t x, std::uint16_t y) { return place(x)[axis] < place(y)[axis]; });
    build(first, middle, box_of(first, middle));
    build(middle + 1, end, box_of(middle + 1, end));
    node_[middle] = static_cast<std::uint16_t>(node_[middle] | axis << kAxis);
  }

  template <typename Visit>
  void visit_range(std::uint32_t first, std::uint32_t end, const double (&at)[3], const double& least,
                   const Visit& visit) const {
    if (end - first <= kFew) {
      for (std::uint32_t i = first; i < end; ++i) visit(number(i));
      return;
    }
    const std::uint32_t middle = first + (end - first) / 2;
    const int axis = node_[middle] >> kAxis;
    const double beyond = at[axis] - place(number(middle))[axis];
    const bool in_first = beyond < 0;
    visit_range(in_first ? first : middle + 1, in_first ? middle : end, at, least, visit);
    if (!(beyond * beyond <= least)) return;
    visit(number(middle));
    visit_range(in_first ? middle + 1 : first, in_first ? end : middle, at, least, visit);
  }

  const ManifoldPoint* points_;
  Place place_;
  std::uint32_t count_;
  Box box_;
  std::uint16_t node_[kMost];
};

}  // namespace tandem::manifold
