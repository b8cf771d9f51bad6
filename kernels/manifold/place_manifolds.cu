#include <cub/block/block_scan.cuh>

#include "kernels/manifold/manifold_data.h"
#include "kernels/manifold/manifold_team.cuh"

// These kernels place manifolds and points by ascending pair, and within a pair by their least pieces. They
// are compiled without fused operations, as those that make them.
namespace tandem::gpu {
namespace {

using manifold::Patch;

constexpr std::uint32_t kThreads = 256;
constexpr std::uint32_t kPairsPerThread = kManifoldTile / kThreads;

// A tile's word: two bits say what the others are, 31 bits are a number of manifolds, 31 of points. A sum of
// them has no carry between them, as capacities are less than 2^31.
constexpr Counter kOwnSum = Counter{1} << 62, kSumUpToHere = Counter{2} << 62, kSumBits = kOwnSum - 1;
constexpr int kManifoldShift = 31;

/// Returns the row of a pair among those that were asked about, or kNoIndex if it is kept.
__device__ std::uint32_t asked_row(const ManifoldArgs& args, std::uint32_t pair) {
  if (args.moved.call == nullptr) return pair;
  return args.moved.kept_rows[pair] == kNoIndex ? args.moved.moved_rows[pair] : kNoIndex;
}

/// Returns how many manifolds and points a pair has; their places are not known yet.
__device__ PairPlace size_of(const ManifoldArgs& args, std::uint32_t pair) {
  const std::uint32_t asked = asked_row(args, pair);
  if (asked == kNoIndex) return args.places_before[args.moved.kept_rows[pair]];
  const PairPatches& made = args.of_pair[asked];
  return {0, made.patches, 0, made.points};
}

/// The sum of all tiles before this one (Merrill and Garland 2016). One thread calls it, because tiles are
/// few.
__device__ Counter sum_before(const Counter* words, std::uint32_t tile) {
  Counter sum = 0;
  while (tile-- > 0) {
    Counter word = 0;
    while ((word = *static_cast<const volatile Counter*>(&words[tile])) < kOwnSum) {
    }
    sum += word & kSumBits;
    if (word >= kSumUpToHere) break;
  }
  return sum;
}

__device__ void write_report(const ManifoldArgs& args, std::uint32_t manifolds, std::uint32_t points) {
  ManifoldState& state = *args.state;
  const bool complete = is_complete(args);
  GpuManifoldReport report = {};
  const bool keeps = args.moved.call != nullptr;
  const Counter needed_points = state.needed_points + (keeps ? state.kept_points : 0);
  report.status = args.query->status != Status::kOk ? args.query->status
                  : state.too_many_contacts != 0    ? Status::kOutOfRange
                  : !knows_kept(args)               ? Status::kKeptMismatch
                                                    : Status::kOk;
  report.complete = complete ? 1 : 0;
  report.needed.pairs = keeps ? *args.moved.pairs.count : *args.pairs.count;
  report.needed.contacts = args.query->complete != 0 ? args.query->contacts : args.query->needed.contacts;
  report.needed.manifolds =
      static_cast<std::uint32_t>(patches_wanted(state) + (keeps ? state.kept_manifolds : 0));
  report.needed.points =
      needed_points < 0x7FFFFFFFull ? static_cast<std::uint32_t>(needed_points) : 0x7FFFFFFFu;
  if (complete) {
    report.manifolds = manifolds;
    report.points = points;
    report.counters = {args.query->contacts, state.segments,         manifolds, points,
                       state.open_curves,    state.ambiguous_touches};
  }
  state.report = report;
  *args.host_report = report;
  // Manifolds that did not fit are not remembered; those that were remembered before stay.
  state.last_manifolds = report.manifolds;
  state.last_points = report.points;
  state.last_pairs = complete ? pair_count(args) : 0;
  state.moved_call = keeps ? args.moved.call->call : 0;
  state.has_last = complete && args.match_previous ? 1 : 0;
  state.last_matches = args.matches ? 1 : 0;
}

__device__ void place_tile(const ManifoldArgs& args, std::uint32_t tile, std::uint32_t pairs) {
  using Scan = cub::BlockScan<Counter, kThreads>;
  __shared__ typename Scan::TempStorage scratch;
  __shared__ Counter before;
  const std::uint32_t first = tile * kManifoldTile + threadIdx.x * kPairsPerThread;
  Counter sum = 0, own = 0;
  for (std::uint32_t i = first; i < first + kPairsPerThread && i < pairs; ++i) {
    const PairPlace size = size_of(args, i);
    sum += Counter{size.manifolds} << kManifoldShift | size.points;
  }
  Scan(scratch).ExclusiveSum(sum, sum, own);
  if (threadIdx.x == 0) {
    volatile Counter* const word = &args.tile_sums[tile];
    *word = (tile == 0 ? kSumUpToHere : kOwnSum) | own;
    before = sum_before(args.tile_sums, tile);
    *word = kSumUpToHere | (before + own);
  }
  __syncthreads();
  sum += before;
  for (std::uint32_t i = first; i < first + kPairsPerThread && i <= pairs; ++i) {
    const auto manifolds = static_cast<std::uint32_t>(sum >> kManifoldShift),
               points = static_cast<std::uint32_t>(sum & 0x7FFFFFFFu);
    if (i == pairs) {
      write_report(args, manifolds, points);
      break;
    }
    const PairPlace size = size_of(args, i);
    const std::uint32_t asked = asked_row(args, i);
    args.places[i] = {manifolds, size.manifolds, points, size.points};
    if (asked != kNoIndex)
      args.of_pair[asked].first_manifold = manifolds, args.of_pair[asked].first_point = points;
    sum += Counter{size.manifolds} << kManifoldShift | size.points;
  }
  __syncthreads();
}

__global__ void __launch_bounds__(kThreads) place(const __grid_constant__ ManifoldArgs args) {
  __shared__ std::uint32_t taken;
  wait_for_kernel_before();
  const std::uint32_t pairs = is_complete(args) ? pair_count(args) : 0;
  for (;;) {
    if (threadIdx.x == 0) taken = atomicAdd(&args.state->tiles_taken, 1u);
    __syncthreads();
    const std::uint32_t tile = taken;
    __syncthreads();
    if (tile > pairs / kManifoldTile) return;
    place_tile(args, tile, pairs);
  }
}

/// Sorts the numbers of a pair's patches by their keys into `sorted`, by counting those before each.
__device__ void sort_patches(const ManifoldArgs& args, const PairPatches& pair, std::uint32_t* list,
                             std::uint32_t* sorted) {
  const WarpTeam team(nullptr);
  if (team.rank() == 0) {
    std::uint32_t at = 0;
    for (std::uint32_t p = pair.first; p != kNoIndex; p = args.next_of_pair[p]) list[at++] = p;
  }
  team.sync();
  for (std::uint32_t i = team.rank(); i < pair.patches; i += team.size()) {
    const std::uint64_t key = args.patches[list[i]].key;
    std::uint32_t before = 0;
    for (std::uint32_t k = 0; k < pair.patches; ++k) before += args.patches[list[k]].key < key ? 1 : 0;
    sorted[before] = list[i];
  }
  team.sync();
}

/// row: of the pairs that were asked about.
__device__ void write_pair(const ManifoldArgs& args, std::uint32_t row) {
  const WarpTeam team(nullptr);
  const PairPatches pair = args.of_pair[row];
  if (pair.patches == 0) return;
  const std::uint32_t first_contact = args.groups.first_contact[row];
  // A pair has no more patches than contacts, whose pieces are used no more.
  std::uint32_t *list = args.pieces.curve + first_contact, *sorted = args.pieces.order + first_contact;
  sort_patches(args, pair, list, sorted);
  const auto patch = [&](std::uint32_t i) -> Patch& { return args.patches[sorted[i]]; };
  const ObjectPair bodies = args.pairs.pairs[row];
  const bool keeps = args.moved.call != nullptr;
  const std::uint64_t both = std::uint64_t{bodies.a} << 32 | bodies.b;
  std::uint32_t next_manifold = pair.first_manifold, next_point = pair.first_point;
  for (std::uint32_t i = 0; i < pair.patches; ++i) {
    const Patch& from = patch(i);
    const std::uint32_t points = from.manifold.point_count;
    if (team.rank() == 0) {
      Manifold out = from.manifold;
      out.pair = keeps ? args.moved.row_of_moved[row] : row;
      out.first_point = next_point;
      args.manifolds[next_manifold] = out;
      if (keeps) args.found_manifolds[next_manifold] = manifold::found(out);
      args.entries[next_manifold] = {both, pair.first_point,
                                     next_manifold == pair.first_manifold ? pair.points : 0};
    }
    for (std::uint32_t k = team.rank(); k < points; k += team.size()) {
      ManifoldPoint point = from.point[k];
      point.id = manifold::feature_hash(both, point.id);
      point.manifold = next_manifold;
      args.points[next_point + k] = point;
      if (keeps) args.found_points[next_point + k] = manifold::found(point);
    }
    ++next_manifold;
    next_point += points;
  }
  team.sync();
  if (!args.matches) return;
  auto slot = static_cast<std::uint32_t>((manifold::mixed(both) >> 32) * args.table_size >> 32);
  const std::uint32_t step = args.state->step;
  while (args.table[slot].step == step) {
    const TableEntry& entry = args.table[slot];
    if (entry.bodies == both) {
      const manifold::Shape &a = args.shapes[args.instances.asset[bodies.a]],
                            &b = args.shapes[args.instances.asset[bodies.b]];
      const manifold::PointMatcher<WarpTeam> matcher(team, a.diagonal < b.diagonal ? a.diagonal : b.diagonal);
      matcher.match(args.points, pair.first_point, pair.points,
                    {args.points_before, entry.first_point, entry.points});
      return;
    }
    if (++slot == args.table_size) slot = 0;
  }
}

__global__ void __launch_bounds__(128) write(const __grid_constant__ ManifoldArgs args) {
  wait_for_kernel_before();
  if (!is_complete(args)) return;
  const GpuGroupCounts& counts = *args.groups.counts;
  const std::uint32_t warps = gridDim.x * (128 / 32), first = (blockIdx.x * 128 + threadIdx.x) / 32;
  for (std::uint32_t i = first; i < counts.many + counts.few; i += warps) {
    write_pair(args, i < counts.many ? args.groups.many[i] : args.groups.few[i - counts.many]);
  }
}

}  // namespace

cudaError_t place_manifolds(const ManifoldArgs& args, cudaStream_t stream) {
  const Grid of_place = {args.limits.processors, kThreads, 0, stream, args.limits.early_launch},
             of_write = {args.limits.processors * 8, 128, 0, stream, args.limits.early_launch};
  const cudaError_t error = launch_after(of_place, place, args);
  return error == cudaSuccess ? launch_after(of_write, write, args) : error;
}

}  // namespace tandem::gpu
