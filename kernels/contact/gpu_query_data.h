#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/launch.h"
#include "kernels/common/pair_record.h"
#include "kernels/contact/candidate.h"
#include "kernels/contact/neighbours.h"
#include "kernels/contact/walk_shape.h"
#include "kernels/geometry/clearance.h"
#include "kernels/geometry/level_error.h"

// The kernels of a query share this data, all of it in GPU memory.
namespace tandem::gpu {

/// The bits that the walk's stack has for the number of a block; all of them set is no block's.
inline constexpr std::uint32_t kNumberBits = 29;

/// Two leaves whose boxes overlap, of an object pair.
struct Candidate {
  std::uint32_t pair, a, b;
};

/// Entries of the stack, see walk_stack.cuh, that one warp gives to another: two words of 64 bits each. There
/// is one for each mailbox.
struct alignas(16) Chunk {
  Counter entry[32][2];
};

/// The state of work sharing, see work_sharing.h, and the first object pair that no warp took.
struct alignas(128) Balance {
  Counter counts;
  Counter beside_counts;  ///< never written: warps look at 16 bytes at once
  std::uint32_t next_pair;
  alignas(128) std::uint32_t mailbox[kMostMailboxes];
};

/// Zero when a query begins: cleared by the one before it, but for what comes from the report on.
struct QueryState {
  alignas(128) Counter error;  ///< complement of (what, where, status), 0 where there is none: the first wins
  std::uint32_t world_pairs, finished_blocks;
  Balance frame, world;
  alignas(128) Counter contacts;
  alignas(128) Counter undecided;
  alignas(128) Counter decided_exactly;
  alignas(128) Counter block_pairs;
  Counter candidates, decided_by_float64;
  GpuContactReport report;
  GpuGroupCounts groups;      // written where contacts are grouped
  std::uint32_t tiles_taken;  // by the sum over pairs; cleared by the query itself
};

/// Pairs whose contacts are added up at once, by a thread block.
inline constexpr std::uint32_t kPairsPerTile = 2048;

/// Tiles of pairs, and of the place behind the last.
TANDEM_HD constexpr std::uint32_t tiles_of(std::uint32_t pairs) {
  return pairs / kPairsPerTile + 1;
}

/// If there are few pairs, the counts of their contacts lie apart, a cache line each: atomic operations on
/// one line wait for each other.
inline constexpr std::uint32_t kMostSpreadPairs = 4096, kSpread = 32;
TANDEM_HD constexpr std::uint32_t spread_of(std::uint32_t pairs) {
  return pairs <= kMostSpreadPairs ? kSpread : 1;
}

/// The arrays that grouping contacts by pair takes; null where it is not asked for.
struct Grouping {
  std::uint32_t* next;  ///< of each pair, spread_of() apart: its number of contacts, then the next place
  std::uint32_t* first_contact;
  std::uint32_t *few, *many;  ///< pairs with contacts
  Counter *tile_contacts, *tile_pairs;
  Contact* contacts;  ///< where grouped contacts go; null: they stay where they are
};

/// Room for one exact decision of clearance at a time, of coordinates of any size: more than CUDA should
/// reserve for each thread that a GPU can hold. lock: 0 where it is free.
struct WideRoom {
  std::uint32_t lock;
  exact::ClearanceDecision<detail::kMaxWords> decision;
};
inline constexpr std::uint32_t kWideRooms = 64;
static_assert(kWideRooms * sizeof(WideRoom) <= kMostWideBytes);

/// The arguments of all kernels of a query.
struct QueryArgs {
  const GpuAsset* assets;
  std::uint32_t asset_count;
  GpuInstances instances;
  GpuPairs given;
  QueryMode mode;
  bool first_contact_only, walk_only;
  GpuContactCapacity capacity;
  QueryState* state;
  GpuContactReport* host_report;  ///< in CPU memory
  Chunk* chunks;
  PairRecord* pairs;
  std::uint32_t* world_pairs;  ///< pairs that are not in_frame
  std::uint32_t* met;          ///< of a pair: not 0 once it has a contact; where only the first is asked for
  Contact* contacts;
  Grouping grouping;
  Candidate* undecided;
  DeviceLimits limits;
  WalkShape shape;
  double within;                         ///< 0: contacts
  bool adds_errors;                      ///< of levels, see clearance_of()
  bool near;                             ///< a query of clearance: one of these is not 0
  distance::FrameClearance* clearances;  ///< of each pair that is in_frame; of clearance, as the next
  WideRoom* wide_rooms;
  Neighbourhood* neighbourhoods;  ///< of the assets; null: no neighbours are left out
};

/// The room that sorting takes besides args.contacts, which it reads: each array is of as many contacts.
struct SortingRoom {
  Contact* out;          ///< kContactsForKeys more
  std::uint32_t* order;  ///< twice as many
  void* scratch;
  std::size_t scratch_bytes;
  std::uint32_t most_triangles;  ///< of an asset
  std::uint64_t most_faces;
};

/// Sorting keeps two rows of 64-bit keys where its result is to come, each row aligned.
inline constexpr std::size_t kContactsForKeys = 32;

/// Returns more room for candidates than a query needed, because what it looks at before it finds a pair's
/// first contact differs from run to run.
constexpr std::uint64_t with_spare(std::uint64_t undecided) {
  return undecided + undecided / 2 + 1024;
}

/// Returns which blocks a query of this mode walks.
TANDEM_HD constexpr BlockKind walked_kind(QueryMode mode) {
  return mode == QueryMode::exact ? BlockKind::oriented : BlockKind::axis_aligned;
}

/// Checks instances and pairs and makes the records.
cudaError_t prepare_pairs(const QueryArgs& args, cudaStream_t stream);

/// Walks the pairs that are in_frame.
cudaError_t walk_exact(const QueryArgs& args, cudaStream_t stream);
cudaError_t walk_unfused(const QueryArgs& args, cudaStream_t stream);

/// Decides what the walk left, walks the other pairs, and writes the report.
cudaError_t decide_rest(const QueryArgs& args, cudaStream_t stream);

/// Groups the contacts that the report counts by pair.
cudaError_t group_contacts(const QueryArgs& args, cudaStream_t stream);

/// Bytes of scratch memory for so many contacts.
cudaError_t sorting_bytes(std::uint64_t contacts, std::size_t& bytes);

/// Sorts the contacts that the report counts into room.out.
cudaError_t sort_contacts(const QueryArgs& args, const SortingRoom& room, cudaStream_t stream);

#ifdef __CUDACC__

__device__ inline bool failed(const QueryArgs& args) {
  return *static_cast<volatile Counter*>(&args.state->error) != 0;
}

/// Returns how near triangles of two instances have to be in a query of clearance. In files that are compiled
/// without fused operations, so that it has the CPU's bits.
__device__ inline double clearance_of(const QueryArgs& args, std::uint32_t a, std::uint32_t b) {
  if (!args.adds_errors || a == b) return args.within;
  const auto error = [&](std::uint32_t instance) {
    const GpuAsset& asset = args.assets[args.instances.asset[instance]];
    return posed_level_error(asset.tree, asset.lower, asset.upper, stored_pose(args, instance));
  };
  return clearance_of_levels(args.within, error(a), error(b));
}

/// Returns whether the contact counts: where only the first is asked for, the first of its pair.
__device__ inline bool is_wanted(const QueryArgs& args, std::uint32_t pair) {
  if (!args.first_contact_only) return true;
  // Looked at before it is written: many contacts of few pairs would queue up at them.
  return *static_cast<volatile std::uint32_t*>(&args.met[pair]) == 0 && atomicExch(&args.met[pair], 1u) == 0;
}

#endif

}  // namespace tandem::gpu
