#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "bounds.h"
#include "tandem/formats/block.h"

namespace tandem::build {

/// A group of triangles during a top-down build: positions [begin, end) of the splitter's order.
struct Range {
  std::uint32_t begin, end;
  std::uint32_t size() const { return end - begin; }
};

/// Says where a group is cut: its first `left` triangles by box centre in the order `axis` (ties by index) go
/// left. Of Bounds the orders are the three axes.
struct Split {
  int axis = 0;
  std::uint32_t left = 0;  ///< 0: no split was found
  float cost = std::numeric_limits<float>::infinity();
};

/// Groups below this size are worked on by one thread.
inline constexpr std::uint32_t kSerialSize = 8192;

/// Groups up to this size are swept, larger ones binned (docs/decisions/trees.md has the measurement).
inline constexpr std::uint32_t kSweepSize = 1 << 12;

/// A trace of a penalty for uneven splits. It decides where costs are equal, as among coincident triangles,
/// which would otherwise be peeled off one by one.
class UnevenPenalty {
 public:
  explicit UnevenPenalty(std::uint32_t n) : n_(static_cast<float>(n)), weight_(1e-5f / n_) {}
  float factor(std::uint32_t left) const { return 1 + weight_ * std::abs(n_ - 2 * static_cast<float>(left)); }

 private:
  float n_, weight_;
};

/// Says whether a group may be cut behind so many triangles. Called from several threads.
struct IsLegal {
  std::function<bool(std::uint32_t left)> test;
  std::uint32_t step = 1;  ///< only multiples of it may be legal

  bool operator()(std::uint32_t left) const { return left % step == 0 && test(left); }
};

/// Finds and applies the splits of a top-down build. Bounds: Bounds or SampledBounds. Different groups may be
/// worked on by different threads; nothing depends on which, or on how many.
template <typename Bounds>
class TriangleSplitter {
 public:
  /// `bounds`: of each triangle, normalized_bounds(); they must outlive the splitter.
  explicit TriangleSplitter(std::span<const Bounds> bounds);

  /// The triangles of a group.
  std::span<const std::uint32_t> order(Range range) const {
    return {order_[0].data() + range.begin, range.size()};
  }
  const Bounds& bounds_of(std::uint32_t triangle) const { return bounds_[triangle]; }

  /// The cheapest split, visit_cost() times number of triangles of both sides, among the legal
  /// ones on all axes; of equal costs the more even one, then the lower axis. Up to kSweepSize triangles all
  /// splits are tried, beyond that those nearest to 31 planes an axis. left == 0 where none is found.
  Split best_split(Range range, const IsLegal& is_legal);

  /// The legal split nearest to the middle, along the longest edge of the group's box: what keeps a tree from
  /// growing too deep.
  Split even_split(Range range, const IsLegal& is_legal) const;

  /// Cuts the group in two: afterwards its left part is [begin, begin + split.left).
  void apply(Range range, const Split& split);

 private:
  float centre(std::uint32_t triangle, int axis) const { return bounds_[triangle].centre(axis); }
  void sort(Range range);
  Split sweep(int axis, Range range, const IsLegal& is_legal);
  Split best_binned_split(Range range, const IsLegal& is_legal) const;
  void mark_left_side(Range range, const Split& split);
  void partition(int axis, Range range, std::uint32_t left);

  std::span<const Bounds> bounds_;
  // A group up to kSweepSize has its triangles by centre in all orders. A larger one has the first order
  // alone, by index, so that going through it goes through memory in order.
  std::vector<std::uint32_t> order_[Bounds::kOrders];
  // Bits of the right sides' costs; one side's triangles while partitioning.
  std::vector<std::uint32_t> scratch_[Bounds::kOrders];
  std::vector<std::uint8_t> goes_left_;  // by triangle
};

/// Returns whether a group of n triangles at this depth must be split evenly from here on, so that the tree
/// ends above kMaxDepth. Even splits at least halve a group, give or take the few positions to the nearest
/// legal one, at each level.
constexpr bool must_split_evenly(std::uint32_t depth, std::uint32_t n) {
  constexpr std::uint32_t kReserve = 4;
  return depth + static_cast<std::uint32_t>(std::bit_width(n)) + kReserve >= kMaxDepth;
}

}  // namespace tandem::build
