#pragma once
#include <cstdint>

#include "tandem/formats/status.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/detail/buffer.h"

// The order in which a GPU refits a tree. The tree falls into clusters of blocks, each of which a thread
// block refits in shared memory, children before parents. The clusters of round 0 are at the leaves and begin
// with triangles; those of a later round begin with the boxes around what earlier rounds have refitted.
namespace tandem::gpu {

/// A cluster has no more blocks, and so no more than so many inputs.
inline constexpr std::uint32_t kMostClusterBlocks = 128, kMostInputs = kNodesPerBlock * kMostClusterBlocks;

/// A block with more than kMostClusterBlocks blocks below it, which waits for a later round, is one of at
/// most 64 (kMaxDepth) for every kMostClusterBlocks blocks. So each round leaves at most half of the blocks,
/// and of fewer than 2^32 none is left after 32 rounds.
inline constexpr std::uint32_t kMostRefitRounds = 32;

/// The source vertex of a triangle's corner, and what the triangle says beside the position.
struct alignas(8) CornerSource {
  std::uint32_t vertex, w;
};

/// A block of a cluster.
struct alignas(16) RefitBlock {
  static constexpr std::uint16_t kNothing = 0xFFFF;

  std::uint32_t block;        ///< its number
  std::uint32_t oriented;     ///< the oriented block's; kNoIndex: the tree has none
  std::uint32_t first_below;  ///< of the oriented block
  std::uint32_t root;         ///< where the box around the block goes for later rounds, or kNoIndex
  /// What is below each node: a triangle of the cluster, or a box of the cluster; boxes are numbered inputs
  /// first, then blocks. kNothing: the node is imaginary.
  std::uint16_t below[kNodesPerBlock];
};
static_assert(sizeof(RefitBlock) == 32);  // with what alignment leaves

struct RefitCluster {
  std::uint32_t first_block, blocks;  ///< in RefitPlans::blocks, children before parents
  std::uint32_t first_input,
      inputs;  ///< triangles of the tree in round 0, then entries of RefitPlans::inputs
  std::uint32_t first_height, heights;  ///< in RefitPlans::height_ends
};

/// The plan of one tree.
struct RefitPlan {
  std::uint64_t first_corner;  ///< in RefitPlans::corners
  std::uint32_t roots;         ///< how many boxes go from round to round
  std::uint32_t rounds;
  std::uint32_t first_cluster[kMostRefitRounds + 1];  ///< of each round, in RefitPlans::clusters, and the end
};

/// The plans of some trees, one behind the other.
struct RefitPlans {
  Buffer<CornerSource> corners;  ///< three of each triangle
  Buffer<RefitBlock> blocks;
  Buffer<RefitCluster> clusters;
  Buffer<std::uint16_t>
      height_ends;  ///< of runs of blocks that do not need each other, from the cluster's first block
  Buffer<std::uint32_t> inputs;  ///< of later rounds: the RefitBlock::root of each

  /// Adds the plan of a tree. level: in CPU memory, with triangles, topology, source vertices, and oriented
  /// blocks or blocks. Result: kOk, kOutOfMemory, or kOutOfRange (2^32 blocks in all); after an error the
  /// plans are useless.
  Status add(const LevelView& level, RefitPlan& plan);
};

}  // namespace tandem::gpu
