#pragma once
#include <cmath>
#include <cstdint>

#include "kernels/common/block_pair.h"
#include "tandem/formats/platform.h"
#include "tandem/kernels/detail/box_tree.h"
#include "tandem/kernels/world_box.h"

/// What walks by points and rays do before and beside the trees of bodies, for CPU and GPU.
namespace tandem::probe {

inline constexpr int kMostBodyLevels = 16;  // 4^16 bodies

/// Visits bodies in about the order of a bound. Tree: groups of boxes, BoxTree::Group, in levels: level(i)
/// has those of a level, of which level top() is one group, and body(i) names the body of a place in level 0.
/// bound(world box) -> double is not above what it is for anything in the box, and infinity where nothing
/// there counts. Bodies with a bound of more than `limit` are passed over; visit(body) may make that less.
template <typename Tree, typename Bound, typename Visit>
TANDEM_HD inline void visit_bodies(const Tree& tree, const Bound& bound, const double& limit,
                                   const Visit& visit) {
  struct Entry {
    double bound;
    std::uint32_t number;
    std::int32_t level;  // of the group; -1: a place of a body
  } stack[(BoxTree::kGroup - 1) * kMostBodyLevels + BoxTree::kGroup + 1];
  int height = 0;
  stack[height++] = {-HUGE_VAL, 0, tree.top()};
  while (height > 0) {
    const Entry entry = stack[--height];
    if (!(entry.bound <= limit)) continue;
    if (entry.level < 0) {
      visit(tree.body(entry.number));
      continue;
    }
    const BoxTree::Group& group = tree.level(entry.level)[entry.number];
    const int bottom = height;
    for (int i = 0; i < BoxTree::kGroup; ++i) {
      WorldBox box;
      for (int k = 0; k < 3; ++k) box.lo[k] = group.lo[k][i], box.hi[k] = group.hi[k][i];
      if (!(box.lo[0] <= box.hi[0])) continue;
      const double least = bound(box);
      if (!(least <= limit) || least == HUGE_VAL) continue;
      const Entry next = {least, BoxTree::kGroup * entry.number + static_cast<std::uint32_t>(i),
                          entry.level - 1};
      int at = height++;
      for (; at > bottom && stack[at - 1].bound < least; --at) stack[at] = stack[at - 1];
      stack[at] = next;
    }
  }
}

/// Walks a tree by world boxes in float64, of a body that float32 cannot take. wanted(box) -> whether what is
/// in it counts; take(triangle) -> whether the walk goes on. Result: the blocks that it looked at.
template <typename Wanted, typename Take>
TANDEM_HD inline std::uint64_t walk_world_boxes(const Pose& pose, const Block* blocks, const Wanted& wanted,
                                                const Take& take) {
  std::uint32_t stack[3 * kMaxDepth + 4], height = 0;
  std::uint64_t looked_at = 0;
  stack[height++] = 0;
  while (height > 0) {
    const Block& block = blocks[stack[--height]];
    ++looked_at;
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (block.kind[i] == NodeKind::imaginary || !wanted(node_world_box(pose, block, i))) continue;
      if (!block.is_leaf_block())
        stack[height++] = block.index[i];
      else if (!take(block.index[i]))
        return looked_at;
    }
  }
  return looked_at;
}

TANDEM_HD inline bool is_in_range(const double* point) {
  bool in_range = true;
  for (int k = 0; k < 3; ++k) in_range = in_range && std::fabs(point[k]) <= kLargestWorldCoordinate;
  return in_range;
}

/// How far a point is from a box at least.
TANDEM_HD inline double distance_to(const WorldBox& box, const double (&p)[3]) {
  double largest = 0, square = 0;
  for (int k = 0; k < 3; ++k) {
    const double below = box.lo[k] - p[k], above = p[k] - box.hi[k], gap = below > above ? below : above;
    if (!(gap > 0)) continue;
    if (gap > largest) largest = gap;
    square += gap * gap;
  }
  // Squares may be too large or too small to be told.
  return (largest < 0x1p500 && largest > 0x1p-500 ? std::sqrt(square) : largest) * (1 - 0x1p-50);
}

/// Whether the ray of inside_test.h may meet a box.
TANDEM_HD inline bool may_cross(const WorldBox& box, const double (&p)[3]) {
  return box.lo[1] <= p[1] && p[1] <= box.hi[1] && box.lo[2] <= p[2] && p[2] <= box.hi[2] &&
         p[0] <= box.hi[0];
}

}  // namespace tandem::probe
