#include "kernels/common/block_pair_variants.h"
#include "kernels/contact/narrow_phase_lanes.h"
#include "kernels/distance/nearest_lanes.h"
#include "kernels/manifold/patch_passes_lanes.h"
#include "kernels/manifold/patch_walk_lanes.h"
#include "kernels/manifold/piece_lanes.h"

// The variants of 4 lanes.
#ifdef TANDEM_HAVE_LANES
namespace tandem {

std::uint16_t block_pair_mask_lanes4(const Block& a, const Block& b, const RelativePose& b_in_a) {
  return static_cast<std::uint16_t>(BlockPairLanes<4>(a, b, b_in_a).mask());
}

bool narrow_phase_lanes4(const PairTask& task, ContactSink& sink) {
  return PairWalk<LaneMeans<4>>(task, sink).run();
}

const ManifoldMeans kManifoldMeansLanes4 = {make_pieces,        sum_pieces,   least_unmarked, find_face_along,
                                            sum_length_on_face, spread_along, extreme_corner, gather_rim,
                                            furthest,           next_near,    answer_lines,   find_extreme};

void nearest_phase_lanes4(const NearestTask& task, const BoundedBlockPair* from, std::uint32_t count,
                          NearestSoFar& state) {
  NearestWalk<NearestLaneMeans<4>>(task, state).run(from, count);
}

}  // namespace tandem
#endif
