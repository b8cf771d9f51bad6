#include "kernels/distance/distance_data.h"

// These kernels decide what the walk leaves, by float64 on the posed vertices, and exactly where that is not
// enough; then they make the report. They are compiled without fused operations: posed points are those of
// the CPU.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 64, kBlocksPerProcessor = 8;

__device__ std::uint32_t thread_number() {
  return blockIdx.x * kThreads + threadIdx.x;
}
__device__ std::uint32_t thread_count() {
  return gridDim.x * kThreads;
}

/// Adds up over the lanes that are here together.
__device__ void count(Counter& counter, bool counts) {
  if (!counts) return;
  const std::uint32_t lanes = __activemask();
  if ((lanes & lanes_below()) == 0) atomicAdd(&counter, static_cast<Counter>(__popc(lanes)));
}

__device__ void write(const TriangleDistance& found, std::uint32_t a, std::uint32_t b, ObjectDistance& out) {
  out.lower = found.interval.lower;
  out.upper = found.interval.upper;
  for (int k = 0; k < 3; ++k) {
    out.point_a[k] = found.point_a[k];
    out.point_b[k] = found.point_b[k];
  }
  out.triangle_a = a;
  out.triangle_b = b;
}

/// The triangles of a pair that are settled first, kNoTriangles where all are beyond reach.
__device__ Counter first_of(const NearState& state, double beyond) {
  if (state.first != kNoTriangles) return state.first;
  return as_double(state.upper) < beyond || beyond == INFINITY ? state.seed : kNoTriangles;
}

/// Settles the first triangles of each pair.
template <int kWords>
__global__ void __launch_bounds__(kThreads) settle_first(const __grid_constant__ DistanceArgs args) {
  wait_for_kernel_before();
  const std::uint32_t pairs = pair_count(args);
  for (std::uint32_t i = thread_number(); i < pairs; i += thread_count()) {
    NearState& state = args.near_states[i];
    const Counter first = state.first = first_of(state, beyond_reach(args, i));
    if (first == kNoTriangles) continue;
    const auto a = static_cast<std::uint32_t>(first >> 32), b = static_cast<std::uint32_t>(first);
    const TriangleDistance found = settle<kWords>(args, posed_pair(args, i, a, b));
    count(args.state->settled, true);
    write(found, a, b, args.distances[i]);
    state.best = state.first_upper = as_bits(found.interval.upper);
    lessen(state.upper, found.interval.upper);
    lessen(state.floor, found.interval.lower);
  }
}

/// Returns whether triangles that float32 leaves are to be settled too: not those that are as far along the
/// direction of the first. Most share their nearest edge or corner with these, and so all but the distance.
__device__ bool is_left(const DistanceArgs& args, const TrianglePairEntry& entry, const FrameBounds& bounds) {
  NearState& state = args.near_states[entry.pair];
  if (state.best == 0 || triangles_as_number(entry.a, entry.b) == state.first) return false;
  const double beyond = beyond_reach(args, entry.pair), upper = upper_in(state, beyond),
               near = nearness(args, upper, beyond);
  double lower = static_cast<double>(bounds.lower) * args.records[entry.pair].least_in_world;
  if (lower < near && state.first != kNoTriangles) {
    const ObjectDistance& first = args.distances[entry.pair];
    lower = distance::distance_along_points(posed_pair(args, entry.pair, entry.a, entry.b), first.point_a,
                                            first.point_b);
  }
  if (lower < near) return true;
  if (lower < upper) lessen(state.floor, lower);
  return false;
}

__global__ void __launch_bounds__(kThreads) pass_over(const __grid_constant__ DistanceArgs args) {
  wait_for_kernel_before();
  const std::uint32_t count = stored_in(args.near);
  for (std::uint32_t begin = thread_number() - lane_id(); begin < count; begin += thread_count()) {
    const std::uint32_t i = begin + lane_id();
    AppendBatch<TrianglePairEntry, 1> left;
    if (i < count && is_left(args, args.near.entries[i], args.bounds[i])) left.put(0, args.near.entries[i]);
    left.append_to(args.rest);
  }
}

template <int kWords>
__global__ void __launch_bounds__(kThreads) settle_rest(const __grid_constant__ DistanceArgs args) {
  wait_for_kernel_before();
  const std::uint32_t rest = stored_in(args.rest);
  for (std::uint32_t i = thread_number(); i < rest; i += thread_count()) {
    const TrianglePairEntry entry = args.rest.entries[i];
    const TriangleDistance found = settle<kWords>(args, posed_pair(args, entry.pair, entry.a, entry.b));
    args.rest_distances[i] = found;
    lessen(args.near_states[entry.pair].best, found.interval.upper);
    lessen(args.near_states[entry.pair].floor, found.interval.lower);
  }
}

__global__ void __launch_bounds__(kThreads) choose_best(const __grid_constant__ DistanceArgs args) {
  wait_for_kernel_before();
  const std::uint32_t rest = stored_in(args.rest);
  for (std::uint32_t i = thread_number(); i < rest; i += thread_count()) {
    const TrianglePairEntry entry = args.rest.entries[i];
    NearState& state = args.near_states[entry.pair];
    if (as_bits(args.rest_distances[i].interval.upper) == state.best)
      atomicMin(&state.best_of_rest, triangles_as_number(entry.a, entry.b));
  }
}

/// Returns whether the first triangles of a pair are its nearest.
__device__ bool is_first_best(const DistanceArgs& args, std::uint32_t pair) {
  const NearState& state = args.near_states[pair];
  if (state.first == kNoTriangles || state.best_of_rest == kNoTriangles)
    return state.best_of_rest == kNoTriangles;
  return state.first_upper == state.best && state.first < state.best_of_rest;
}

/// The row of a pair, where its nearest triangles were written. What did not count is not nearer than the
/// upper bound, or is beyond reach.
__device__ void finish_row(const DistanceArgs& args, std::uint32_t pair, bool found) {
  const NearState& state = args.near_states[pair];
  ObjectDistance& out = args.distances[pair];
  const double beyond = beyond_reach(args, pair),
               upper = fmin(upper_in(state, beyond), as_double(state.best));
  out.lower = fmin(as_double(state.floor), upper);
  if (!found || out.lower >= beyond) {
    out = {out.lower, INFINITY, {}, {}, kNoIndex, kNoIndex, kNoIndex, kNoIndex};
    return;
  }
  if (upper < beyond) out.upper = fmin(out.upper, upper);
  const PairRecord& record = args.records[pair].pair;
  out.face_a = record.triangles_a[out.triangle_a].source_face();
  out.face_b = record.triangles_b[out.triangle_b].source_face();
  count(args.state->touching, out.upper == 0);
}

/// Returns what other blocks made of a counter.
__device__ Counter now(const Counter& counter) {
  return *static_cast<const volatile Counter*>(&counter);
}

__device__ std::uint32_t as_capacity(Counter counted) {
  return static_cast<std::uint32_t>(counted < kNoIndex ? counted : kNoIndex);
}

__device__ Counter shuffled(Counter x, int bit) {
  return __shfl_xor_sync(kAllLanes, x, bit);
}

/// Writes the report; a warp calls it.
__device__ void write_report(const DistanceArgs& args) {
  const DistanceState& state = *args.state;
  GpuDistanceReport report = {};
  Counter widest = 0, block_pairs = 0, rounds = 0;
  for (std::uint32_t i = lane_id(); i < args.rounds; i += 32) {
    widest = max(widest, max(state.narrow_rounds[i], state.rounds[i]));
    block_pairs += state.rounds[i];
    rounds += (state.narrow_rounds[i] != 0) + (state.rounds[i] != 0);
  }
  for (int bit = 1; bit < 32; bit <<= 1) {
    widest = max(widest, shuffled(widest, bit));
    block_pairs += shuffled(block_pairs, bit);
    rounds += shuffled(rounds, bit);
  }
  if (lane_id() != 0) return;
  report.rounds = static_cast<std::uint32_t>(rounds);
  const std::uint32_t pairs = *args.given.count;
  report.needed = {pairs, as_capacity(widest), as_capacity(max(state.seeds, state.near)),
                   as_capacity(state.rest), max(state.words, kFewWords)};
  const GpuDistanceCapacity &needed = report.needed, &room = args.capacity;
  report.complete = pairs <= args.given.capacity && pairs <= room.pairs &&
                    needed.block_pairs <= room.block_pairs && needed.triangle_pairs <= room.triangle_pairs &&
                    needed.settled <= room.settled && needed.words <= room.words;
  report.world_pairs = state.world_pairs;
  DistanceCounters& counters = report.counters;
  counters.object_pairs = pair_count(args);
  counters.block_pairs = state.narrow_block_pairs + block_pairs;
  counters.by_float32 = state.seeds + state.near;
  counters.by_float64 = state.settled + state.rest;
  counters.touching = now(state.touching);
  if (state.error != 0) {
    report = {};
    report.status = status_in(state.error);
    report.where = where_in(state.error);
  }
  args.state->report = report;
  *args.host_report = report;
}

/// Returns whether the block comes here last, all others being done.
__device__ bool ends_last(const DistanceArgs& args) {
  __shared__ bool last;
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) last = atomicAdd(&args.state->finished_blocks, 1u) == gridDim.x - 1;
  __syncthreads();
  return last;
}

__global__ void __launch_bounds__(kThreads) finish(const __grid_constant__ DistanceArgs args) {
  wait_for_kernel_before();
  const std::uint32_t pairs = pair_count(args), rest = stored_in(args.rest);
  for (std::uint32_t i = thread_number(); i < pairs; i += thread_count()) {
    if (is_first_best(args, i)) finish_row(args, i, args.near_states[i].first != kNoTriangles);
  }
  for (std::uint32_t i = thread_number(); i < rest; i += thread_count()) {
    const TrianglePairEntry entry = args.rest.entries[i];
    const NearState& state = args.near_states[entry.pair];
    if (triangles_as_number(entry.a, entry.b) != state.best_of_rest || is_first_best(args, entry.pair))
      continue;
    write(args.rest_distances[i], entry.a, entry.b, args.distances[entry.pair]);
    finish_row(args, entry.pair, true);
  }
  if (ends_last(args) && threadIdx.x < 32) write_report(args);
}

template <int kWords>
cudaError_t settle_by(const Grid& grid, const DistanceArgs& args) {
  cudaError_t error = launch_after(grid, settle_first<kWords>, args);
  if (error == cudaSuccess) error = launch_after(grid, pass_over, args);
  if (error == cudaSuccess) error = launch_after(grid, settle_rest<kWords>, args);
  if (error == cudaSuccess) error = launch_after(grid, choose_best, args);
  return error == cudaSuccess ? launch_after(grid, finish, args) : error;
}

}  // namespace

cudaError_t settle_distances(const DistanceArgs& args, cudaStream_t stream) {
  const Grid grid = {args.limits.processors * kBlocksPerProcessor, kThreads, 0, stream,
                     args.limits.early_launch};
  return args.capacity.words <= kFewWords ? settle_by<static_cast<int>(kFewWords)>(grid, args)
                                          : settle_by<detail::kMaxWords>(grid, args);
}

}  // namespace tandem::gpu
