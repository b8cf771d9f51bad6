#pragma once
#include <cmath>
#include <cstdint>

#include "kernels/contact/narrow_phase.h"
#include "kernels/geometry/box_distance.h"
#include "kernels/geometry/exact_height.h"
#include "kernels/geometry/frame_distance.h"
#include "kernels/geometry/triangle_distance.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/distance_query.h"

// The distance of one object pair: branch and bound over pairs of blocks, then float64 on the triangles that
// float32 leaves.
namespace tandem {

/// An object pair, and what is asked about it.
struct NearestTask {
  const PosedTree *a, *b;
  bool in_frame;  ///< float32 in a's frame can take the pair; else `frame` has no meaning
  DistanceFrame frame;
  DistanceTolerance tolerance;
};

NearestTask nearest_task(const PosedTree& a, const PosedTree& b, const DistanceTolerance& tolerance);

/// A pair of blocks, and how far apart what is in them is at least: a bound, see box_distance.h, or a world
/// distance where the task is not in_frame.
struct BoundedBlockPair {
  double bound;
  std::uint32_t a, b, mask;
};

/// A pair of triangles that is not apart enough, as far as float32 knows.
struct NearCandidate {
  double lower, upper;  ///< of the distance, in the world
  std::uint32_t a, b;
};

/// How far all nodes of two trees reach along one direction, by the triangles in them. Where bodies lie flat
/// on each other, or have a nearest corner in common with many triangles, so many pairs of triangles are
/// nearest that a walk would look at all: boxes tell none of them from the others. Along the direction of the
/// nearest ones so far, all are equally far, and their nodes too. It takes as long as a look at each
/// triangle.
class NodeHeights {
 public:
  /// False: out of memory.
  bool make(const NearestTask& task, const distance::Direction& along);

  /// A lower bound of the distance of node i of block a and node j of block b, both real.
  double apart(std::uint32_t a, int i, std::uint32_t b, int j) const {
    return distance::distance_of_heights(along_, of_a_[a * kNodesPerBlock + i],
                                         of_b_[b * kNodesPerBlock + j]);
  }

 private:
  distance::Direction along_;
  Buffer<double> of_a_;  // the least of each node
  Buffer<double> of_b_;  // the largest
};

/// The state of the search for the distance of a pair.
struct NearestSoFar {
  double upper = INFINITY;  ///< of the distance; before one is found, what is at least so far is beyond reach
  bool found = false;       ///< an upper bound
  bool has_direction = false;
  float direction[3];       ///< in a's frame, from b to a, between the nearest triangles so far
  double floor = INFINITY;  ///< what was passed over is not nearer
  TriangleDistance best = {{INFINITY, INFINITY}, {}, {}};
  std::uint32_t triangle_a = kNoIndex, triangle_b = kNoIndex;  ///< of `best`
  distance::Direction along = {};  ///< in the world, along which the triangles of `best` are apart
  bool has_along = false;          ///< false: it is not found yet
  Buffer<NearCandidate> candidates;
  std::uint64_t most_visits = ~std::uint64_t{0};   ///< of pairs of blocks, by one walk
  std::uint64_t bounded = 0;                       ///< pairs of triangles, by float32
  std::uint64_t most_bounded = ~std::uint64_t{0};  ///< a walk ends when there are so many
  Buffer<BoundedBlockPair> left;                   ///< what it had not visited by then
  const NodeHeights* heights = nullptr;            ///< null: unknown
  DistanceCounters counters;
  bool enough_memory = true;

  bool touches() const { return best.interval.upper == 0; }

  void reset(double reach) {
    upper = reach < INFINITY ? std::nextafter(reach, INFINITY) : reach;
    found = has_direction = false;
    floor = INFINITY;
    best.interval = {INFINITY, INFINITY};
    triangle_a = triangle_b = kNoIndex;
    has_along = false;
    bounded = 0;
    most_bounded = ~std::uint64_t{0};
    heights = nullptr;
    candidates.clear();
    left.clear();
  }
};

/// Walks from these pairs of blocks and adds what is near to `state`. Passes over what cannot make the
/// interval wider than it may be.
using NearestPhase = void (*)(const NearestTask&, const BoundedBlockPair* from, std::uint32_t count,
                              NearestSoFar& state);

/// The named way, or null where this machine or this build lacks it; all give the same. Condition:
/// task.in_frame.
NearestPhase nearest_phase(BlockPairVariant variant);

/// Walks pairs that are not in_frame by the boxes of nodes in world coordinates, float64.
void nearest_phase_by_world_boxes(const NearestTask& task, const BoundedBlockPair* from, std::uint32_t count,
                                  NearestSoFar& state);

// These functions are compiled once for any machine, and called by the variants.

/// Returns how near a pair must be to count: nearer than this. What may touch counts, whatever the tolerance.
double nearness(const NearestTask& task, const NearestSoFar& state);

/// limit_of() and distance_of() of box_distance.h.
float bound_limit(const NearestTask& task, double distance);
double bound_distance(const NearestTask& task, float bound);

/// frame_direction() of frame_distance.h.
distance::FrameDirection direction_of(const NearestTask& task, const float (&direction)[3], double at_least);

/// False: out of memory, which the state keeps.
bool add_candidate(const NearCandidate& candidate, NearestSoFar& state);

/// Leaves a pair of blocks for another walk. False: as above.
bool leave(const BoundedBlockPair& pair, NearestSoFar& state);

/// Takes those node pairs of two blocks away that the heights tell to be too far apart. Condition:
/// state.heights are known.
std::uint32_t drop_by_heights(const NearestTask& task, std::uint32_t a, std::uint32_t b, std::uint32_t hits,
                              NearestSoFar& state);

/// Settles a pair of triangles, unless they are too far apart along the direction of the best. lower: of
/// their distance, as far as it is known.
void settle_if_near(const NearestTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b, double lower,
                    NearestSoFar& state);

/// Bounds a pair of triangles by float64, and keeps it where it is nearest.
void settle(const NearestTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b, NearestSoFar& state);

/// Finds the direction of the best, if it is not known. Condition: there is a best.
void find_direction(const NearestTask& task, NearestSoFar& state);

/// Settles the candidate that tells the least upper bound, if that is less than the best's.
void settle_nearest(const NearestTask& task, NearestSoFar& state);

/// Settles the candidates that count, and one that told the upper bound, if any is there.
void settle_candidates(const NearestTask& task, NearestSoFar& state);

/// Takes what another walk of the same task found and left, whose state began as this one stood. False: out
/// of memory.
bool take_over(NearestSoFar& from, NearestSoFar& state);

}  // namespace tandem
