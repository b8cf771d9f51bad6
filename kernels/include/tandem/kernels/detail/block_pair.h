#pragma once
#include <cstdint>

#include "tandem/formats/block.h"
#include "tandem/kernels/detail/box_test.h"

/// The box tests of a block pair, all 16 at once.
namespace tandem {

/// Bit 4 i + j is set when node i of a and node j of b may overlap: 6 axes each, conservative as
/// relative_pose() says. Imaginary nodes never do. The other 9 axes would spare a ninth of the block pairs
/// and an eighth of the candidates, and cost more than that (docs/decisions/0012). This one works node by node,
/// for CPU and GPU; a CPU has faster ones, see block_pair_test(), with the same results.
TANDEM_HD inline std::uint16_t block_pair_mask(const Block& a, const Block& b, const RelativePose& b_in_a) {
  unsigned mask = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    for (int j = 0; j < kNodesPerBlock; ++j) {
      if (overlap_6_axes(box_of(a, i), box_of(b, j), b_in_a)) mask |= 1u << (4 * i + j);
    }
  }
  return static_cast<std::uint16_t>(mask);
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
