#pragma once
#include "kernels/contact/narrow_phase.h"
#include "tandem/kernels/detail/buffer.h"

// Whether two bodies come within a distance of each other, by the nearest blocks first. The walk of
// narrow_phase.h takes what it meets first, which is faster where nearly all or none of it is near; where
// boxes are within the distance and the triangles in them are not, it would look at all pairs of them.
namespace tandem {

/// A walk of narrow_phase() for one pair within a distance gives up when it has looked at as many candidates
/// as both bodies have triangles, but not before it has looked at so many.
inline constexpr std::uint64_t kLeastBeforeGivingUp = 1024;

/// A pair of blocks that waits, and a bound of its distance, see box_distance.h.
struct NearBlockPair {
  float bound;
  std::uint32_t a, b, mask;
};

/// Adds one contact of a pair, where it has any, to the sink. waiting: memory that is kept. False: out of
/// memory. Condition: task.in_frame, two bodies, task.within > 0, and not mode boxes.
bool find_first_within(const PairTask& task, ContactSink& sink, Buffer<NearBlockPair>& waiting);

}  // namespace tandem
