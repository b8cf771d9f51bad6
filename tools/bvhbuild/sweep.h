#pragma once
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "bounds.h"
#include "tree.h"

namespace tandem::build {

/// A group of triangles during a top-down build: positions [begin, end) of the three sorted orders.
struct Range {
  std::uint32_t begin, end;
  std::uint32_t size() const { return end - begin; }
};

/// Where a group is cut: its first `left` triangles in the order of `axis` go left.
struct Split {
  int axis = 0;
  std::uint32_t left = 0;  ///< 0: no split was found
  float cost = std::numeric_limits<float>::infinity();
};

/// Three orders of all triangles, by box centre along x, y and z (ties by index), which every split keeps
/// sorted within each group. Different groups may be worked on by different threads.
class SortedTriangles {
 public:
  explicit SortedTriangles(const Geometry& geometry);

  std::span<const std::uint32_t> order(int axis, Range range) const {
    return {order_[axis].data() + range.begin, range.size()};
  }
  const Bounds& bounds_of(std::uint32_t triangle) const { return bounds_[triangle]; }

  /// The cheapest split by the surface-area heuristic, surface times number of triangles, among those that
  /// `is_legal(left)` admits, on all axes; of equal costs the more even split, then the lower axis. left == 0
  /// where none is legal. `is_legal` must be callable from several threads.
  template <typename IsLegal>
  Split best_split(Range range, const IsLegal& is_legal);

  /// The legal split nearest to the middle, along the longest edge of the group's box: what keeps a tree from
  /// growing too deep.
  template <typename IsLegal>
  Split even_split(Range range, const IsLegal& is_legal) const;

  /// The order along x. Once the build is done it is the leaves' order, because each leaf is a range of it.
  std::vector<std::uint32_t> take_order() { return std::move(order_[0]); }

  /// Cuts the group in two: afterwards its left part is [begin, begin + split.left) in all three orders.
  void apply(Range range, const Split& split);

 private:
  template <typename IsLegal>
  Split best_split_on(int axis, Range range, const IsLegal& is_legal);
  int longest_axis(Range range) const;
  void partition(int axis, Range range, std::uint32_t left);

  std::vector<Bounds> bounds_;
  std::vector<std::uint32_t> order_[3];
  std::vector<std::uint32_t>
      scratch_[3];  // bits of the right sides' costs; one side's triangles while partitioning
  std::vector<std::uint8_t> goes_left_;  // by triangle
};

}  // namespace tandem::build

#include "sweep_inl.h"
