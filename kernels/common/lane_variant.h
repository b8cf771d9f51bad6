#pragma once
#include <cstdint>

#include "kernels/common/block_pair.h"

namespace tandem {

struct PairTask;
struct ContactSink;
struct NearestTask;
struct BoundedBlockPair;
struct NearestSoFar;
struct ManifoldLanes;
struct RefitTree;
struct RayTask;
struct RayStream;
struct RayGroupWays;
struct PointTask;

/// The functions that are compiled once for each width of vectors.
struct LaneVariant {
  BlockPairTest block_pair_test;
  bool (*narrow_phase)(const PairTask&, ContactSink&);
  bool (*narrow_phase_without_neighbours)(const PairTask&, ContactSink&);
  void (*nearest_phase)(const NearestTask&, const BoundedBlockPair*, std::uint32_t, NearestSoFar&);
  const ManifoldLanes* manifold_lanes;
  double (*refit)(const RefitTree&, const float*);
  void (*ray_walk)(RayTask&);
  void (*ray_stream_walk)(const RayStream&);
  const RayGroupWays* ray_group_ways;
  void (*point_walk)(PointTask&);
};

// Each is defined in a file of kernels/variants/, which is compiled for machines that have the instructions.
extern const LaneVariant kLanes4, kAvx2, kAvx512;

/// The lanes of a variant, or null where it has none or this machine or this build lacks it.
const LaneVariant* lane_variant(BlockPairVariant variant);

/// The way of a variant: `scalar`, or what its lanes have; null where this machine or this build lacks it.
template <typename Way>
Way way_of(BlockPairVariant variant, Way scalar, Way LaneVariant::*of_lanes) {
  if (variant == BlockPairVariant::scalar) return scalar;
  const LaneVariant* const lanes = lane_variant(variant);
  return lanes == nullptr ? nullptr : lanes->*of_lanes;
}

/// The widest way that this machine and this build have. named_way: narrow_phase() or another that takes a
/// variant.
template <typename Way>
Way best_way(Way (*named_way)(BlockPairVariant)) {
  Way best = nullptr;
  for (const BlockPairVariant variant : kBlockPairVariants) {
    if (const Way way = named_way(variant); way != nullptr) best = way;
  }
  return best;
}

}  // namespace tandem
