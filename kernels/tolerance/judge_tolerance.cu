#include <algorithm>
#include <cstddef>

#include "kernels/tolerance/tolerance_data.h"

// These kernels run before and behind the contact query of a query by tolerance. They are compiled without
// fused operations, so that levels are those that the CPU chooses.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

/// No more blocks than there is work for.
Grid grid_for(const ToleranceArgs& args, std::uint32_t most, cudaStream_t stream) {
  const std::uint32_t blocks = std::min(args.limits.processors * 8, most / kThreads + 1);
  return {blocks, kThreads, 0, stream, args.limits.early_launch};
}

__global__ void __launch_bounds__(kThreads) choose(const __grid_constant__ ToleranceArgs args) {
  wait_for_kernel_before();
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  for (std::uint32_t i = first; i < args.instances.count; i += step) {
    const std::uint32_t asset = args.instances.asset[i];
    args.level[i] = 0;
    args.asset[i] = kNoIndex;  // the contact query tells of it
    if (asset >= args.asset_count) continue;
    const levels::LevelRange range = args.assets[asset];
    const GpuAsset* own = args.levels + range.first;
    const Pose stored = for_stored_coordinates(args.instances.pose[i], own->origin);
    args.level[i] = levels::level_within(own, range.count, stored, args.tolerance);
    args.asset[i] = range.first + args.level[i];
  }
}

/// Condition: all blocks are done, but for this thread.
__device__ void write_report(const ToleranceArgs& args) {
  const GpuContactReport& query = *args.query;
  const volatile Counter* counted = args.state->verdicts;
  GpuToleranceReport report = {};
  report.status = query.status;
  report.where = query.where;
  if (query.status == Status::kOk) {
    report.complete = query.complete;
    report.needed = {args.instances.count, query.needed.pairs, query.needed.undecided};
    report.world_pairs = query.world_pairs;
    report.counters = {counted[static_cast<int>(ToleranceVerdict::apart)],
                       counted[static_cast<int>(ToleranceVerdict::touching)],
                       counted[static_cast<int>(ToleranceVerdict::within_tolerance)], query.counters};
  }
  args.state->report = report;
  *args.host_report = report;
}

__global__ void __launch_bounds__(kThreads) judge(const __grid_constant__ ToleranceArgs args) {
  wait_for_kernel_before();
  const std::uint64_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  const std::uint64_t pairs = args.query->status == Status::kOk ? args.query->counters.object_pairs : 0;
  std::uint32_t counted[3] = {};
  for (std::uint64_t i = first; i < pairs; i += step) {
    const ObjectPair pair = args.given.pairs[i];
    const PairVerdict verdict =
        levels::verdict_on(pair, args.level[pair.a], args.level[pair.b], args.met[i] != 0);
    args.verdicts[i] = verdict;
#pragma unroll
    for (int v = 0; v < 3; ++v) counted[v] += static_cast<int>(verdict.verdict) == v ? 1 : 0;
  }
#pragma unroll
  for (int v = 0; v < 3; ++v) {
    const std::uint32_t of_warp = __reduce_add_sync(kAllLanes, counted[v]);
    if (lane_id() == 0 && of_warp != 0) atomicAdd(&args.state->verdicts[v], Counter{of_warp});
  }
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0 && atomicAdd(&args.state->finished_blocks, 1u) == gridDim.x - 1) write_report(args);
}

}  // namespace

cudaError_t choose_levels(const ToleranceArgs& args, cudaStream_t stream) {
  const cudaError_t error = cudaMemsetAsync(args.state, 0, offsetof(ToleranceState, report), stream);
  if (error != cudaSuccess) return error;
  return launch_after(grid_for(args, args.instances.count, stream), choose, args);
}

cudaError_t judge_pairs(const ToleranceArgs& args, cudaStream_t stream) {
  return launch_after(grid_for(args, std::min(args.given.capacity, args.pair_capacity), stream), judge, args);
}

}  // namespace tandem::gpu
