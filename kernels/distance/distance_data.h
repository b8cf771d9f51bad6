#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/frontier.h"
#include "kernels/contact/candidate.h"
#include "kernels/contact/recorded_pair.h"
#include "kernels/geometry/frame_distance.h"
#include "kernels/geometry/triangle_distance.h"
#include "tandem/kernels/gpu_distance_query.h"

// The kernels of a distance query share this data, all of it in GPU memory.
//
// A query goes through its object pairs together, in steps that are kernels of their own, and what a kernel
// reads is never written while it runs. So all that is decided is the same on every run, and results are:
// minima of what all threads find do not depend on their order.
//  1. prepare (prepare_distances.cu): a frame for each pair; those with root nodes within reach are walked.
//  2. A narrow walk (walk_distances.cu), in rounds: of each pair only the block pairs with the least bounds
//  go
//     on, some dozens, or thousands where there are few pairs. It ends at the nearest triangles, as a rule,
//     and nothing depends on that: it gives an upper bound.
//  3. The walk: the same rounds over all block pairs below that bound, and float32 bounds of triangle pairs.
//  4. settle (settle_distances.cu): float64 for the pair of triangles that is nearest by float32, then for
//     others that the direction of the first does not tell to be as far.
namespace tandem::gpu {

/// The record of an object pair; see DistanceFrame.
struct alignas(16) DistanceRecord {
  PairRecord pair;  ///< of axis-aligned blocks
  double square_to_world, least_in_world, most_in_world;
};

/// Triangles of a pair as one number, of which the least wins among those that are equally near.
TANDEM_HD constexpr Counter triangles_as_number(std::uint32_t a, std::uint32_t b) {
  return static_cast<Counter>(a) << 32 | b;
}

/// The bounds of the distance of a pair. Numbers that many threads lessen are the bits of a float64 that is
/// not negative.
struct alignas(16) NearState {
  // Boxes must be nearer than these to count, with the tolerance and without it: by limit_of(), and in the
  // world.
  float limit, open_limit;
  double near, open_near;
  distance::FrameDirection along;  ///< in which the triangles of `seed` are apart
  float top;                       ///< bounds are below it, mostly
  Counter upper;                   ///< of the distance
  Counter floor;                   ///< what was passed over is not nearer
  Counter seed, first;             ///< triangles: that the narrow walk found, and that are nearest by float32
  Counter first_upper;             ///< by float64
  Counter best;                    ///< the least upper bound of float64
  Counter best_of_rest;            ///< triangles that have it, besides the first
};

/// Bounds less the least one of their pair are counted in so many steps, one for each factor of 2, of which
/// the last ends at NearState::top.
inline constexpr int kSteps = 32;

/// The number of entries that a round of the narrow walk has, by steps, and the least bound of them: that of
/// this round and the two after it. Zero, which stands for no bound, two rounds before they are counted.
struct Narrowing {
  std::uint32_t steps[3][kSteps];
  std::uint32_t least[3];  ///< complement of the bits
  std::uint32_t spare;
};
static_assert(sizeof(Narrowing) == 400);

/// A pair of blocks to be looked at; mask: as of BlockPair, and above its 16 bits the step of the bound.
struct alignas(16) BlockPairEntry {
  std::uint32_t pair, a, b, mask;
};

/// Two triangles of an object pair.
struct TrianglePairEntry {
  std::uint32_t pair, a, b;
};

/// The bounds of the distance of a triangle pair, in a's frame; 0 and infinity where float32 knows nothing.
struct FrameBounds {
  float lower, upper;
};

/// Zero when a query begins, up to the report.
struct DistanceState {
  Counter error;  ///< complement of (what, where, status), 0 where there is none: the first wins
  Counter walked, seeds, near, rest;                                ///< elements of these lists
  Counter narrow_rounds[kMostRounds + 1], rounds[kMostRounds + 1];  ///< of the frontiers
  Counter narrow_block_pairs, world_pairs, settled, touching;
  std::uint32_t words, finished_blocks;
  GpuDistanceReport report;
};

/// The arguments of all kernels of a query.
struct DistanceArgs {
  const GpuAsset* assets;
  std::uint32_t asset_count;
  GpuInstances instances;
  GpuPairs given;
  DistanceTolerance tolerance;
  double reach;
  const double* reach_of_pair;  ///< or null
  const ObjectDistance* former;
  GpuDistanceCapacity capacity;
  DistanceState* state;
  GpuDistanceReport* host_report;  ///< in CPU memory
  DistanceRecord* records;
  NearState* near_states;
  ObjectDistance* distances;
  AppendList<std::uint32_t> walked;  ///< pairs
  Narrowing* narrowings;
  Frontier<BlockPairEntry> narrow, frontier;  ///< of the narrow walk and of the walk: one place for both
  AppendList<TrianglePairEntry> seeds, near;  ///< of triangles that they come to: likewise
  FrameBounds* bounds;                        ///< of these
  AppendList<TrianglePairEntry> rest;
  TriangleDistance* rest_distances;  ///< of these
  std::uint32_t rounds;
  DeviceLimits limits;
};

/// The steps of a query.
cudaError_t prepare_distances(const DistanceArgs& args, cudaStream_t stream);
cudaError_t walk_distances(const DistanceArgs& args, cudaStream_t stream);
cudaError_t settle_distances(const DistanceArgs& args, cudaStream_t stream);

#ifdef __CUDACC__

__device__ inline Counter as_bits(double x) {
  return static_cast<Counter>(__double_as_longlong(x));
}
__device__ inline double as_double(Counter bits) {
  return __longlong_as_double(static_cast<long long>(bits));
}

/// bits = min(bits, x), sparing the atomic operation where it would change nothing. Condition: x >= 0.
__device__ inline void lessen(Counter& bits, double x) {
  if (as_bits(x) < *static_cast<volatile Counter*>(&bits)) atomicMin(&bits, as_bits(x));
}

/// The frame of a pair that is in_frame.
__device__ inline DistanceFrame frame_of(const DistanceRecord& record) {
  DistanceFrame frame;
  frame.b_in_a = pose_of(record.pair);
  frame.error = record.pair.frame_error;
  frame.square_to_world = record.square_to_world;
  frame.least_in_world = record.least_in_world;
  frame.most_in_world = record.most_in_world;
  return frame;
}

__device__ inline double reach_of(const DistanceArgs& args, std::uint32_t pair) {
  return args.reach_of_pair != nullptr ? args.reach_of_pair[pair] : args.reach;
}

/// Returns the least number that is beyond the reach of a pair; infinite without a reach.
__device__ inline double beyond_reach(const DistanceArgs& args, std::uint32_t pair) {
  return std::nextafter(reach_of(args, pair), HUGE_VAL);
}

/// Returns the upper bound of the distance. Before anything is known, what is at least so far is beyond
/// reach.
__device__ inline double upper_in(const NearState& state, double beyond) {
  return fmin(as_double(state.upper), beyond);
}

/// nearness() of the CPU.
__device__ inline double nearness(const DistanceArgs& args, double upper, double beyond) {
  return upper < beyond ? nearness_below(args.tolerance, upper) : upper;
}

/// Triangles of a pair, in world coordinates.
__device__ inline TrianglePair posed_pair(const DistanceArgs& args, std::uint32_t pair, std::uint32_t a,
                                          std::uint32_t b) {
  return posed_pair(args, args.records[pair].pair, a, b);
}

/// The distance of two triangles, and how many words it needs where kWords leave it too wide. Takes KBs of
/// stack, so its code stands once in a kernel.
template <int kWords>
__device__ __noinline__ TriangleDistance settle(const DistanceArgs& args, const TrianglePair& triangles) {
  TriangleDistance found;
  if (!find_distance<kWords>(triangles, args.tolerance, found))
    atomicMax(&args.state->words, static_cast<std::uint32_t>(exact::exponents_of(triangles).words()));
  return found;
}

#endif

}  // namespace tandem::gpu
