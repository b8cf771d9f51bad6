#include <algorithm>

#include "kernels/common/check_options.h"
#include "kernels/common/traversal.h"
#include "kernels/distance/distance_data.h"

// Before the walk, these kernels find what is wrong with instances and pairs, how the two of a pair lie, and
// which pairs have anything within reach. They are compiled without fused operations, so that poses, and what
// is proved of frames, are those of the CPU.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 32;  // few, so that few pairs spread over all multiprocessors

__device__ void report_error(const DistanceArgs& args, Subject subject, Counter where, Status status) {
  atomicMax(&args.state->error, packed_error(subject, where, status));
}

__device__ DistanceRecord make_record(const ObjectPair& pair, const LevelView& a, const LevelView& b,
                                      bool in_frame, const DistanceFrame& frame) {
  DistanceRecord record = {};
  set_pose(frame.b_in_a, record.pair);
  record.pair.frame_error = frame.error;
  record.pair.in_frame = in_frame;
  record.pair.instance_a = pair.a;
  record.pair.instance_b = pair.b;
  record.pair.triangles_a = a.triangles;
  record.pair.triangles_b = b.triangles;
  record.pair.blocks_a = a.blocks;
  record.pair.blocks_b = b.blocks;
  record.square_to_world = frame.square_to_world;
  record.least_in_world = frame.least_in_world;
  record.most_in_world = frame.most_in_world;
  return record;
}

/// Returns whether any nodes of the root blocks are within reach.
__device__ bool has_near_roots(const DistanceRecord& record, const DistanceFrame& frame, float limit) {
  const Block &a = record.pair.blocks_a[0], &b = record.pair.blocks_b[0];
#pragma unroll 1
  for (int i = 0; i < kNodesPerBlock; ++i) {
    bool near = false;
#pragma unroll
    for (int j = 0; j < kNodesPerBlock; ++j)
      near = near || box_distance_bound(box_of(a, i), box_of(b, j), frame.b_in_a) < limit;
    if (near) return true;
  }
  return false;
}

/// Returns the state in which nothing is known.
__device__ NearState fresh_state(double beyond) {
  NearState state = {};
  state.near = state.open_near = beyond;
  state.upper = state.floor = state.first_upper = state.best = as_bits(INFINITY);
  state.seed = state.first = state.best_of_rest = kNoTriangles;
  return state;
}

/// Returns how far apart anything of two trees can be, up to rounding.
__device__ double farthest_of(const Pose& pose_a, const TreeExtent& a, const Pose& pose_b,
                              const TreeExtent& b) {
  double sum = 0;
  for (int k = 0; k < 3; ++k)
    sum += std::fabs(pose_b.translation[k] - pose_a.translation[k]) + a.reach[k] + b.reach[k];
  return sum;
}

/// Result: whether the pair is to be walked.
__device__ bool prepare_pair(const DistanceArgs& args, std::uint32_t index) {
  const double beyond = beyond_reach(args, index);
  NearState state = fresh_state(beyond);
  const ObjectPair pair = args.given.pairs[index];
  Status status = check_pair(pair, args.instances.count);
  if (status == Status::kOk) status = check_reach(reach_of(args, index));
  if (status != Status::kOk) report_error(args, Subject::pair, index, status);
  // Assets that there are not are reported with the instance.
  bool walked = status == Status::kOk && args.instances.asset[pair.a] < args.asset_count &&
                args.instances.asset[pair.b] < args.asset_count;
  if (walked) {
    const GpuAsset &a = args.assets[args.instances.asset[pair.a]],
                   &b = args.assets[args.instances.asset[pair.b]];
    DistanceFrame frame = {};
    const Pose pose_a = stored_pose(args, pair.a), pose_b = stored_pose(args, pair.b);
    const bool in_frame = distance_frame(pose_a, a.extent, pose_b, b.extent, frame);
    const DistanceRecord record = make_record(pair, a.tree, b.tree, in_frame, frame);
    args.records[index] = record;
    const double farthest = farthest_of(pose_a, a.extent, pose_b, b.extent);
    state.limit = state.open_limit = in_frame ? distance::limit_of(frame, beyond) : INFINITY;
    state.top = fminf(state.limit, static_cast<float>(in_frame ? farthest * farthest : farthest));
    if (!in_frame) atomicAdd(&args.state->world_pairs, Counter{1});
    if (pair.a == pair.b) state.first = triangles_as_number(0, 0);
    walked = pair.a != pair.b && (!in_frame || has_near_roots(record, frame, state.limit));
  }
  args.near_states[index] = state;
  return walked;
}

/// The triangles that were nearest a step ago, as one number.
__device__ Counter former_triangles(const DistanceArgs& args, std::uint32_t index) {
  if (args.former == nullptr) return kNoTriangles;
  const ObjectPair pair = args.given.pairs[index];
  const std::uint32_t a = args.former[index].triangle_a, b = args.former[index].triangle_b;
  const LevelView &tree_a = args.assets[args.instances.asset[pair.a]].tree,
                  &tree_b = args.assets[args.instances.asset[pair.b]].tree;
  return a < tree_a.triangle_count && b < tree_b.triangle_count ? triangles_as_number(a, b) : kNoTriangles;
}

/// Puts the roots of a pair, where there is one, at the beginning of the narrow walk. All lanes take part.
__device__ void begin_walk(const DistanceArgs& args, bool walked, std::uint32_t index) {
  AppendBatch<std::uint32_t, 1> pairs;
  AppendBatch<BlockPairEntry, 1> roots;
  AppendBatch<TrianglePairEntry, 1> seeds;
  if (walked) {
    pairs.put(0, index);
    roots.put(0, {index, 0, 0, kAllNodePairs});
    Narrowing narrowing = {};
    narrowing.steps[0][0] = 1;
    narrowing.least[0] = ~0u;  // 0
    args.narrowings[index] = narrowing;
    const Counter former = former_triangles(args, index);
    if (former != kNoTriangles)
      seeds.put(0, {index, static_cast<std::uint32_t>(former >> 32), static_cast<std::uint32_t>(former)});
  }
  pairs.append_to(args.walked);
  roots.append_to(args.narrow.round(0));
  seeds.append_to(args.seeds);
}

__global__ void __launch_bounds__(kThreads) prepare(const __grid_constant__ DistanceArgs args) {
  wait_for_kernel_before();
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  const std::uint32_t pairs = pair_count(args);
  for (std::uint32_t begin = first - lane_id(); begin < pairs; begin += step) {
    const std::uint32_t index = begin + lane_id();
    begin_walk(args, index < pairs && prepare_pair(args, index), index);
  }
  for (std::uint32_t i = step - 1 - first; i < args.instances.count;
       i += step) {  // by other threads, at first
    const Status status = check_instance(args.instances, args.assets, args.asset_count, i);
    if (status != Status::kOk) report_error(args, Subject::instance, i, status);
  }
}

}  // namespace

cudaError_t prepare_distances(const DistanceArgs& args, cudaStream_t stream) {
  const std::uint64_t most =
      std::uint64_t{args.instances.count} + std::min(args.given.capacity, args.capacity.pairs);
  const auto blocks =
      static_cast<std::uint32_t>(std::min<std::uint64_t>(args.limits.processors * 32, most / kThreads + 1));
  return launch_after({blocks, kThreads, 0, stream, args.limits.early_launch}, prepare, args);
}

}  // namespace tandem::gpu
