#include "manifold_data.h"
#include "manifold_team.cuh"
#include "tandem/kernels/detail/manifold/manifold_maker.h"

// From contacts to patches. A thread block makes the patches of a pair with many contacts, a warp those of
// one with few. Compiled without fused operations: the arithmetic is that of the CPU, bit by bit.
namespace tandem::gpu {
namespace {

using manifold::BodyPair;
using manifold::ManifoldMaker;
using manifold::Patch;
using manifold::PatchMemory;
using manifold::PieceMemory;

constexpr std::uint32_t kThreads = 128, kWarps = kThreads / 32;

// Contacts of a pair, and pieces of a curve, that a warp takes on; a block those that have more. Where there
// are enough pairs for all warps of a GPU, warps do more of them at a time; else blocks are sooner done.
__device__ std::uint32_t most_of_warp(const GpuGroupCounts& counts) {
  constexpr std::uint32_t kManyPairs = 8192;
  return counts.few + counts.many > kManyPairs ? 768 : kFewContacts;
}

// Pieces are numbered in 28 bits, and table entries in 32.
constexpr std::uint32_t kMostContactsOfPair = std::uint32_t{1} << 27;

__device__ bool has_query(const ManifoldArgs& args) {
  return args.query->status == Status::kOk && args.query->complete != 0 &&
         args.query->contacts <= args.capacity.contacts && *args.pairs.count <= args.capacity.pairs;
}

__device__ BodyPair bodies_of(const ManifoldArgs& args, const ObjectPair& pair) {
  return {{args.shapes[args.instances.asset[pair.a]], args.instances.pose[pair.a]},
          {args.shapes[args.instances.asset[pair.b]], args.instances.pose[pair.b]}};
}

__device__ PieceMemory memory_of(const ManifoldArgs& args, std::uint32_t pair) {
  const std::size_t first = args.groups.first_contact[pair];
  return {args.pieces.pieces + first,       args.pieces.normals + 6 * first,
          args.pieces.curve + first,        args.pieces.order + first,
          args.pieces.start + first + pair, args.pieces.table + PieceMemory::kTableWords * first};
}

template <typename Team>
__device__ void find_curves_of(const ManifoldArgs& args, const Team& team, std::uint32_t& next,
                               std::uint32_t pair) {
  const std::uint32_t first = args.groups.first_contact[pair],
                      count = args.groups.first_contact[pair + 1] - first;
  const ObjectPair both = args.pairs.pairs[pair];
  if (both.a == both.b) return;
  if (count > kMostContactsOfPair) {
    if (team.rank() == 0) args.state->too_many_contacts = 1;
    return;
  }
  const BodyPair bodies = bodies_of(args, both);
  const PieceMemory memory = memory_of(args, pair);
  manifold::CurveFinder<Team> finder(team, bodies, memory);
  const manifold::PieceSummary summary = finder.find(args.groups.contacts + first, count, next);
  if (team.rank() == 0) {
    args.summaries[pair] = summary;
    if (summary.segments > 0) atomicAdd(&args.state->segments, Counter{summary.segments});
  }
  for (std::uint32_t curve = team.rank(); curve < summary.curves; curve += team.size()) {
    const bool many = memory.start[curve + 1] - memory.start[curve] > most_of_warp(*args.groups.counts);
    const std::uint32_t place =
        atomicAdd(many ? &args.state->curves_of_many : &args.state->curves_of_few, 1u);
    args.curves[many ? place : args.capacity.contacts - 1 - place] = {pair, curve};
  }
  team.sync();
}

/// Calls of(team, row, true) for rows below `many` with a block, and of(team, row, false) for rows below
/// `few` with a warp.
template <typename Of>
__device__ void share_out(std::uint32_t many, std::uint32_t few, std::uint32_t& next_many,
                          std::uint32_t& next_few, Counter* scratch, const Of& of) {
  __shared__ std::uint32_t taken;
  const BlockTeam<kThreads> block = {{}, scratch};
  for (;;) {
    if (threadIdx.x == 0) taken = atomicAdd(&next_many, 1u);
    __syncthreads();
    const std::uint32_t row = taken;
    __syncthreads();
    if (row >= many) break;
    of(block, row, true);
  }
  const WarpTeam warp;
  for (;;) {
    std::uint32_t row = 0;
    if (warp.rank() == 0) row = atomicAdd(&next_few, 1u);
    row = __shfl_sync(0xFFFFFFFFu, row, 0);
    if (row >= few) break;
    of(warp, row, false);
  }
}

__global__ void __launch_bounds__(kThreads, 4) find_curves(const __grid_constant__ ManifoldArgs args) {
  __shared__ Counter scratch[kWarps];
  __shared__ std::uint32_t next[kWarps];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const GpuGroupCounts& counts = *args.groups.counts;
  const std::uint32_t most = most_of_warp(counts);
  // Pairs that the query calls those with many contacts come up twice: for blocks, and for warps.
  share_out(counts.many, counts.many + counts.few, args.state->next_many, args.state->next_few, scratch,
            [&](const auto& team, std::uint32_t row, bool by_block) {
              const std::uint32_t pair =
                  row < counts.many ? args.groups.many[row] : args.groups.few[row - counts.many];
              const std::uint32_t contacts =
                  args.groups.first_contact[pair + 1] - args.groups.first_contact[pair];
              if (by_block != (contacts > most)) return;
              find_curves_of(args, team, next[by_block ? 0 : threadIdx.x / 32], pair);
            });
}

template <typename Team>
__device__ void make_patch_of(const ManifoldArgs& args, const Team& team, PatchMemory& shared,
                              const PairCurve& of) {
  const BodyPair bodies = bodies_of(args, args.pairs.pairs[of.pair]);
  const PieceMemory memory = memory_of(args, of.pair);
  ManifoldMaker<Team> maker(team, bodies, memory, shared, args.summaries[of.pair], args.most_points);
  Patch* made = nullptr;
  std::uint32_t place = kNoIndex;
  const auto new_patch = [&]() -> Patch* {
    place = atomicAdd(&args.state->next_patch, 1u);
    return made = place < args.capacity.manifolds ? &args.patches[place] : nullptr;
  };
  const bool known = maker.make(of.curve, new_patch);
  if (team.rank() == 0) {
    PairPatches& own = args.of_pair[of.pair];
    if (!known) atomicAdd(&args.state->ambiguous_touches, Counter{1});
    if (made != nullptr) {
      args.next_of_pair[place] = atomicExch(&own.first, place);
      atomicAdd(&own.patches, 1u);
      if (made->hole == 0) {
        atomicAdd(&own.manifolds, 1u);
        atomicAdd(&own.points, made->manifold.point_count);
        atomicAdd(&args.state->needed_points, Counter{made->manifold.point_count});
        if ((made->manifold.flags & kOpenCurve) != 0) atomicAdd(&args.state->open_curves, Counter{1});
      }
    } else if (place != kNoIndex) {
      atomicAdd(&args.state->needed_points, static_cast<Counter>(args.most_points));
    }
  }
  team.sync();
}

__global__ void __launch_bounds__(kThreads, 4) make(const __grid_constant__ ManifoldArgs args) {
  __shared__ alignas(16) unsigned char memory[kWarps * sizeof(PatchMemory)];  // begins without contents
  __shared__ Counter scratch[kWarps];
  PatchMemory* const shared = reinterpret_cast<PatchMemory*>(memory);
  wait_for_kernel_before();
  if (!has_query(args)) return;
  ManifoldState& state = *args.state;
  share_out(state.curves_of_many, state.curves_of_few, state.next_curve_of_many, state.next_curve_of_few,
            scratch, [&](const auto& team, std::uint32_t row, bool many) {
              make_patch_of(args, team, shared[many ? 0 : threadIdx.x / 32],
                            args.curves[many ? row : args.capacity.contacts - 1 - row]);
            });
}

/// Step 0 is that of a new table's entries.
__device__ std::uint32_t step_after(std::uint32_t step) {
  return step + 1 == 0 ? 1 : step + 1;
}

__device__ void enter(TableEntry* table, std::uint32_t size, std::uint32_t step, const PairEntry& entry) {
  auto slot = static_cast<std::uint32_t>((manifold::mixed(entry.bodies) >> 32) * size >> 32);
  for (;;) {
    const std::uint32_t there = *static_cast<volatile std::uint32_t*>(&table[slot].step);
    if (there != step && atomicCAS(&table[slot].step, there, step) == there) break;
    if (++slot == size) slot = 0;
  }
  TableEntry& out = table[slot];
  out.bodies = entry.bodies, out.first_point = entry.first_point, out.points = entry.points;
}

__global__ void __launch_bounds__(kThreads)
    move_table(const TableEntry* from, std::uint32_t from_size, TableEntry* to, std::uint32_t to_size,
               const ManifoldState* state) {
  const std::uint32_t step = state->step;
  for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < from_size; i += gridDim.x * kThreads) {
    if (from[i].step == step) enter(to, to_size, step, {from[i].bodies, from[i].first_point, from[i].points});
  }
}

__global__ void forget(ManifoldState* state) {
  state->has_last = 0;
  state->step = step_after(state->step);
}

/// Keeps the points of the last call, and where those of each pair are; clears what the call counts.
__global__ void __launch_bounds__(kThreads) remember(const __grid_constant__ ManifoldArgs args) {
  wait_for_kernel_before();
  ManifoldState& state = *args.state;
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  const std::uint32_t pairs =
      *args.pairs.count < args.capacity.pairs ? *args.pairs.count : args.capacity.pairs;
  for (std::uint32_t i = first; i < pairs; i += step) args.of_pair[i] = {kNoIndex, 0, 0, 0, 0, 0};
  for (std::uint32_t i = first; i < args.capacity.pairs / kManifoldTile + 1; i += step) args.tile_sums[i] = 0;
  if (args.match_previous && state.has_last != 0) {
    const std::uint32_t table_step = step_after(state.step);
    // As words, so that the copies are even.
    constexpr std::uint32_t kManifoldWords = sizeof(Manifold) / 8, kPointWords = sizeof(ManifoldPoint) / 8;
    const auto copy = [&](const void* from, void* to, std::uint64_t words) {
      for (std::uint64_t i = first; i < words; i += step)
        static_cast<Counter*>(to)[i] = static_cast<const Counter*>(from)[i];
    };
    copy(args.manifolds, args.manifolds_before, std::uint64_t{state.last_manifolds} * kManifoldWords);
    copy(args.points, args.points_before, std::uint64_t{state.last_points} * kPointWords);
    for (std::uint32_t i = first; i < state.last_manifolds; i += step) {
      const PairEntry entry = args.entries[i];
      if (entry.points != 0) enter(args.table, args.table_size, table_step, entry);
    }
  }
  // The last block of all sees to the numbers that the others have read.
  __syncthreads();
  if (threadIdx.x != 0) return;
  __threadfence();
  if (atomicAdd(&state.finished_blocks, 1u) + 1 != gridDim.x) return;
  state.next_many = state.next_few = state.next_patch = state.tiles_taken = 0;
  state.curves_of_many = state.curves_of_few = state.next_curve_of_many = state.next_curve_of_few = 0;
  state.needed_points = state.segments = state.ambiguous_touches = state.open_curves = 0;
  state.too_many_contacts = state.finished_blocks = 0;
  if (!args.match_previous || state.has_last != 0)
    state.step = step_after(state.step);  // its table is empty as yet
  state.has_last = 0;
}

}  // namespace

cudaError_t remember_points(const ManifoldArgs& args, cudaStream_t stream) {
  // After whatever kernel of the user's, and so after all of it.
  remember<<<args.limits.processors * 2, kThreads, 0, stream>>>(args);
  return cudaGetLastError();
}

cudaError_t move_entries(const TableEntry* from, std::uint32_t from_size, TableEntry* to,
                         std::uint32_t to_size, const ManifoldState* state) {
  constexpr std::uint32_t kBlocks = 256;
  move_table<<<kBlocks, kThreads>>>(from, from_size, to, to_size, state);
  return cudaGetLastError();
}

cudaError_t forget_last(ManifoldState* state, cudaStream_t stream) {
  forget<<<1, 1, 0, stream>>>(state);
  return cudaGetLastError();
}

cudaError_t make_patches(const ManifoldArgs& args, cudaStream_t stream) {
  constexpr std::uint32_t kBlocksPerProcessor = 4;
  const Grid grid = {args.limits.processors * kBlocksPerProcessor, kThreads, 0, stream,
                     args.limits.early_launch};
  const cudaError_t error = launch_after(grid, find_curves, args);
  return error == cudaSuccess ? launch_after(grid, make, args) : error;
}

}  // namespace tandem::gpu
