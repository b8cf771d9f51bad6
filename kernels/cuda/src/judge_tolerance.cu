#include <algorithm>
#include <cstddef>

#include "tolerance_data.h"

// Rounds of a query by tolerance. Compiled without fused operations, so that the levels that tell are those
// of the CPU.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

/// No more blocks than there is work for.
Grid grid_for(const ToleranceArgs& args, std::uint32_t most, cudaStream_t stream) {
  const std::uint32_t blocks = std::min(args.limits.processors * 8, most / kThreads + 1);
  return {blocks, kThreads, 0, stream, args.limits.early_launch};
}

/// Condition: the instance's asset is one.
__device__ std::uint32_t level_in(const ToleranceArgs& args, std::uint32_t instance, std::uint32_t round) {
  const levels::LevelRange range = args.assets[args.instances.asset[instance]];
  return levels::level_in_round(range.count, args.last[instance], round);
}

/// The level by place among all; kNoIndex where there is no such asset, which the contact query tells of.
__device__ void set_level(const ToleranceArgs& args, std::uint32_t instance, std::uint32_t round) {
  const std::uint32_t asset = args.instances.asset[instance];
  args.level[instance] =
      asset < args.asset_count ? args.assets[asset].first + level_in(args, instance, round) : kNoIndex;
}

__global__ void __launch_bounds__(kThreads) begin(const __grid_constant__ ToleranceArgs args) {
  wait_for_kernel_before();
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  for (std::uint32_t i = first; i < args.instances.count; i += step) {
    const std::uint32_t asset = args.instances.asset[i];
    args.last[i] = 0;
    if (asset < args.asset_count) {
      const levels::LevelRange range = args.assets[asset];
      const GpuAsset* own = args.levels + range.first;
      const Pose stored = for_stored_coordinates(args.instances.pose[i], own->origin);
      args.last[i] = levels::last_level(own, range.count, stored, args.tolerance);
    }
    set_level(args, i, 0);
  }
}

/// A pair of the round.
__device__ void judge_pair(const ToleranceArgs& args, std::uint32_t round, std::uint32_t i) {
  const ObjectPair pair = round == 0 ? args.given.pairs[i] : args.open[round % 2][i];
  const std::uint32_t row = round == 0 ? i : args.rows[round % 2][i];
  const std::uint32_t level_a = level_in(args, pair.a, round), level_b = level_in(args, pair.b, round);
  const bool near = args.met[i] != 0;
  PairVerdict verdict = {ToleranceVerdict::apart, static_cast<std::uint8_t>(level_a),
                         static_cast<std::uint8_t>(level_b)};
  if (pair.a == pair.b) {
    verdict = {ToleranceVerdict::touching, 0, 0};
  } else if (near && level_a == args.last[pair.a] && level_b == args.last[pair.b]) {
    verdict.verdict = levels::verdict_on_near(level_a, level_b);
  } else if (near) {
    const std::uint32_t place = atomicAdd(&args.state->open[round + 1], 1u);
    args.open[(round + 1) % 2][place] = pair;
    args.rows[(round + 1) % 2][place] = row;
    return;
  }
  args.verdicts[row] = verdict;
  atomicAdd(&args.state->verdicts[static_cast<std::uint32_t>(verdict.verdict)], Counter{1});
}

__device__ void add_to(QueryCounters& sum, const QueryCounters& part) {
  sum.object_pairs += part.object_pairs;
  sum.block_pairs += part.block_pairs;
  sum.candidates += part.candidates;
  sum.decided_by_float32 += part.decided_by_float32;
  sum.decided_by_float64 += part.decided_by_float64;
  sum.decided_exactly += part.decided_exactly;
  sum.contacts += part.contacts;
}

/// What the round's contact query says of itself, by one thread.
__device__ void take_report(const ToleranceArgs& args, std::uint32_t round) {
  const GpuQueryReport& query = *args.query;
  GpuToleranceReport& report = args.state->report;
  if (round == 0) {
    report = {};
    report.complete = 1;
    report.needed.instances = args.instances.count;
    report.needed.pairs = query.needed.pairs;
  }
  if (report.status == Status::kOk) {
    report.status = query.status;
    report.where = query.where;
  }
  report.complete &= query.complete;
  if (query.needed.undecided > report.needed.undecided) report.needed.undecided = query.needed.undecided;
  report.world_pairs += query.world_pairs;
  const std::uint64_t pairs = query.counters.object_pairs;
  report.counters.pairs_of_round[round] = pairs;
  if (pairs != 0) report.counters.rounds = round + 1;
  add_to(report.counters.work, query.counters);
}

/// Condition: all blocks of the last round are done, but for this thread.
__device__ void write_report(const ToleranceArgs& args) {
  GpuToleranceReport& report = args.state->report;
  const volatile Counter* verdicts = args.state->verdicts;
  report.counters.apart = verdicts[static_cast<std::uint32_t>(ToleranceVerdict::apart)];
  report.counters.touching = verdicts[static_cast<std::uint32_t>(ToleranceVerdict::touching)];
  report.counters.within_tolerance = verdicts[static_cast<std::uint32_t>(ToleranceVerdict::within_tolerance)];
  if (report.status != Status::kOk) {
    const Status status = report.status;
    const std::uint64_t where = report.where;
    report = {};
    report.status = status;
    report.where = where;
  }
  *args.host_report = report;
}

__global__ void __launch_bounds__(kThreads)
    judge(const __grid_constant__ ToleranceArgs args, std::uint32_t round) {
  wait_for_kernel_before();
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  if (args.query->status == Status::kOk) {
    const std::uint64_t pairs = args.query->counters.object_pairs;
    for (std::uint64_t i = first; i < pairs; i += step)
      judge_pair(args, round, static_cast<std::uint32_t>(i));
  }
  if (first == 0) take_report(args, round);
  if (round + 1 != args.rounds) {
    for (std::uint32_t i = first; i < args.instances.count; i += step) set_level(args, i, round + 1);
    return;
  }
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0 && atomicAdd(&args.state->finished_blocks, 1u) == gridDim.x - 1) {
    __threadfence();
    write_report(args);
  }
}

}  // namespace

cudaError_t begin_rounds(const ToleranceArgs& args, cudaStream_t stream) {
  const cudaError_t error = cudaMemsetAsync(args.state, 0, offsetof(ToleranceState, report), stream);
  if (error != cudaSuccess) return error;
  return launch_after(grid_for(args, args.instances.count, stream), begin, args);
}

cudaError_t judge_round(const ToleranceArgs& args, std::uint32_t round, cudaStream_t stream) {
  const std::uint32_t most =
      std::max(args.instances.count, std::min(args.given.capacity, args.pair_capacity));
  return launch_after(grid_for(args, most, stream), judge, args, round);
}

}  // namespace tandem::gpu
