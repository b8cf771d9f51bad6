#pragma once
#include <cstdint>

#include "kernels/geometry/box_test.h"
#include "tandem/formats/block.h"
#include "tandem/kernels/world_box.h"

/// The box tests of a block pair, all 16 at once.
namespace tandem {

/// Bit 4 i + j is set when node i of a and node j of b may overlap: 6 axes each, conservative as
/// relative_pose() says. Imaginary nodes never do. The other 9 axes would spare a ninth of the block pairs
/// and an eighth of the candidates, and cost more than that (docs/decisions/box-tests.md). This one works
/// node by node; block_pair_test() has faster ones with the same results.
inline std::uint16_t block_pair_mask(const Block& a, const Block& b, const RelativePose& b_in_a) {
  unsigned mask = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    for (int j = 0; j < kNodesPerBlock; ++j) {
      if (overlap_6_axes(box_of(a, i), box_of(b, j), b_in_a)) mask |= 1u << (4 * i + j);
    }
  }
  return static_cast<std::uint16_t>(mask);
}

/// The world box of a node of a posed tree. It contains every posed vertex below the node: the ends of the
/// node's box, centre - half-extent and centre + half-extent, are rounded to float64, vertices are float32
/// numbers between the exact ends, and rounding is monotone, so no vertex lies beyond a rounded end. pose: of
/// stored coordinates.
TANDEM_HD inline WorldBox node_world_box(const Pose& pose, const Block& block, int node) {
  double lower[3], upper[3];
  for (int k = 0; k < 3; ++k) {
    const double centre = block.centre[k][node], half_extent = block.half_extent[k][node];
    lower[k] = centre - half_extent;
    upper[k] = centre + half_extent;
  }
  return world_box(pose, lower, upper);
}

/// block_pair_mask() by world boxes in float64, for pairs that float32 cannot take. within: boxes at most so
/// far apart along each axis count too; the gap as computed is too large by 2^-53 of itself at most.
TANDEM_HD inline std::uint32_t world_block_pair_mask(const Pose& pose_a, const Block& a, const Pose& pose_b,
                                                     const Block& b, double within = 0) {
  const double reach = within * (1 + 0x1p-50);
  std::uint32_t mask = 0;
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if (a.kind[i] == NodeKind::imaginary) continue;
    const WorldBox box_a = node_world_box(pose_a, a, i);
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
    for (int j = 0; j < kNodesPerBlock; ++j) {
      if (b.kind[j] == NodeKind::imaginary) continue;
      if (are_near(box_a, node_world_box(pose_b, b, j), reach)) mask |= 1u << (4 * i + j);
    }
  }
  return mask;
}

/// Ways to compute the mask. All give the same bits for the same operands: each multiplies, adds and
/// subtracts in the order of box_terms, and none fuses.
enum class BlockPairVariant {
  scalar,  ///< block_pair_mask()
  lanes4,  ///< 4 lanes: SSE2, NEON or what the compiler makes of vectors
  avx2,    ///< 8 lanes
  avx512,  ///< 16 lanes: AVX-512 F, VL, DQ, BW
};
inline constexpr BlockPairVariant kBlockPairVariants[] = {BlockPairVariant::scalar, BlockPairVariant::lanes4,
                                                          BlockPairVariant::avx2, BlockPairVariant::avx512};

using BlockPairTest = std::uint16_t (*)(const Block& a, const Block& b, const RelativePose& b_in_a);

/// The fastest way on this machine. The answer never changes while a program runs: fetch it once per query.
BlockPairTest block_pair_test();

/// The named way, or null where this machine or this build lacks it.
BlockPairTest block_pair_test(BlockPairVariant variant);

}  // namespace tandem
