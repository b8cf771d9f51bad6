#pragma once
#include <cmath>
#include <cstdint>

#include "kernels/common/block_pair.h"
#include "tandem/formats/platform.h"
#include "tandem/kernels/world_box.h"

/// Walks by points and rays do this before and beside the trees of bodies, for CPU and GPU.
namespace tandem::probe {

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

/// Bounds from below how far a point is from a box.
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

/// Says whether the ray of inside_test.h may meet a box.
TANDEM_HD inline bool may_cross(const WorldBox& box, const double (&p)[3]) {
  return box.lo[1] <= p[1] && p[1] <= box.hi[1] && box.lo[2] <= p[2] && p[2] <= box.hi[2] &&
         p[0] <= box.hi[0];
}

}  // namespace tandem::probe
