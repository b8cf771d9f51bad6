#include <type_traits>

#include "kernels/manifold/manifold_data.h"
#include "kernels/manifold/manifold_maker.h"
#include "kernels/manifold/manifold_team.cuh"
#include "kernels/manifold/region_finder.h"

// These kernels go from contacts to patches, step by step. They are compiled without fused operations: the
// arithmetic is that of the CPU, bit by bit.
namespace tandem::gpu {
namespace {

using manifold::BodyPair;
using manifold::DepthSearch;
using manifold::ManifoldMaker;
using manifold::Patch;
using manifold::PatchState;
using manifold::PieceMemory;
using manifold::PieceSummary;

// The threads of a block; of one that finds curves. They are a team for a pair with many contacts or a curve
// of many pieces, and later on each of its warps is one for those of few.
constexpr std::uint32_t kThreads = 128, kWarps = kThreads / 32, kFinders = 512, kFindingWarps = kFinders / 32;
using LargeTeam = BlockTeam<kThreads>;
using FindingTeam = BlockTeam<kFinders, true>;
using PatchTeam = BlockTeam<kThreads, true>;

// Pieces of a curve that a warp takes on. Where there are enough curves for all warps of a GPU, warps do more
// of them at a time; else blocks are sooner done.
__device__ std::uint32_t most_of_warp(const GpuGroupCounts& counts) {
  constexpr std::uint32_t kManyPairs = 8192;
  return counts.few + counts.many > kManyPairs ? 512 : 128;
}

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

/// Adds what a warp's lanes know of pieces, if anything, to what is known of their pairs. Lanes of the same
/// pair are neighbours, and the first of them adds.
__device__ void add_bounds(const ManifoldArgs& args, std::uint32_t pair, bool known,
                           const manifold::PieceBounds& own) {
  double outermost[6];
  for (int k = 0; k < 3; ++k) outermost[k] = own.upper[k], outermost[3 + k] = -own.lower[k];
  std::uint32_t segments = own.segments, flags = (known ? 1u : 0u) | (own.degenerate ? 2u : 0u);
  for (std::uint32_t distance = 1; distance < 32; distance *= 2) {
    const std::uint32_t pair_there = __shfl_down_sync(0xFFFFFFFFu, pair, distance);
    const bool same = threadIdx.x % 32 + distance < 32 && pair_there == pair;
    for (double& own_one : outermost) {
      const double there = __shfl_down_sync(0xFFFFFFFFu, own_one, distance);
      if (same && there > own_one) own_one = there;
    }
    const std::uint32_t segments_there = __shfl_down_sync(0xFFFFFFFFu, segments, distance),
                        flags_there = __shfl_down_sync(0xFFFFFFFFu, flags, distance);
    if (same) segments += segments_there, flags |= flags_there;
  }
  const std::uint32_t pair_before = __shfl_up_sync(0xFFFFFFFFu, pair, 1);
  if (flags == 0 || (threadIdx.x % 32 != 0 && pair_before == pair)) return;
  PairPieces& all = args.of_pair[pair].pieces;
  for (int k = 0; k < 6; ++k) atomicMax(&all.outermost[k], in_order(outermost[k]));
  if (segments != 0) atomicAdd(&all.segments, segments);
  if ((flags & 2u) != 0) atomicOr(&all.degenerate, 1u);
}

__device__ manifold::PieceBounds bounds_of(const PairPieces& pieces) {
  manifold::PieceBounds out;
  out.pieces = pieces.pieces;
  out.segments = pieces.segments;
  out.degenerate = pieces.degenerate != 0;
  for (int k = 0; k < 3; ++k) {
    out.upper[k] = from_order<double>(pieces.outermost[k]);
    out.lower[k] = -from_order<double>(pieces.outermost[3 + k]);
  }
  return out;
}

/// Writes down what each contact's triangles have in common, among the pieces of the contact's pair.
__global__ void __launch_bounds__(kThreads, 3) make_pieces(const __grid_constant__ ManifoldArgs args) {
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const std::uint64_t count = args.query->contacts, step = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * kThreads; first < count; first += step) {
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
    manifold::PieceBounds own;
    if (wanted) own.add(meeting);
    add_bounds(args, contact.pair, wanted, own);
    const std::uint32_t same = __match_any_sync(0xFFFFFFFFu, wanted ? contact.pair : kNoIndex);
    // The first lane of those with the same pair takes room for all of them. All lanes shuffle, those
    // without a piece too, so that one mask serves all sets of lanes.
    const int leader = __ffs(static_cast<int>(same)) - 1;
    std::uint32_t place = 0;
    if (wanted && threadIdx.x % 32 == static_cast<std::uint32_t>(leader))
      place = atomicAdd(&args.of_pair[contact.pair].pieces.pieces, static_cast<std::uint32_t>(__popc(same)));
    place = __shfl_sync(0xFFFFFFFFu, place, leader) + __popc(same & ((1u << threadIdx.x % 32) - 1));
    if (!wanted) continue;
    write_piece(memory_of(args, contact.pair), place, contact, a.normal, b.normal, meeting);
  }
}

// Shared memory for keys and sets of the pieces of a pair, if they fit; a warp has its part of it. With what
// else a block shares it stays below the 48 KiB that need no leave.
constexpr std::uint32_t kNearPieces = 1920, kNearWords = 4 * kNearPieces;
constexpr std::size_t kNearBytes = (kNearWords + kNearPieces) * sizeof(std::uint32_t);

/// Finds the curves of each pair.
__global__ void __launch_bounds__(kFinders, 2) find_curves(const __grid_constant__ ManifoldArgs args) {
  extern __shared__ std::uint32_t near[];
  __shared__ Raw<BodyPair> shared_bodies[kFindingWarps];
  __shared__ std::uint32_t next[kFindingWarps];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const GpuContactGroups& groups = args.groups;
  ManifoldState& state = *args.state;
  const auto of = [&](const FindingTeam& team, std::uint32_t row, std::uint32_t own) {
    const std::uint32_t parts = team.is_block() ? 1 : kFindingWarps;
    const std::uint32_t pair = team.is_block() ? groups.many[row] : groups.few[row],
                        count = args.of_pair[pair].pieces.pieces;
    if (count == 0) return;
    if (count > manifold::kMostContactsOfPair) {
      if (team.rank() == 0) state.too_many_contacts = 1;
      return;
    }
    BodyPair& bodies = shared_bodies[own].get();
    if (team.rank() == 0) bodies = bodies_of(args, args.pairs.pairs[pair]);
    PieceMemory pieces = memory_of(args, pair);
    pieces.near_table = near + own * (kNearWords / parts), pieces.near_words = kNearWords / parts;
    if (count <= kNearPieces / parts) pieces.curve = near + kNearWords + own * (kNearPieces / parts);
    team.sync();
    manifold::CurveFinder<FindingTeam> finder(team, bodies, pieces);
    const PieceSummary summary = finder.find_among(bounds_of(args.of_pair[pair].pieces), next[own]);
    if (team.rank() == 0) {
      args.summaries[pair] = summary;
      if (summary.segments > 0) atomicAdd(&state.segments, Counter{summary.segments});
    }
    if (!manifold::RegionFinder<FindingTeam>::may_join(summary)) return;
    if (team.rank() == 0) next[own] = atomicAdd(&state.several_curves, summary.curves);
    team.sync();
    const std::uint32_t first = next[own];
    for (std::uint32_t c = team.rank(); c < summary.curves; c += team.size())
      args.curves[first + c] = {pair, c};
    team.sync();
  };
  share_out<kFinders>(groups.counts->many, state.next_many, groups.counts->few, state.next_few, of);
}

/// Finds what is known of each curve before it is joined with others, by a block.
__global__ void __launch_bounds__(kThreads, 6) begin_to_join(const __grid_constant__ ManifoldArgs args) {
  __shared__ BlockScratch<kThreads> scratch;
  __shared__ Raw<BodyPair> bodies;
  __shared__ std::uint32_t taken;
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const LargeTeam team(&scratch, nullptr);
  take_rows(team, args.state->several_curves, args.state->next_to_join, taken, [&](std::uint32_t row) {
    const PairCurve curve = args.curves[row];
    if (team.rank() == 0) bodies.get() = bodies_of(args, args.pairs.pairs[curve.pair]);
    team.sync();
    manifold::RegionFinder<LargeTeam>(team, bodies.get(), memory_of(args, curve.pair),
                                      args.summaries[curve.pair], nullptr)
        .begin(curve.curve);
  });
}

/// Returns whether warps go in step: if there is much to do for all of them, they wait for code more often
/// than for each other.
__device__ bool go_in_step(std::uint32_t rows) {
  return rows > 4 * gridDim.x * kWarps;
}

/// Tries to join each curve of pairs of several with its neighbours, by a warp each.
__global__ void __launch_bounds__(kThreads, 4) try_to_join(const __grid_constant__ ManifoldArgs args) {
  __shared__ WarpWalks walks[kWarps];
  __shared__ Raw<BodyPair> shared_bodies[kWarps];
  __shared__ Raw<PieceSummary> summaries[kWarps];
  __shared__ Raw<manifold::RegionMemory> regions[kWarps];
  __shared__ std::uint32_t taken[kWarps];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  constexpr std::uint32_t kNeighbours = manifold::RegionFinder<WarpTeam>::kNeighbours;
  const std::uint32_t own = threadIdx.x / 32, count = args.state->several_curves * kNeighbours;
  const WarpTeam team(&walks[own], go_in_step(count));
  take_rows(team, count, args.state->next_neighbour, taken[own], [&](std::uint32_t row) {
    const PairCurve curve = args.curves[row / kNeighbours];
    BodyPair& bodies = shared_bodies[own].get();
    PieceSummary& summary = summaries[own].get();
    if (team.rank() == 0) {
      bodies = bodies_of(args, args.pairs.pairs[curve.pair]);
      summary = args.summaries[curve.pair];
    }
    team.sync();
    const PieceMemory pieces = memory_of(args, curve.pair);
    manifold::RegionFinder<WarpTeam>(team, bodies, pieces, summary, &regions[own].get())
        .try_to_join(curve.curve, static_cast<int>(row % kNeighbours));
  });
}

/// Joins the curves of each pair that bound one region of the overlap, by a warp, and lists the regions.
__global__ void __launch_bounds__(kThreads, 4) join_regions(const __grid_constant__ ManifoldArgs args) {
  __shared__ Raw<BodyPair> shared_bodies[kWarps];
  __shared__ Raw<PieceSummary> summaries[kWarps];
  __shared__ Raw<manifold::RegionMemory> regions[kWarps];
  __shared__ std::uint32_t taken[kWarps];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const GpuGroupCounts& counts = *args.groups.counts;
  ManifoldState& state = *args.state;
  const std::uint32_t own = threadIdx.x / 32;
  const WarpTeam team(nullptr);
  take_rows(team, counts.many + counts.few, state.next_joined, taken[own], [&](std::uint32_t row) {
    const std::uint32_t pair = row < counts.many ? args.groups.many[row] : args.groups.few[row - counts.many];
    const std::uint32_t count = args.of_pair[pair].pieces.pieces;
    if (count == 0 || count > manifold::kMostContactsOfPair) return;
    BodyPair& bodies = shared_bodies[own].get();
    PieceSummary& summary = summaries[own].get();
    if (team.rank() == 0) bodies = bodies_of(args, args.pairs.pairs[pair]), summary = args.summaries[pair];
    team.sync();
    const PieceMemory pieces = memory_of(args, pair);
    std::uint32_t found = summary.curves;
    using Finder = manifold::RegionFinder<WarpTeam>;
    if (Finder::may_join(summary)) found = Finder(team, bodies, pieces, summary, &regions[own].get()).join();
    if (team.rank() == 0) args.summaries[pair].curves = found;
    for (std::uint32_t region = team.rank(); region < found; region += team.size()) {
      const bool many = pieces.start[region + 1] - pieces.start[region] > most_of_warp(counts);
      const std::uint32_t place = atomicAdd(many ? &state.curves_of_many : &state.curves_of_few, 1u);
      args.curves[many ? place : args.capacity.contacts - 1 - place] = {pair, region};
    }
  });
}

// The memory that a team shares while it makes a patch.
struct MakerMemory {
  Raw<BodyPair> bodies;
  Raw<PieceSummary> summary;
  Raw<PatchState> state;
};

/// Calls of(maker, state) with a maker for a curve.
template <typename AnyTeam, typename Of>
__device__ void with_maker(const ManifoldArgs& args, const AnyTeam& team, MakerMemory& shared,
                           const PairCurve& of_curve, const Of& of) {
  if (team.rank() == 0) shared.bodies.get() = bodies_of(args, args.pairs.pairs[of_curve.pair]);
  if (team.rank() == team.size() - 1) shared.summary.get() = args.summaries[of_curve.pair];
  team.sync();
  ManifoldMaker<AnyTeam> maker(team, shared.bodies.get(), memory_of(args, of_curve.pair),
                               shared.summary.get(), shared.state.get());
  of(maker, shared.state.get());
}

template <typename AnyTeam>
__device__ void copy_state(const AnyTeam& team, const PatchState& from, PatchState& to) {
  static_assert(sizeof(PatchState) % 8 == 0);
  for (std::uint32_t i = team.rank(); i < sizeof(PatchState) / 8; i += team.size())
    reinterpret_cast<Counter*>(&to)[i] = reinterpret_cast<const Counter*>(&from)[i];
  team.sync();
}

/// Where a patch is measured lies where its manifold comes to lie.
__device__ DepthSearch& depth_search(const ManifoldArgs& args, std::uint32_t place) {
  static_assert(sizeof(DepthSearch) <= sizeof(Patch) && alignof(DepthSearch) <= alignof(Patch));
  return *reinterpret_cast<DepthSearch*>(&args.patches[place]);
}

/// The lines along the directions of a deep patch lie where its state comes to lie.
__device__ manifold::DeepLines& deep_lines(BegunPatch& begun) {
  static_assert(sizeof(manifold::DeepLines) <= sizeof(PatchState) &&
                alignof(manifold::DeepLines) <= alignof(PatchState));
  return *reinterpret_cast<manifold::DeepLines*>(&begun.state);
}

__device__ std::uint32_t patches_begun(const ManifoldArgs& args) {
  const std::uint32_t wanted = patches_wanted(*args.state);
  return wanted < args.capacity.manifolds ? wanted : args.capacity.manifolds;
}

/// Calls of(team, place, curve, warp) for the place of each patch: those of curves of many pieces come first,
/// and are a block's.
template <typename Of>
__device__ void for_each_patch(const ManifoldArgs& args, std::uint32_t& next_many, std::uint32_t& next_few,
                               const Of& of) {
  const ManifoldState& state = *args.state;
  const auto of_row = [&](const PatchTeam& team, std::uint32_t row, std::uint32_t own) {
    const bool many = team.is_block();
    const std::uint32_t place = many ? row : state.curves_of_many + row;
    if (place < args.capacity.manifolds)
      of(team, place, args.curves[many ? row : args.capacity.contacts - 1 - row], own);
  };
  share_out<kThreads>(state.curves_of_many, next_many, state.curves_of_few, next_few, of_row);
}

/// Begins the patch of each curve.
__global__ void __launch_bounds__(kThreads, 4) begin_patches(const __grid_constant__ ManifoldArgs args) {
  __shared__ MakerMemory memory[kWarps];
  __shared__ Raw<manifold::OutlineMemory> outline[kWarps];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  ManifoldState& state = *args.state;
  if (blockIdx.x == 0 && threadIdx.x == 0 && patches_wanted(state) > patches_begun(args))
    state.needed_points = Counter{patches_wanted(state) - patches_begun(args)} * args.options.most_points;
  for_each_patch(args, state.next_curve_of_many, state.next_curve_of_few,
                 [&](const auto& team, std::uint32_t place, const PairCurve& curve, std::uint32_t own) {
                   with_maker(args, team, memory[own], curve, [&](auto& maker, const PatchState& made) {
                     maker.begin(curve.curve, outline[own].get(), depth_search(args, place));
                     const bool is_deep = made.kind == manifold::PatchKind::deep;
                     if (team.rank() == 0) {
                       args.begun[place].of = curve, args.begun[place].is_deep = is_deep;
                       if (is_deep) args.next_of_pair[atomicAdd(&state.deep_patches, 1u)] = place;
                     }
                     copy_state(team, made, args.begun[place].state);
                   });
                 });
}

/// Finds the rim of each patch that has a normal, and places from which to look for its depth.
__global__ void __launch_bounds__(kThreads, 4) outline_patches(const __grid_constant__ ManifoldArgs args) {
  __shared__ MakerMemory memory[kWarps];
  __shared__ Raw<manifold::OutlineMemory> outline[kWarps];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  for_each_patch(args, args.state->next_outline_of_many, args.state->next_outline_of_few,
                 [&](const auto& team, std::uint32_t place, const PairCurve& curve, std::uint32_t own) {
                   with_maker(args, team, memory[own], curve, [&](auto& maker, PatchState& state) {
                     copy_state(team, args.begun[place].state, state);
                     maker.outline(curve.curve, outline[own].get(), depth_search(args, place));
                     copy_state(team, state, args.begun[place].state);
                   });
                 });
}

/// Sounds the rim of each patch, and finds points of the overlap, by a warp.
__global__ void __launch_bounds__(kThreads, 4) sound_patches(const __grid_constant__ ManifoldArgs args) {
  __shared__ WarpWalks walks[kWarps];
  __shared__ MakerMemory memory[kWarps];
  __shared__ Raw<manifold::SearchMemory> searches[kWarps];
  __shared__ std::uint32_t taken[kWarps];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const std::uint32_t own = threadIdx.x / 32;
  const WarpTeam team(&walks[own]);
  take_rows(team, patches_begun(args), args.state->next_sounded, taken[own], [&](std::uint32_t row) {
    BegunPatch& begun = args.begun[row];
    if (!begun.is_deep && begun.state.kind != manifold::PatchKind::overlap) return;
    with_maker(args, team, memory[own], begun.of, [&](auto& maker, PatchState& state) {
      copy_state(team, begun.state, state);
      maker.sound(depth_search(args, row), searches[own].get());
      if (!begun.is_deep) copy_state(team, state, begun.state);
    });
  });
}

/// Finds the deepest line of each patch, along each direction if it is deep, by a warp.
__global__ void __launch_bounds__(kThreads, 3) measure_depths(const __grid_constant__ ManifoldArgs args) {
  __shared__ WarpWalks walks[kWarps];
  __shared__ MakerMemory memory[kWarps];
  __shared__ Raw<manifold::SearchMemory> searches[kWarps];
  __shared__ std::uint32_t taken[kWarps];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  constexpr std::uint32_t kDirections = 2 * manifold::kMostTried;
  const std::uint32_t own = threadIdx.x / 32, directions = args.state->deep_patches * kDirections;
  const WarpTeam team(&walks[own], go_in_step(directions + patches_begun(args)));
  const auto measure = [&](std::uint32_t row) {
    // Deep patches come first: they take longest.
    const bool is_deep = row < directions;
    const std::uint32_t place = is_deep ? args.next_of_pair[row / kDirections] : row - directions;
    const int direction = static_cast<int>(is_deep ? row % kDirections : 0);
    BegunPatch& begun = args.begun[place];
    DepthSearch& search = depth_search(args, place);
    if (begun.is_deep != is_deep || (!is_deep && begun.state.kind != manifold::PatchKind::overlap) ||
        direction >= search.directions)
      return;
    with_maker(args, team, memory[own], begun.of, [&](auto& maker, PatchState& state) {
      const manifold::OverlapLine line =
          maker.line_along(search, direction, args.options, searches[own].get());
      if (!is_deep) {
        copy_state(team, begun.state, state);
        maker.end_overlap(line, searches[own].get().lines);
        return copy_state(team, state, begun.state);
      }
      if (team.rank() != 0) return;
      deep_lines(begun).along[direction] = line;
      // Numbers above 0 are in the order of their bits.
      atomicMin(reinterpret_cast<Counter*>(&search.enough),
                static_cast<Counter>(__double_as_longlong(manifold::enough_for_others(line))));
    });
  };
  take_rows(team, directions + patches_begun(args), args.state->next_measured, taken[own], measure);
}

/// Finds the normals, rims and depths of deep patches, by a block each.
__global__ void __launch_bounds__(kThreads, 4) end_deep_patches(const __grid_constant__ ManifoldArgs args) {
  __shared__ BlockScratch<kThreads> scratch;
  __shared__ WarpWalks walks[kWarps];
  __shared__ MakerMemory memory;
  __shared__ Raw<manifold::OutlineMemory> outline;
  __shared__ Raw<manifold::LineMemory> lines;
  __shared__ std::uint32_t taken;
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const LargeTeam team(&scratch, walks);
  take_rows(team, args.state->deep_patches, args.state->next_ended, taken, [&](std::uint32_t row) {
    const std::uint32_t place = args.next_of_pair[row];
    BegunPatch& begun = args.begun[place];
    with_maker(args, team, memory, begun.of, [&](auto& maker, PatchState& made) {
      maker.end_deep(begun.of.curve, depth_search(args, place), deep_lines(begun), outline.get(),
                     lines.get());
      copy_state(team, made, begun.state);
    });
  });
}

/// Finishes each patch, by a warp.
__global__ void __launch_bounds__(kThreads, 6) finish_patches(const __grid_constant__ ManifoldArgs args) {
  __shared__ MakerMemory memory[kWarps];
  __shared__ Raw<manifold::ChoiceMemory> choice[kWarps];
  __shared__ std::uint32_t taken[kWarps];
  wait_for_kernel_before();
  if (!has_query(args)) return;
  const WarpTeam team(nullptr);
  const std::uint32_t own = threadIdx.x / 32;
  take_rows(team, patches_begun(args), args.state->next_finished, taken[own], [&](std::uint32_t row) {
    const BegunPatch& begun = args.begun[row];
    with_maker(args, team, memory[own], begun.of, [&](auto& maker, PatchState& state) {
      copy_state(team, begun.state, state);
      Patch* patch = nullptr;
      maker.finish(begun.of.curve, args.options, choice[own].get(),
                   [&] { return patch = &args.patches[row]; });
      if (patch == nullptr) return;
      PairPatches& pair = args.of_pair[begun.of.pair];
      args.next_of_pair[row] = atomicExch(&pair.first, row);
      atomicAdd(&pair.patches, 1u);
      atomicAdd(&pair.points, patch->manifold.point_count);
      atomicAdd(&args.state->needed_points, Counter{patch->manifold.point_count});
      if ((patch->manifold.flags & kOpenCurve) != 0) atomicAdd(&args.state->open_curves, Counter{1});
      if ((patch->manifold.flags & kAmbiguous) != 0) atomicAdd(&args.state->ambiguous_touches, Counter{1});
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
  for (std::uint32_t i = first; i < pairs; i += step) args.of_pair[i] = {kNoIndex, 0, 0, 0, 0, 0, {}};
  for (std::uint32_t i = first; i < args.capacity.pairs / kManifoldTile + 1; i += step) args.tile_sums[i] = 0;
  if (args.match_previous && state.has_last != 0) {
    const std::uint32_t table_step = step_after(state.step);
    // The sizes are in words, so that the copies are even.
    constexpr std::uint32_t kManifoldWords = sizeof(Manifold) / 8, kPointWords = sizeof(ManifoldPoint) / 8;
    const auto copy = [&](const void* from, void* to, std::uint64_t words) {
      for (std::uint64_t i = first; i < words; i += step)
        static_cast<Counter*>(to)[i] = static_cast<const Counter*>(from)[i];
    };
    copy(args.manifolds, args.manifolds_before, std::uint64_t{state.last_manifolds} * kManifoldWords);
    copy(args.points, args.points_before, std::uint64_t{state.last_points} * kPointWords);
    for (std::uint32_t i = first; state.last_matches != 0 && i < state.last_manifolds; i += step) {
      const PairEntry entry = args.entries[i];
      if (entry.points != 0) enter(args.table, args.table_size, table_step, entry);
    }
  }
  // The last block of all sees to the numbers that the others have read.
  __syncthreads();
  if (threadIdx.x != 0) return;
  __threadfence();
  if (atomicAdd(&state.finished_blocks, 1u) + 1 != gridDim.x) return;
  state.next_many = state.next_few = state.tiles_taken = 0;
  state.curves_of_many = state.curves_of_few = state.next_curve_of_many = state.next_curve_of_few = 0;
  state.several_curves = state.next_to_join = state.next_neighbour = state.next_joined = 0;
  state.deep_patches = state.next_ended = 0;
  state.next_outline_of_many = state.next_outline_of_few = 0;
  state.next_sounded = state.next_measured = state.next_finished = 0;
  state.needed_points = state.segments = state.ambiguous_touches = state.open_curves = 0;
  state.too_many_contacts = state.finished_blocks = 0;
  if (!args.match_previous || state.has_last != 0)
    state.step = step_after(state.step);  // its table is empty as yet
  state.has_last = 0;
}

}  // namespace

cudaError_t remember_points(const ManifoldArgs& args, cudaStream_t stream) {
  // This runs after whatever kernel of the user's, and so after all of it.
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
  const auto grid = [&](unsigned blocks, unsigned threads, std::size_t shared_bytes) {
    return Grid{args.limits.processors * blocks, threads, shared_bytes, stream, args.limits.early_launch};
  };
  cudaError_t error = launch_after(grid(3, kThreads, 0), make_pieces, args);
  if (error == cudaSuccess) error = launch_after(grid(2, kFinders, kNearBytes), find_curves, args);
  if (error == cudaSuccess) error = launch_after(grid(6, kThreads, 0), begin_to_join, args);
  if (error == cudaSuccess) error = launch_after(grid(4, kThreads, 0), try_to_join, args);
  if (error == cudaSuccess) error = launch_after(grid(4, kThreads, 0), join_regions, args);
  if (error == cudaSuccess) error = launch_after(grid(4, kThreads, 0), begin_patches, args);
  if (error == cudaSuccess) error = launch_after(grid(4, kThreads, 0), outline_patches, args);
  if (error == cudaSuccess) error = launch_after(grid(4, kThreads, 0), sound_patches, args);
  if (error == cudaSuccess) error = launch_after(grid(3, kThreads, 0), measure_depths, args);
  if (error == cudaSuccess) error = launch_after(grid(3, kThreads, 0), end_deep_patches, args);
  return error == cudaSuccess ? launch_after(grid(6, kThreads, 0), finish_patches, args) : error;
}

}  // namespace tandem::gpu
