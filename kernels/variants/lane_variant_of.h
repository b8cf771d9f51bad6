#pragma once
#include "kernels/common/lane_variant.h"
#include "kernels/contact/narrow_phase_lanes.h"
#include "kernels/distance/nearest_lanes.h"
#include "kernels/manifold/patch_passes_lanes.h"
#include "kernels/manifold/patch_walk_lanes.h"
#include "kernels/manifold/piece_lanes.h"
#include "kernels/points_and_rays/probe_lanes.h"
#include "kernels/points_and_rays/ray_lanes.h"
#include "kernels/refit/refit_lanes.h"

#ifdef TANDEM_HAVE_LANES
namespace tandem {
namespace {

template <int kCount>
std::uint16_t block_pair_mask_of_lanes(const Block& a, const Block& b, const RelativePose& b_in_a) {
  return static_cast<std::uint16_t>(BlockPairLanes<kCount>(a, b, b_in_a).mask());
}

template <int kCount, bool kWithoutNeighbours>
bool narrow_phase_of_lanes(const PairTask& task, ContactSink& sink) {
  return PairWalk<LaneMeans<kCount>, kWithoutNeighbours>(task, sink).run();
}

template <int kCount>
void nearest_phase_of_lanes(const NearestTask& task, const BoundedBlockPair* from, std::uint32_t count,
                            NearestSoFar& state) {
  NearestWalk<NearestLaneMeans<kCount>>(task, state).run(from, count);
}

constexpr ManifoldLanes kManifoldLanes = {make_pieces,        sum_pieces,   least_unmarked, find_face_along,
                                          sum_length_on_face, spread_along, gather_rim,     furthest,
                                          next_near,          answer_lines};

template <int kCount>
constexpr LaneVariant kLaneVariantOf = {block_pair_mask_of_lanes<kCount>,
                                        narrow_phase_of_lanes<kCount, false>,
                                        narrow_phase_of_lanes<kCount, true>,
                                        nearest_phase_of_lanes<kCount>,
                                        &kManifoldLanes,
                                        refit_of_lanes<kCount>,
                                        ray_walk_by<Lanes4>,
                                        ray_stream_by<Lanes<kCount>, Lanes4>,
                                        &kRayGroupWaysOf<RealLanes<kCount / 2>>,
                                        point_walk_by<Lanes4>};

}  // namespace
}  // namespace tandem
#endif
