#include "oriented_work.h"

#include <bit>

#include "kernels/common/traversal.h"
#include "kernels/geometry/oriented_test.h"

namespace tandem {
namespace {

std::uint32_t overlaps(const OrientedBlock& a, const OrientedBlock& b, const OrientedPose& pose) {
  Box boxes_b[kNodesPerBlock];
  for (int j = 0; j < kNodesPerBlock; ++j) boxes_b[j] = box_of(b, j);
  std::uint32_t mask = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const Box box_a = box_of(a, i);
    for (int j = 0; j < kNodesPerBlock; ++j) {
      if (overlap_oriented(box_a, boxes_b[j], pose)) mask |= 1u << (4 * i + j);
    }
  }
  return mask;
}

}  // namespace

OrientedWork::OrientedWork(const AssetView& a, const AssetView& b)
    : tree_a_(a.level()),
      tree_b_(b.level()),
      extent_a_(extent_of(tree_a_.blocks[0])),
      extent_b_(extent_of(tree_b_.blocks[0])),
      origin_b_(b.header->origin),
      a_(for_stored_coordinates(kIdentityPose, a.header->origin)) {}

std::optional<WalkWork> OrientedWork::count(const Pose& b, std::uint64_t most_block_pairs) const {
  RelativePose b_in_a;
  if (tree_a_.oriented_blocks == nullptr || tree_b_.oriented_blocks == nullptr ||
      relative_pose(a_, extent_a_, for_stored_coordinates(b, origin_b_), extent_b_, b_in_a) !=
          RelativePoseStatus::kOk)
    return std::nullopt;
  const float slack = oriented_slack(b_in_a, extent_a_, extent_b_);
  std::uint64_t left = most_block_pairs;
  const auto test = [&](const OrientedBlock& block_a, const OrientedBlock& block_b) -> std::uint32_t {
    if (left == 0) return 0;
    --left;
    return overlaps(block_a, block_b,
                    oriented_pose(b_in_a.rotation, b_in_a.translation, slack, frame_of(block_a.rotation),
                                  frame_of(block_b.rotation)));
  };
  WalkWork work;
  work.block_pairs = traverse(tree_a_.oriented_blocks, tree_b_.oriented_blocks, test,
                              [&](const OrientedBlock&, const OrientedBlock&, std::uint32_t mask) {
                                work.candidates += static_cast<std::uint64_t>(std::popcount(mask));
                                return true;
                              });
  return work.block_pairs <= most_block_pairs ? std::optional(work) : std::nullopt;
}

}  // namespace tandem
