#pragma once
#include <cstddef>
#include <cstdint>

#include "kernels/common/block_pair.h"
#include "kernels/common/lane_variant.h"
#include "kernels/contact/neighbours.h"
#include "kernels/geometry/frame_distance.h"
#include "kernels/geometry/relative_pose.h"
#include "kernels/scene/scene_state.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/contact_query.h"

// The contacts of one object pair: traversal, then the cascade on its candidates.
namespace tandem {

/// An object pair, and what is asked about it.
struct PairTask {
  const PosedTree *a, *b;
  std::uint32_t pair = 0;
  QueryMode mode = QueryMode::exact;
  bool first_contact_only = false;
  bool self;             ///< a and b are one instance: every two triangles once, none with itself
  bool in_frame;         ///< float32 in a's frame can take the pair; else what follows has no meaning
  RelativePose b_in_a;   ///< with slack for what is within reach too
  float frame_error;     ///< see frame_test.h; with what is within reach too
  bool on_grid = false;  ///< lie_on_grid()
  double within = 0;     ///< triangles at most so far apart count; 0: those that meet
  distance::FrameClearance clearance = {};            ///< where that is not 0
  std::uint64_t most_candidates = ~std::uint64_t{0};  ///< of clearance: the walk gives up after so many
  /// Where both are one instance, the neighbours that the ways without neighbours leave out; null: none.
  /// Other ways do not look at it.
  const Neighbourhood* neighbours = nullptr;
};

/// Returns the task of these two, or of one instance with itself. The caller sets what else is asked.
PairTask pair_task(const PosedTree& a, const PosedTree& b, double within = 0);

/// The room where contacts go, which grows.
struct ContactSink {
  Contact* next = nullptr;
  Contact* end = nullptr;
  void* owner = nullptr;
  bool (*grow)(ContactSink&) = nullptr;  ///< makes room for at least one; false: out of memory
  bool gave_up = false;                  ///< the last walk did, so it does not know all contacts
  ContactCounters counters;
};

/// Adds the contacts of a pair to the sink, and what was done to its counters. False: out of memory.
using NarrowPhase = bool (*)(const PairTask&, ContactSink&);

/// The named way, or null where this machine or this build lacks it; all give the same contacts in the same
/// order, and the same counters. Condition: task.in_frame.
NarrowPhase narrow_phase(BlockPairVariant variant);

/// As narrow_phase(), but leaves out task.neighbours: they are no candidates.
NarrowPhase narrow_phase_without_neighbours(BlockPairVariant variant);

/// Walks pairs that are not in_frame by the boxes of nodes in world coordinates, float64, and leaves out
/// task.neighbours. It is slow, and right for all posed points that are finite.
bool narrow_phase_by_world_boxes(const PairTask& task, ContactSink& sink);

/// Decides what the first stage left, on the posed vertices, by float64, then exactly. In fast mode, by
/// float32 in a's frame. Where task.within is not 0, whether they are within it, in any mode.
bool meet(const PairTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b,
          ContactCounters& counters);

}  // namespace tandem
