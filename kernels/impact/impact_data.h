#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/frontier.h"
#include "kernels/contact/gpu_query_data.h"
#include "kernels/impact/box_times.h"
#include "kernels/impact/step_parts.h"
#include "tandem/kernels/gpu_impact_query.h"

// The kernels that find times of impact share this data, all of it in GPU memory. Times are parts of the
// step.
//
// A query takes these stages:
//  1. Bodies: motions in terms of the step, and swept boxes, of which the broad phase makes pairs.
//  2. Contacts at the start: the contact query's. The other pairs have a walk for each of their pieces.
//  3. Rounds over the block pairs of all walks. What follows a block pair is what the walk on a CPU makes of
//     it, but for the order: it does not know of stops that are found at the same time.
//  4. Before a round of blocks that are small already, the pairs that are left are posed at some times of the
//     step, and the contact query's walk looks for contacts there: no impact is later than one of these, so
//     the rounds to come look at the time before it alone. Without it, bodies that meet early and go through
//     each other take thirty times the block pairs (docs/decisions/impacts.md).
//  5. Triangle pairs are told apart by their planes or advanced, each by a thread, and the first that stops
//     stops the pair.
namespace tandem::gpu {

/// The most rounds: each level of two trees, and each halving of a part, takes one.
TANDEM_HD constexpr std::uint32_t impact_rounds_of(std::uint32_t depth) {
  return rounds_of(depth, depth) + impact::kHalvings;
}
inline constexpr std::uint32_t kMostImpactRounds = impact_rounds_of(kMaxDepth);

/// The round before which pairs are posed, see above: most pairs that do not meet have no block pairs any
/// more, and those that meet have few yet.
inline constexpr std::uint32_t kSampledRound = 4;

/// Times at which a pair is posed at once. They are fewer where many pairs are left.
inline constexpr std::uint32_t kMostSamples = 16;

struct ImpactPair {
  impact::PairMotion motion;
  double tolerance;     ///< in units of length
  double acceleration;  ///< largest_acceleration()
  const Block *blocks_a, *blocks_b;
  const Triangle *triangles_a, *triangles_b;
};

/// A part of a piece of a pair.
struct alignas(16) ImpactPart {
  std::uint32_t pair;
  std::uint32_t piece;   ///< the part that is the whole piece
  std::uint32_t number;  ///< of the part, see step_parts.h
  impact::Span time;
  impact::PairFrames frames;  ///< when it begins
};

/// A block pair whose nodes in the mask may meet in the part, but not before `apart`.
struct ImpactBlockPair {
  std::uint32_t part, a, b, mask;
  double apart;
};

/// Two triangles whose boxes may meet in the part, but not before `apart`.
struct ImpactTrianglePair {
  std::uint32_t part, a, b;
  double apart;
};

/// Two triangles that are advanced from `time` to `end` at most, and then stop at `time`, or do not and it is
/// `end`.
struct AdvancedPair {
  std::uint32_t pair, a, b;
  bool converged;
  double time, end;
};

struct ImpactState {
  Counter error;  ///< as of QueryState, of instances
  Counter parts, triangle_pairs, advanced;
  Counter waiting[kMostImpactRounds + 1];  ///< block pairs of each round
  Counter made[kMostImpactRounds + 1];     ///< parts whose frames were made before the round
  Counter visited, steps;
  std::uint32_t walks, at_start, found, unconverged, most_steps;
  std::uint32_t sampled_pairs, samples;  ///< samples: of all of them
  std::uint32_t finished_blocks;
  GpuImpactReport report;
};

/// The arguments of all kernels of a query.
struct ImpactArgs {
  const GpuAsset* assets;
  std::uint32_t asset_count;
  GpuInstances instances;
  const RigidMotion* motion;
  double duration, tolerance;
  GpuPairs given;
  GpuImpactCapacity capacity;
  ImpactState* state;
  GpuImpactReport* host_report;            ///< in CPU memory
  const GpuBroadPhaseReport* broad_phase;  ///< null where pairs are given
  const GpuContactReport* query;
  const Contact* contacts;  ///< at the start

  impact::MovingBody* bodies;
  WorldBox* boxes;  ///< swept
  ImpactPair* pairs;
  double* sought;      ///< of each pair: the walk looks for impacts before it; 0: in contact at the start
  Counter* stops;      ///< of each pair: its earliest stop, the bits of a float64 number
  Counter* triangles;  ///< of each pair: the least of the two triangles that stop it, kNoTriangles: none
  Impact* impacts;

  ImpactPart* parts;
  std::uint32_t *part_keys, *part_of_key;  ///< a hash table of halves
  std::uint32_t most_keys;                 ///< a power of two
  Frontier<ImpactBlockPair> frontier;
  AppendList<ImpactTrianglePair> triangle_pairs;
  AppendList<AdvancedPair> advanced;

  std::uint32_t* is_sampled;     ///< of each pair
  std::uint32_t* sampled_pairs;  ///< pairs that are left
  std::uint32_t* met[2];         ///< of each sample: whether there is a contact; of either time
  PairRecord* samples;
  std::uint32_t most_samples;
  DeviceLimits limits;
};

/// 1: bodies and boxes.
cudaError_t move_bodies(const ImpactArgs& args, cudaStream_t stream);
/// 2: what the contact query found, and the pieces of the other pairs.
cudaError_t begin_impacts(const ImpactArgs& args, cudaStream_t stream);
/// 3: rounds from one to another.
cudaError_t walk_impacts(const ImpactArgs& args, std::uint32_t first, std::uint32_t end, cudaStream_t stream);
/// 4: poses the pairs that are left, the first time throughout the step, the second around the first contact.
cudaError_t list_sampled_pairs(const ImpactArgs& args, cudaStream_t stream);
cudaError_t pose_samples(const ImpactArgs& args, std::uint32_t which, cudaStream_t stream);
cudaError_t end_at_samples(const ImpactArgs& args, cudaStream_t stream);
/// 5: what stops each pair, and the report.
cudaError_t advance_impacts(const ImpactArgs& args, cudaStream_t stream);
cudaError_t write_impacts(const ImpactArgs& args, cudaStream_t stream);

#ifdef __CUDACC__

/// Returns whether there are pairs to walk: nothing was wrong with instances or pairs, and all contacts had
/// room.
__device__ inline bool can_walk(const ImpactArgs& args) {
  return args.state->error == 0 && args.query->status == Status::kOk && args.query->complete != 0 &&
         *args.given.count <= args.capacity.pairs;
}

/// A part that a block pair names by its place in the hash table.
inline constexpr std::uint32_t kInTable = 1u << 31;

/// The part that a block pair names; kNoIndex where it had no room.
__device__ inline std::uint32_t part_named(const ImpactArgs& args, std::uint32_t named) {
  return named == kNoIndex || (named & kInTable) == 0 ? named : args.part_of_key[named & ~kInTable];
}

__device__ inline std::uint32_t first_of_thread() {
  return blockIdx.x * blockDim.x + threadIdx.x;
}
__device__ inline std::uint32_t threads_of_grid() {
  return gridDim.x * blockDim.x;
}

#endif

}  // namespace tandem::gpu
