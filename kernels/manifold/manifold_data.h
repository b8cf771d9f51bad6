#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/launch.h"
#include "kernels/manifold/contact_curves.h"
#include "kernels/manifold/finish.h"
#include "kernels/manifold/kept_manifold.h"
#include "kernels/manifold/patch.h"
#include "tandem/kernels/gpu_manifold_query.h"
#include "tandem/kernels/gpu_moved_query.h"

// The kernels that make manifolds share this data, all of it in GPU memory.
namespace tandem::gpu {

using Counter = unsigned long long;

/// A curve of a pair of bodies.
struct PairCurve {
  std::uint32_t pair, curve;
};

/// manifold::PieceBounds of a pair, to which lanes add by atomic operations: all zeros before.
struct PairPieces {
  std::uint32_t pieces, segments, degenerate;
  Counter outermost[6];  ///< in_order() of the upper bounds and of the negated lower ones
};

/// The patches of a pair: a list that next_of_pair leads along.
struct PairPatches {
  std::uint32_t first;  ///< kNoIndex where there is none
  std::uint32_t patches, points;
  std::uint32_t first_manifold, first_point;
  PairPieces pieces;
};

/// A patch between the kernels that make it.
struct BegunPatch {
  PairCurve of;
  bool is_deep;
  manifold::PatchState state;
};

/// The place of the manifolds and points of a pair.
struct PairPlace {
  std::uint32_t first_manifold, manifolds, first_point, points;
};

/// The place of the points of a pair of bodies.
struct PairEntry {
  std::uint64_t bodies;
  std::uint32_t first_point, points;
};

/// An entry of the table of the step before; of another step than `step` it is empty.
struct alignas(8) TableEntry {
  std::uint32_t step;
  std::uint32_t first_point;
  std::uint64_t bodies;
  std::uint32_t points, unused;
};

struct ManifoldState {
  // Cleared by each call.
  std::uint32_t next_many, next_few, tiles_taken;
  std::uint32_t curves_of_many, curves_of_few, next_curve_of_many, next_curve_of_few;
  std::uint32_t several_curves, next_to_join, next_neighbour, next_joined, deep_patches;
  std::uint32_t next_outline_of_many, next_outline_of_few, next_sounded, next_measured, next_ended,
      next_finished;
  Counter needed_points, segments, ambiguous_touches, open_curves;
  std::uint32_t too_many_contacts, finished_blocks;

  // Cleared by each call with pairs that are kept.
  Counter kept_manifolds, kept_points;

  // These are kept from call to call.
  std::uint64_t moved_call;   ///< of GpuMovedQuery, that what was found last is of, or 0
  std::uint64_t call_before;  ///< the same of what lies in the arrays `before`
  std::uint32_t last_pairs;
  std::uint32_t step;          ///< of the table
  std::uint32_t has_last;      ///< the last call made manifolds that the next one is to remember
  std::uint32_t last_matches;  ///< ManifoldArgs::matches of that call: else the next finds no points in it
  std::uint32_t last_manifolds, last_points;
  GpuManifoldReport report;
};

/// Pairs whose counts are added up at once, by a thread block.
inline constexpr std::uint32_t kManifoldTile = 1024;

struct ManifoldArgs {
  const manifold::Shape* shapes;
  GpuInstances instances;
  GpuPairs pairs;
  GpuContactGroups groups;
  const GpuContactReport* query;
  GpuManifoldCapacity capacity;
  GpuMoved moved;       ///< `pairs` are those that have moved; null: they are all
  bool match_previous;  ///< the call before is remembered
  bool matches;         ///< points are looked for in it
  manifold::PatchOptions options;

  ManifoldState* state;
  GpuManifoldReport* host_report;  ///< in CPU memory
  manifold::PieceMemory pieces;
  BegunPatch* begun;
  manifold::Patch* patches;     ///< at first the memory of deep ones
  std::uint32_t* next_of_pair;  ///< at first the deep patches; then of each patch the next of the same pair
  PairPatches* of_pair;
  manifold::PieceSummary* summaries;  ///< of each pair with contacts
  PairCurve* curves;  ///< at first those of pairs of several curves; then regions: those of many
                      ///< pieces from the beginning on, others from the end
  Counter* tile_sums;

  Manifold* manifolds;
  ManifoldPoint* points;
  PairEntry* entries;  ///< of each manifold: the first of a pair has the pair's points, others none

  PairPlace *places, *places_before;                                  ///< of all pairs
  manifold::FoundManifold *found_manifolds, *found_manifolds_before;  ///< of each manifold
  manifold::FoundPoint *found_points, *found_points_before;           ///< of each point

  Manifold* manifolds_before;
  ManifoldPoint* points_before;
  TableEntry* table;
  std::uint32_t table_size;

  DeviceLimits limits;
};

#ifdef __CUDACC__

/// Returns how many pairs there are, those that are kept too.
__device__ inline std::uint32_t pair_count(const ManifoldArgs& args) {
  const std::uint32_t count = args.moved.call != nullptr ? *args.moved.pairs.count : *args.pairs.count;
  return count < args.capacity.pairs ? count : args.capacity.pairs;
}

/// Returns whether all pairs had room.
__device__ inline bool has_pairs(const ManifoldArgs& args) {
  const std::uint32_t count = args.moved.call != nullptr ? *args.moved.pairs.count : *args.pairs.count;
  return count <= args.capacity.pairs && *args.pairs.count <= args.pairs.capacity;
}

/// Returns whether the call before returned what is to be kept.
__device__ inline bool knows_kept(const ManifoldArgs& args) {
  return args.moved.call == nullptr || args.moved.call->kept == 0 ||
         (args.moved.call->call_before != 0 && args.state->call_before == args.moved.call->call_before);
}

/// Returns whether some pairs may be kept.
__device__ inline bool keeps(const ManifoldArgs& args) {
  return args.moved.call != nullptr && has_pairs(args) && knows_kept(args) && args.moved.call->kept != 0;
}

/// Returns how many patches there are, with or without room.
__device__ inline std::uint32_t patches_wanted(const ManifoldState& state) {
  return state.curves_of_many + state.curves_of_few;
}

/// Returns whether all had room: the same for all threads of all kernels behind make_patches().
__device__ inline bool is_complete(const ManifoldArgs& args) {
  const ManifoldState& state = *args.state;
  const bool keeps = args.moved.call != nullptr;
  return args.query->status == Status::kOk && args.query->complete != 0 &&
         args.query->contacts <= args.capacity.contacts && has_pairs(args) && knows_kept(args) &&
         state.too_many_contacts == 0 &&
         patches_wanted(state) + (keeps ? state.kept_manifolds : 0) <= args.capacity.manifolds &&
         state.needed_points + (keeps ? state.kept_points : 0) <= args.capacity.points;
}

#endif

/// Moves the table of the step before to a larger one, on the default stream.
cudaError_t move_entries(const TableEntry* from, std::uint32_t from_size, TableEntry* to,
                         std::uint32_t to_size, const ManifoldState* state);

/// The next call finds nothing before it.
cudaError_t forget_last(ManifoldState* state, cudaStream_t stream);

/// Keeps what the last call found, to be moved; counts what is kept of it; moves it. They do nothing where
/// all pairs are asked about.
cudaError_t remember_kept(const ManifoldArgs& args, cudaStream_t stream);
cudaError_t count_kept_manifolds(const ManifoldArgs& args, cudaStream_t stream);
cudaError_t move_kept_manifolds(const ManifoldArgs& args, cudaStream_t stream);

/// Keeps the last call's points for matching.
cudaError_t remember_points(const ManifoldArgs& args, cudaStream_t stream);

/// Finds the curves of all pairs that have contacts, and makes their patches.
cudaError_t make_patches(const ManifoldArgs& args, cudaStream_t stream);

/// Gives them their places, writes manifolds and points, and the report.
cudaError_t place_manifolds(const ManifoldArgs& args, cudaStream_t stream);

}  // namespace tandem::gpu
