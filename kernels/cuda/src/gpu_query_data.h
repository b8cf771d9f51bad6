#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/relative_pose.h"

// What the kernels of a query share, all of it in GPU memory.
namespace tandem::gpu {

using Counter = unsigned long long;  // what atomicAdd takes

struct Asset {
  GpuAsset asset;
  TreeExtent extent;
};

/// What the walk needs to know of an object pair, in whole float4.
struct alignas(16) PairRecord {
  float4 rotation[3];      ///< of RelativePose; w: translation
  float4 abs_rotation[3];  ///< w: slack_a
  float slack_b[3];
  float frame_error;
  const Block *blocks_a, *blocks_b;
  const Triangle *triangles_a, *triangles_b;
  std::uint32_t instance_a, instance_b;
  std::uint32_t in_frame;  ///< float32 can take the pair
  std::uint32_t unused;
};
static_assert(sizeof(PairRecord) == 160);

/// Two leaves whose boxes overlap, of an object pair.
struct Candidate {
  std::uint32_t pair, a, b;
};

/// Block pairs that one warp gives to another.
struct Chunk {
  std::uint32_t pair[32], a[32], b[32];
};
inline constexpr std::uint32_t kChunks = 8192;

/// How warps share work: how many have work, the chunks given, the numbers given out to those who wait, the
/// first object pair that nobody took; and for each number how many block pairs its chunk holds, 0 until
/// then.
struct alignas(128) Balance {
  std::uint32_t active, given, asked, next_pair;
  alignas(128) std::uint32_t mailbox[kChunks];
};

/// Zero when a query begins.
struct QueryState {
  alignas(128) Counter error;  ///< complement of (what, where, status), 0 where there is none: the first wins
  std::uint32_t world_pairs, finished_blocks;
  Balance frame, world;
  alignas(128) Counter contacts;
  alignas(128) Counter undecided;
  alignas(128) Counter unresolved;
  alignas(128) Counter block_pairs;
  Counter candidates, decided_by_float64, decided_exactly;
  GpuQueryReport report;
};

/// The arguments of all kernels of a query.
struct QueryArgs {
  const Asset* assets;
  std::uint32_t asset_count;
  GpuInstances instances;
  GpuPairs given;
  QueryMode mode;
  bool first_contact_only;
  GpuQueryCapacity capacity;
  QueryState* state;
  Chunk* chunks;
  PairRecord* pairs;
  std::uint32_t* world_pairs;  ///< pairs that are not in_frame
  std::uint32_t* met;          ///< of a pair: not 0 once it has a contact; where only the first is asked for
  Contact* contacts;
  Candidate *undecided, *unresolved;
  std::uint32_t stack_size, stack_reserve;  ///< see walk.cuh
};

/// Fills in the extents of assets.
cudaError_t measure_assets(Asset* assets, std::uint32_t count, cudaStream_t stream);

/// Checks instances and pairs and makes the records.
cudaError_t prepare_pairs(const QueryArgs& args, cudaStream_t stream);

/// Walks the pairs that are in_frame.
cudaError_t walk_exact(const QueryArgs& args, cudaStream_t stream);
cudaError_t walk_unfused(const QueryArgs& args, cudaStream_t stream);

/// Walks the others.
cudaError_t walk_world(const QueryArgs& args, cudaStream_t stream);

/// Decides what the walks left, and writes the report.
cudaError_t decide_rest(const QueryArgs& args, cudaStream_t stream);

#ifdef __CUDACC__

__device__ inline std::uint32_t lane_id() {
  return threadIdx.x % 32;
}
inline constexpr std::uint32_t kAllLanes = 0xFFFFFFFFu;

__device__ inline std::uint32_t lanes_below() {
  return (1u << lane_id()) - 1;
}

__device__ inline std::uint32_t pair_count(const QueryArgs& args) {
  const std::uint32_t count = *args.given.count;
  const std::uint32_t room =
      args.given.capacity < args.capacity.pairs ? args.given.capacity : args.capacity.pairs;
  return count < room ? count : room;
}

__device__ inline bool failed(const QueryArgs& args) {
  return *static_cast<volatile Counter*>(&args.state->error) != 0;
}

/// The pose of stored coordinates.
__device__ inline Pose stored_pose(const QueryArgs& args, std::uint32_t instance) {
  return for_stored_coordinates(args.instances.pose[instance],
                                args.assets[args.instances.asset[instance]].asset.origin);
}

/// A place for each lane that asks for one, all lanes of a warp taking part: one atomic a warp.
__device__ inline Counter place_for(bool wanted, Counter* counter) {
  const std::uint32_t lanes = __ballot_sync(kAllLanes, wanted);
  if (lanes == 0) return 0;
  Counter first = 0;
  if (lane_id() == 0) first = atomicAdd(counter, static_cast<Counter>(__popc(lanes)));
  return __shfl_sync(kAllLanes, first, 0) + __popc(lanes & lanes_below());
}

/// Whether the contact counts: where only the first is asked for, the first of its pair.
__device__ inline bool is_wanted(const QueryArgs& args, std::uint32_t pair) {
  return !args.first_contact_only || atomicExch(&args.met[pair], 1u) == 0;
}

/// In a pair of an instance with itself the triangle with the lower index comes first.
__device__ inline Contact make_contact(std::uint32_t pair, bool self, std::uint32_t a, std::uint32_t b,
                                       std::uint32_t face_a, std::uint32_t face_b) {
  return self && a > b ? Contact{pair, b, a, face_b, face_a} : Contact{pair, a, b, face_a, face_b};
}

#endif

}  // namespace tandem::gpu
