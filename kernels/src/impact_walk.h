#pragma once
#include "tandem/kernels/detail/impact/pair_motion.h"
#include "tandem/kernels/impact_query.h"

namespace tandem::impact {

/// The largest angle, in radians, by which a body turns in one walk: the larger it is, the less boxes know
/// of where their nodes are at its end.
inline constexpr double kMostTurnOfWalk = 0.25;

/// What stops a pair.
struct PairStop {
  double time;  ///< a part of the step; 1: nothing does
  std::uint32_t triangle_a = kNoIndex, triangle_b = kNoIndex;
};

/// Until when two trees stay apart. tolerance: in units of length. Adds to the counters.
PairStop find_stop(const PairMotion& pair, const LevelView& a, const LevelView& b, double tolerance,
                   ImpactCounters& counters);

}  // namespace tandem::impact
