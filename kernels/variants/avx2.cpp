#include "kernels/common/block_pair_variants.h"
#include "kernels/contact/narrow_phase_lanes.h"
#include "kernels/distance/nearest_lanes.h"
#include "kernels/manifold/patch_passes_lanes.h"
#include "kernels/manifold/patch_walk_lanes.h"
#include "kernels/manifold/piece_lanes.h"

// The variants of 8 lanes, in a file that is compiled for machines that have the instructions.
#if defined(TANDEM_HAVE_LANES) && defined(__AVX2__)
namespace tandem {

std::uint16_t block_pair_mask_avx2(const Block& a, const Block& b, const RelativePose& b_in_a) {
  return static_cast<std::uint16_t>(BlockPairLanes<8>(a, b, b_in_a).mask());
}

bool narrow_phase_avx2(const PairTask& task, ContactSink& sink) {
  return PairWalk<LaneMeans<8>>(task, sink).run();
}

const ManifoldMeans kManifoldMeansAvx2 = {make_pieces,        sum_pieces,   least_unmarked, find_face_along,
                                          sum_length_on_face, spread_along, extreme_corner, gather_rim,
                                          furthest,           next_near,    answer_lines,   find_extreme};

void nearest_phase_avx2(const NearestTask& task, const BoundedBlockPair* from, std::uint32_t count,
                        NearestSoFar& state) {
  NearestWalk<NearestLaneMeans<8>>(task, state).run(from, count);
}

}  // namespace tandem
#endif
