#include <type_traits>

#include "manifold_data.h"
#include "manifold_team.cuh"
#include "tandem/kernels/detail/manifold/manifold_maker.h"

// From contacts to patches, step by step. Compiled without fused operations: the arithmetic is that of the
// CPU, bit by bit.
namespace tandem::gpu {
namespace {

using manifold::BodyPair;
using manifold::ManifoldMaker;
using manifold::Patch;
using manifold::PatchMemory;
using manifold::PatchState;
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
  std::uint32_t row, next;
};

template <std::uint32_t kThreads>
__device__ Team<kThreads> team_with(TeamMemory<kThreads>& memory, WarpWalks* walks = nullptr) {
  if constexpr (kThreads == 32)
    return Team<kThreads>(walks);
  else
    return Team<kThreads>(&memory.scratch, walks);
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

/// Writes down what each contact's triangles have in common, among the pieces of the contact's pair.
__global__ void __launch_bounds__(kLarge) make_pieces(const __grid_constant__ ManifoldArgs args) {
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const std::uint64_t count = args.query->contacts, step = std::uint64_t{gridDim.x} * kLarge;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * kLarge; first < count; first += step) {
    const std::uint64_t i = first + threadIdx.x;
    manifold::Meeting meeting;
    manifold::WorldTriangle a, b;
    Contact contact;
    contact.pair = kNoIndex;
    if (i < count) {
      contact = args.groups.contacts[i];
      const ObjectPair both = args.pairs.pairs[contact.pair];
      if (both.a != both.b) {
        const BodyPair bodies = bodies_of(args, both);
        a = bodies.a.triangle(contact.triangle_a), b = bodies.b.triangle(contact.triangle_b);
        manifold::meet(a, b, bodies.tolerance(), meeting);
      }
    }
    const bool wanted = meeting.kind != manifold::MeetingKind::none;
    const std::uint32_t same = __match_any_sync(0xFFFFFFFFu, wanted ? contact.pair : kNoIndex);
    if (!wanted) continue;
    // The first lane of those with the same pair takes room for all of them.
    const int leader = __ffs(static_cast<int>(same)) - 1;
    std::uint32_t place = 0;
    if (threadIdx.x % 32 == static_cast<std::uint32_t>(leader))
      place = atomicAdd(&args.of_pair[contact.pair].pieces, static_cast<std::uint32_t>(__popc(same)));
    place = __shfl_sync(same, place, leader) + __popc(same & ((1u << threadIdx.x % 32) - 1));
    write_piece(memory_of(args, contact.pair), place, contact, a.normal, b.normal, meeting);
  }
}

// Shared memory in which a team looks for the curves of a pair, if that has no more pieces than fit.
template <std::uint32_t kThreads>
struct NearMemory {
  static constexpr std::uint32_t kPieces = 8 * kThreads, kWords = 4 * kPieces;
  std::uint32_t table[kWords], curve[kPieces];
};

template <std::uint32_t kThreads>
__global__ void __launch_bounds__(kThreads, 768 / kThreads)
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
              const std::uint32_t pair = rows[row], count = args.of_pair[pair].pieces;
              if (count == 0) return;
              if (count > kMostContactsOfPair) {
                if (team.rank() == 0) state.too_many_contacts = 1;
                return;
              }
              BodyPair& bodies = *reinterpret_cast<BodyPair*>(shared_bodies);
              if (team.rank() == 0) bodies = bodies_of(args, args.pairs.pairs[pair]);
              PieceMemory pieces = memory_of(args, pair);
              pieces.near_table = near.table, pieces.near_words = near.kWords;
              if (count <= near.kPieces) pieces.curve = near.curve;
              team.sync();
              manifold::CurveFinder<Team<kThreads>> finder(team, bodies, pieces);
              const PieceSummary summary = finder.find_among(count, memory.next);
              if (team.rank() == 0) {
                args.summaries[pair] = summary;
                if (summary.segments > 0) atomicAdd(&state.segments, Counter{summary.segments});
              }
              for (std::uint32_t curve = team.rank(); curve < summary.curves; curve += team.size()) {
                const bool many = pieces.start[curve + 1] - pieces.start[curve] > kFewContacts;
                const std::uint32_t place =
                    atomicAdd(many ? &state.curves_of_many : &state.curves_of_few, 1u);
                args.curves[many ? place : args.capacity.contacts - 1 - place] = {pair, curve};
              }
            });
}

// What a team that makes a patch shares, without contents at first.
struct MakerMemory {
  alignas(16) unsigned char patch[sizeof(PatchMemory)], bodies[sizeof(BodyPair)],
      summary[sizeof(PieceSummary)];
};

/// Calls of(maker, memory) with a maker for a curve.
template <typename AnyTeam, typename Of>
__device__ void with_maker(const ManifoldArgs& args, const AnyTeam& team, MakerMemory& shared,
                           const PairCurve& of_curve, const Of& of) {
  BodyPair& bodies = *reinterpret_cast<BodyPair*>(shared.bodies);
  PieceSummary& summary = *reinterpret_cast<PieceSummary*>(shared.summary);
  PatchMemory& memory = *reinterpret_cast<PatchMemory*>(shared.patch);
  if (team.rank() == 0) bodies = bodies_of(args, args.pairs.pairs[of_curve.pair]);
  if (team.rank() == team.size() - 1) summary = args.summaries[of_curve.pair];
  team.sync();
  ManifoldMaker<AnyTeam> maker(team, bodies, memory_of(args, of_curve.pair), memory, summary);
  of(maker, memory);
}

template <typename AnyTeam>
__device__ void copy_state(const AnyTeam& team, const PatchState& from, PatchState& to) {
  static_assert(sizeof(PatchState) % 8 == 0);
  for (std::uint32_t i = team.rank(); i < sizeof(PatchState) / 8; i += team.size())
    reinterpret_cast<Counter*>(&to)[i] = reinterpret_cast<const Counter*>(&from)[i];
  team.sync();
}

template <std::uint32_t kThreads>
__global__ void __launch_bounds__(kThreads, 512 / kThreads)
    begin_patches(const __grid_constant__ ManifoldArgs args) {
  __shared__ TeamMemory<kThreads> memory;
  __shared__ MakerMemory shared;
  __shared__ std::uint32_t place;
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const Team<kThreads> team = team_with(memory);
  ManifoldState& state = *args.state;
  constexpr bool kMany = kThreads == kLarge;
  take_rows(team, kMany ? state.curves_of_many : state.curves_of_few,
            kMany ? state.next_curve_of_many : state.next_curve_of_few, memory.row, [&](std::uint32_t row) {
              const PairCurve of = args.curves[kMany ? row : args.capacity.contacts - 1 - row];
              with_maker(args, team, shared, of, [&](auto& maker, const PatchMemory& made) {
                const bool known = maker.begin(of.curve);
                if (team.rank() == 0) {
                  place = known ? atomicAdd(&state.next_patch, 1u) : kNoIndex;
                  if (!known) atomicAdd(&state.ambiguous_touches, Counter{1});
                  if (known && place >= args.capacity.manifolds)
                    atomicAdd(&state.needed_points, static_cast<Counter>(args.most_points));
                }
                team.sync();
                if (place >= args.capacity.manifolds) return;
                if (team.rank() == 0) args.begun[place].of = of;
                copy_state(team, made.state, args.begun[place].state);
              });
            });
}

__device__ std::uint32_t patches_begun(const ManifoldArgs& args) {
  const std::uint32_t wanted = args.state->next_patch;
  return wanted < args.capacity.manifolds ? wanted : args.capacity.manifolds;
}

__global__ void __launch_bounds__(kLarge, 768 / kLarge)
    measure_depths(const __grid_constant__ ManifoldArgs args) {
  __shared__ TeamMemory<kLarge> memory;
  __shared__ WarpWalks walks[kLarge / 32];
  __shared__ MakerMemory shared;
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const Team<kLarge> team = team_with(memory, walks);
  take_rows(team, patches_begun(args), args.state->next_measured, memory.row, [&](std::uint32_t row) {
    BegunPatch& begun = args.begun[row];
    with_maker(args, team, shared, begun.of, [&](auto& maker, PatchMemory& made) {
      copy_state(team, begun.state, made.state);
      if (made.state.touch) return;
      maker.measure_depths(begun.of.curve);
      copy_state(team, made.state, begun.state);
    });
  });
}

__global__ void __launch_bounds__(kSmall, 768 / kSmall)
    finish_patches(const __grid_constant__ ManifoldArgs args) {
  __shared__ TeamMemory<kSmall> memory;
  __shared__ MakerMemory shared;
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const Team<kSmall> team = team_with(memory);
  take_rows(team, patches_begun(args), args.state->next_finished, memory.row, [&](std::uint32_t row) {
    const BegunPatch& begun = args.begun[row];
    with_maker(args, team, shared, begun.of, [&](auto& maker, PatchMemory& made) {
      copy_state(team, begun.state, made.state);
      Patch* patch = nullptr;
      maker.finish(begun.of.curve, args.most_points, [&] { return patch = &args.patches[row]; });
      if (patch == nullptr) return;
      PairPatches& own = args.of_pair[begun.of.pair];
      args.next_of_pair[row] = atomicExch(&own.first, row);
      atomicAdd(&own.patches, 1u);
      if (patch->hole != 0) return;
      atomicAdd(&own.manifolds, 1u);
      atomicAdd(&own.points, patch->manifold.point_count);
      atomicAdd(&args.state->needed_points, Counter{patch->manifold.point_count});
      if ((patch->manifold.flags & kOpenCurve) != 0) atomicAdd(&args.state->open_curves, Counter{1});
    });
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
  for (std::uint32_t i = first; i < pairs; i += step) args.of_pair[i] = {kNoIndex, 0, 0, 0, 0, 0, 0};
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
  state.next_measured = state.next_finished = 0;
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
    return Grid{args.limits.processors * (768 / threads), threads, 0, stream, args.limits.early_launch};
  };
  cudaError_t error = launch_after(grid(kLarge), make_pieces, args);
  if (error == cudaSuccess) error = launch_after(grid(kLarge), find_curves<kLarge>, args);
  if (error == cudaSuccess) error = launch_after(grid(kSmall), find_curves<kSmall>, args);
  if (error == cudaSuccess) error = launch_after(grid(kLarge), begin_patches<kLarge>, args);
  if (error == cudaSuccess) error = launch_after(grid(kSmall), begin_patches<kSmall>, args);
  if (error == cudaSuccess) error = launch_after(grid(kLarge), measure_depths, args);
  return error == cudaSuccess ? launch_after(grid(kSmall), finish_patches, args) : error;
}

}  // namespace tandem::gpu
