#include <cub/block/block_scan.cuh>

#include "kernels/scene/moved_data.h"

// These kernels decide by the rule of pair_motion.h. They are compiled without fused operations, so that they
// decide as the CPU does.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 256;
constexpr std::uint32_t kPairsPerThread = kMovedTile / kThreads;

// A tile's word: two bits say what the others are, a number of pairs.
constexpr std::uint64_t kOwnSum = std::uint64_t{1} << 62, kSumUpToHere = std::uint64_t{2} << 62,
                        kSumBits = kOwnSum - 1;

/// Step 0 is that of a new table's entries.
__device__ std::uint32_t step_after(std::uint32_t step) {
  return step + 1 == 0 ? 1 : step + 1;
}

/// Returns where a pair's entries begin. Source: Stafford's variant 13 of the finalizer of MurmurHash3.
__device__ std::uint32_t first_slot(const ObjectPair& pair, std::uint32_t size) {
  std::uint64_t key = std::uint64_t{pair.a} << 32 | pair.b;
  key = (key ^ key >> 30) * 0xBF58476D1CE4E5B9u;
  key = (key ^ key >> 27) * 0x94D049BB133111EBu;
  return static_cast<std::uint32_t>(((key ^ key >> 31) >> 32) * size >> 32);
}

/// Enters a row, of pairs that are there twice each of them.
__device__ void enter(const MovedArgs& args, std::uint32_t step, const ObjectPair& pair, std::uint32_t row) {
  std::uint32_t slot = first_slot(pair, args.table_size);
  for (;;) {
    const std::uint32_t there = *static_cast<volatile std::uint32_t*>(&args.table[slot].step);
    if (there != step && atomicCAS(&args.table[slot].step, there, step) == there) break;
    if (++slot == args.table_size) slot = 0;
  }
  args.table[slot].row = row;
}

/// Returns the least row of a pair before, or kNoIndex.
__device__ std::uint32_t row_before(const MovedArgs& args, const ObjectPair& pair) {
  std::uint32_t slot = first_slot(pair, args.table_size), least = kNoIndex;
  const std::uint32_t step = args.state->step;
  while (args.table[slot].step == step) {
    const std::uint32_t row = args.table[slot].row;
    if (row < least && args.posed_before[row].pair == pair) least = row;
    if (++slot == args.table_size) slot = 0;
  }
  return least;
}

__global__ void __launch_bounds__(kThreads) remember(const __grid_constant__ MovedArgs args) {
  wait_for_kernel_before();
  MovedState& state = *args.state;
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, stride = gridDim.x * kThreads;
  const bool has_last = state.has_last != 0;
  const std::uint32_t pairs = has_last ? state.last_pairs : state.pairs_before,
                      table_step = step_after(state.step);
  for (std::uint32_t i = first; i < args.capacity / kMovedTile + 1; i += stride) args.tile_sums[i] = 0;
  if (has_last) {
    constexpr std::uint32_t kWords = sizeof(PosedBodies) / 8;
    const auto* const from = reinterpret_cast<const std::uint64_t*>(args.posed);
    auto* const to = reinterpret_cast<std::uint64_t*>(args.posed_before);
    for (std::uint64_t i = first; i < std::uint64_t{pairs} * kWords; i += stride) to[i] = from[i];
  }
  const PosedBodies* const posed = has_last ? args.posed : args.posed_before;
  for (std::uint32_t i = first; i < pairs; i += stride) enter(args, table_step, posed[i].pair, i);
  // The last block of all sees to the numbers that the others have read.
  __syncthreads();
  if (threadIdx.x != 0) return;
  __threadfence();
  if (atomicAdd(&state.finished_blocks, 1u) + 1 != gridDim.x) return;
  if (has_last) state.call_before = state.call.call;
  state.pairs_before = pairs;
  state.step = table_step;
  state.has_last = state.tiles_taken = state.finished_blocks = 0;
}

/// The sum of all tiles before this one (Merrill and Garland 2016). One thread calls it, because tiles are
/// few.
__device__ std::uint64_t sum_before(const std::uint64_t* words, std::uint32_t tile) {
  std::uint64_t sum = 0;
  while (tile-- > 0) {
    std::uint64_t word = 0;
    while ((word = *static_cast<const volatile std::uint64_t*>(&words[tile])) < kOwnSum) {
    }
    sum += word & kSumBits;
    if (word >= kSumUpToHere) break;
  }
  return sum;
}

__device__ bool is_complete(const MovedArgs& args) {
  return *args.pairs.count <= args.capacity && *args.pairs.count <= args.pairs.capacity;
}

/// Decides a pair and writes what is known of it. Result: whether it has moved.
__device__ bool decide(const MovedArgs& args, std::uint32_t i) {
  const ObjectPair pair = args.pairs.pairs[i];
  args.kept_rows[i] = kNoIndex;
  PosedBodies now = {pair, {kNoIndex, kIdentityPose}, {kNoIndex, kIdentityPose}};
  const bool known = pair.a < args.instances.count && pair.b < args.instances.count;
  if (known) {
    now.a = {args.instances.asset[pair.a], args.instances.pose[pair.a]};
    now.b = {args.instances.asset[pair.b], args.instances.pose[pair.b]};
  }
  args.posed[i] = now;
  const std::uint32_t row = row_before(args, pair);
  if (row == kNoIndex || now.a.asset >= args.asset_count || now.b.asset >= args.asset_count) return true;
  const PosedBodies before = args.posed_before[row];
  if (before.a.asset != now.a.asset || before.b.asset != now.b.asset) return true;
  const double tolerance = args.tolerance_of_pair != nullptr ? args.tolerance_of_pair[i] : args.tolerance;
  if (!is_kept(args.boxes[now.a.asset], args.boxes[now.b.asset], {before.a.pose, before.b.pose},
               {now.a.pose, now.b.pose}, tolerance))
    return true;
  args.kept_rows[i] = row;
  args.posed[i] = before;
  return false;
}

/// moved: of all pairs.
__device__ void write_report(const MovedArgs& args, std::uint32_t moved) {
  MovedState& state = *args.state;
  const bool complete = is_complete(args);
  const std::uint32_t pairs = *args.pairs.count, kept = complete ? pairs - moved : 0;
  // More than the list has room for, so that a question about it is not complete either.
  state.moved = complete ? moved : pairs > args.capacity ? pairs : args.capacity + 1;
  GpuMovedReport report = {};
  report.status = pairs > args.pairs.capacity ? Status::kOutOfRange : Status::kOk;
  report.complete = complete ? 1 : 0;
  report.needed.pairs = pairs;
  if (complete) {
    report.counters = {pairs, kept};
    state.call = {state.next_call++, state.call_before, kept};
    state.last_pairs = pairs;
    state.has_last = 1;
  }
  state.report = report;
  *args.host_report = report;
}

__device__ void decide_tile(const MovedArgs& args, std::uint32_t tile, std::uint32_t pairs) {
  using Scan = cub::BlockScan<std::uint32_t, kThreads>;
  __shared__ typename Scan::TempStorage scratch;
  __shared__ std::uint32_t before;
  const std::uint32_t first = tile * kMovedTile + threadIdx.x * kPairsPerThread;
  std::uint32_t has_moved = 0, sum = 0, own = 0;
  for (std::uint32_t k = 0; k < kPairsPerThread; ++k) {
    if (first + k < pairs && decide(args, first + k)) has_moved |= 1u << k, ++sum;
  }
  Scan(scratch).ExclusiveSum(sum, sum, own);
  if (threadIdx.x == 0) {
    volatile std::uint64_t* const word = &args.tile_sums[tile];
    *word = (tile == 0 ? kSumUpToHere : kOwnSum) | own;
    before = static_cast<std::uint32_t>(sum_before(args.tile_sums, tile));
    *word = kSumUpToHere | (before + own);
  }
  __syncthreads();
  sum += before;
  for (std::uint32_t k = 0; k < kPairsPerThread && first + k <= pairs; ++k) {
    const std::uint32_t i = first + k;
    if (i == pairs) {
      write_report(args, sum);
      break;
    }
    if ((has_moved >> k & 1u) == 0) continue;
    args.moved[sum] = args.pairs.pairs[i];
    args.row_of_moved[sum] = i;
    args.moved_rows[i] = sum++;
  }
  __syncthreads();
}

__global__ void __launch_bounds__(kThreads) decide_all(const __grid_constant__ MovedArgs args) {
  __shared__ std::uint32_t taken;
  wait_for_kernel_before();
  const std::uint32_t pairs = is_complete(args) ? *args.pairs.count : 0;
  for (;;) {
    if (threadIdx.x == 0) taken = atomicAdd(&args.state->tiles_taken, 1u);
    __syncthreads();
    const std::uint32_t tile = taken;
    __syncthreads();
    if (tile > pairs / kMovedTile) return;
    decide_tile(args, tile, pairs);
  }
}

__global__ void forget(MovedState* state) {
  state->has_last = 0;
  state->pairs_before = 0;
  state->call_before = 0;
}

}  // namespace

cudaError_t remember_poses(const MovedArgs& args, cudaStream_t stream) {
  // This runs after whatever kernel of the user's, and so after all of it.
  remember<<<args.limits.processors * 2, kThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

cudaError_t find_moved(const MovedArgs& args, cudaStream_t stream) {
  const Grid grid = {args.limits.processors * 2, kThreads, 0, stream, args.limits.early_launch};
  return launch_after(grid, decide_all, args);
}

cudaError_t forget_poses(MovedState* state, cudaStream_t stream) {
  forget<<<1, 1, 0, stream>>>(state);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
