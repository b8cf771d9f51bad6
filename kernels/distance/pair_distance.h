#pragma once
#include "kernels/distance/nearest_phase.h"

// A thread finds the distance of one object pair step by step, and keeps its memory from pair to pair.
namespace tandem {

/// Two triangles; those with which a search begins, or none.
struct NearestTriangles {
  std::uint32_t a = kNoIndex, b = kNoIndex;
};

/// The search for a pair's distance, or a walk that is part of it.
struct DistanceSearch {
  NearestSoFar found;
  NodeHeights heights;
  Buffer<BoundedBlockPair> walks;  ///< the next ones

  /// Makes ready for the pairs of another call.
  void reset_counters() {
    found.counters = {};
    found.enough_memory = true;
    found.most_visits = ~std::uint64_t{0};
  }

  /// Begins with nothing known but what the former nearest triangles tell.
  void begin(const NearestTask& task, double reach, const NearestTriangles& former);

  /// Finds heights along the direction of the best, for the rest of the walk, and lets it go on for four
  /// times as long before that is done again for a better one.
  void find_heights(const NearestTask& task);

  /// Makes what was left the next walks, the nearest first.
  void take_left();

  /// The distance of what is left when all candidates are settled.
  ObjectDistance finish(const NearestTask& task, double reach);

  /// Finds the distance, by the named way where the task is in_frame. Whether there was enough memory is told
  /// by `found`.
  ObjectDistance find(const NearestTask& task, double reach, const NearestTriangles& former,
                      NearestPhase way);
};

inline NearestPhase phase_of(const NearestTask& task, NearestPhase way) {
  return task.in_frame ? way : nearest_phase_by_world_boxes;
}

}  // namespace tandem
