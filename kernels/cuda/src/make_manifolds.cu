#include <type_traits>

#include "manifold_data.h"
#include "manifold_team.cuh"
#include "tandem/kernels/detail/manifold/manifold_maker.h"

// From contacts to patches. A thread block makes the patches of a pair with many contacts, a warp those of
// one with few. Compiled without fused operations: the arithmetic is that of the CPU, bit by bit.
#ifndef TANDEM_MAKE_THREADS
#define TANDEM_MAKE_THREADS 768
#endif

namespace tandem::gpu {
namespace {

using manifold::BodyPair;
using manifold::ManifoldMaker;
using manifold::Patch;
using manifold::PatchMemory;
using manifold::PieceMemory;
using manifold::PieceSummary;

// A thread block is a team, of one warp or of several: pairs with many contacts, and curves of many pieces,
// are for large ones.
constexpr std::uint32_t kLarge = 128, kSmall = 32;

template <std::uint32_t kThreads>
using Team = std::conditional_t<kThreads == 32, WarpTeam, BlockTeam<kThreads>>;

// What the threads of a team share besides.
template <std::uint32_t kThreads>
struct TeamMemory {
  BlockScratch<kThreads> scratch;
  WarpWalks walks[kThreads / 32];
  std::uint32_t row, next;
};

template <std::uint32_t kThreads>
__device__ Team<kThreads> team_with(TeamMemory<kThreads>& memory) {
  if constexpr (kThreads == 32)
    return Team<kThreads>(memory.walks);
  else
    return Team<kThreads>(&memory.scratch, memory.walks);
}

/// Calls of(row) for rows below `rows` that no other team has taken.
template <typename AnyTeam, typename Of>
__device__ void take_rows(const AnyTeam& team, std::uint32_t rows, std::uint32_t& next, std::uint32_t& taken,
                          const Of& of) {
  for (;;) {
    if (team.rank() == 0) team.store(taken, atomicAdd(&next, 1u));
    team.sync();
    const std::uint32_t row = team.load(taken);
    if (row >= rows) return;
    of(row);
    team.sync();
  }
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

// Shared memory in which a team looks for the curves of a pair, if that has no more contacts than fit.
template <std::uint32_t kThreads>
struct NearMemory {
  static constexpr std::uint32_t kContacts = 8 * kThreads, kWords = 4 * kContacts;
  std::uint32_t table[kWords], curve[kContacts];
};

template <std::uint32_t kThreads>
__global__ void __launch_bounds__(kThreads, 1024 / kThreads)
    find_curves(const __grid_constant__ ManifoldArgs args) {
  __shared__ TeamMemory<kThreads> memory;
  __shared__ NearMemory<kThreads> near;
  __shared__ alignas(16) unsigned char shared_bodies[sizeof(BodyPair)];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const Team<kThreads> team = team_with(memory);
  const GpuContactGroups& groups = args.groups;
  ManifoldState& state = *args.state;
  constexpr bool kMany = kThreads == kLarge;
  const std::uint32_t* const rows = kMany ? groups.many : groups.few;
  take_rows(team, kMany ? groups.counts->many : groups.counts->few, kMany ? state.next_many : state.next_few,
            memory.row, [&](std::uint32_t row) {
              const std::uint32_t pair = rows[row], first = groups.first_contact[pair],
                                  count = groups.first_contact[pair + 1] - first;
              const ObjectPair both = args.pairs.pairs[pair];
              if (both.a == both.b) return;
              if (count > kMostContactsOfPair) {
                if (team.rank() == 0) state.too_many_contacts = 1;
                return;
              }
              BodyPair& bodies = *reinterpret_cast<BodyPair*>(shared_bodies);
              if (team.rank() == 0) bodies = bodies_of(args, both);
              PieceMemory pieces = memory_of(args, pair);
              pieces.near_table = near.table, pieces.near_words = near.kWords;
              if (count <= near.kContacts) pieces.curve = near.curve;
              team.sync();
              manifold::CurveFinder<Team<kThreads>> finder(team, bodies, pieces);
              const PieceSummary summary = finder.find(groups.contacts + first, count, memory.next);
              if (team.rank() == 0) {
                args.summaries[pair] = summary;
                if (summary.segments > 0) atomicAdd(&state.segments, Counter{summary.segments});
              }
              for (std::uint32_t curve = team.rank(); curve < summary.curves; curve += team.size()) {
                const bool many = pieces.start[curve + 1] - pieces.start[curve] > kFewContacts;
                const std::uint32_t place = atomicAdd(many ? &state.curves_of_many : &state.curves_of_few, 1u);
                args.curves[many ? place : args.capacity.contacts - 1 - place] = {pair, curve};
              }
            });
}

template <typename AnyTeam>
__device__ void make_patch_of(const ManifoldArgs& args, const AnyTeam& team, PatchMemory& shared,
                              const BodyPair& bodies, const PieceSummary& summary, const PairCurve& of) {
  const PieceMemory memory = memory_of(args, of.pair);
  ManifoldMaker<AnyTeam> maker(team, bodies, memory, shared, summary, args.most_points);
  Patch* made = nullptr;
  std::uint32_t place = kNoIndex;
  const auto new_patch = [&]() -> Patch* {
    place = atomicAdd(&args.state->next_patch, 1u);
    return made = place < args.capacity.manifolds ? &args.patches[place] : nullptr;
  };
  const bool known = maker.make(of.curve, new_patch);
  if (team.rank() != 0) return;
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

template <std::uint32_t kThreads>
__global__ void __launch_bounds__(kThreads, TANDEM_MAKE_THREADS / kThreads)
    make(const __grid_constant__ ManifoldArgs args) {
  __shared__ TeamMemory<kThreads> memory;
  // Begin without contents.
  __shared__ alignas(16) unsigned char of_patch[sizeof(PatchMemory)], of_bodies[sizeof(BodyPair)],
      of_summary[sizeof(PieceSummary)];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const Team<kThreads> team = team_with(memory);
  ManifoldState& state = *args.state;
  constexpr bool kMany = kThreads == kLarge;
  take_rows(team, kMany ? state.curves_of_many : state.curves_of_few,
            kMany ? state.next_curve_of_many : state.next_curve_of_few, memory.row, [&](std::uint32_t row) {
              const PairCurve of = args.curves[kMany ? row : args.capacity.contacts - 1 - row];
              BodyPair& bodies = *reinterpret_cast<BodyPair*>(of_bodies);
              PieceSummary& summary = *reinterpret_cast<PieceSummary*>(of_summary);
              if (team.rank() == 0) bodies = bodies_of(args, args.pairs.pairs[of.pair]);
              if (team.rank() == team.size() - 1) summary = args.summaries[of.pair];
              team.sync();
              make_patch_of(args, team, *reinterpret_cast<PatchMemory*>(of_patch), bodies, summary, of);
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

constexpr std::uint32_t kThreads = 128;

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
  const auto grid = [&](std::uint32_t threads) {
    return Grid{args.limits.processors * (1024 / threads), threads, 0, stream, args.limits.early_launch};
  };
  cudaError_t error = launch_after(grid(kLarge), find_curves<kLarge>, args);
  if (error == cudaSuccess) error = launch_after(grid(kSmall), find_curves<kSmall>, args);
  if (error == cudaSuccess) error = launch_after(grid(kLarge), make<kLarge>, args);
  return error == cudaSuccess ? launch_after(grid(kSmall), make<kSmall>, args) : error;
}

}  // namespace tandem::gpu
