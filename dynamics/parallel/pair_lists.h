#pragma once
#include <cstdint>

#include "tandem/kernels/manifold.h"
#include "tandem/kernels/object_pair.h"
#include "tandem/kernels/scene.h"

// What questions of a parallel step are given, and what they give.
namespace tandem::dynamics {

/// Pairs in the executor's memory.
struct PairList {
  const ObjectPair* pairs;
  const std::uint32_t* count;
  std::uint32_t most;
};

/// Bodies in the executor's memory.
struct PosedList {
  const std::uint32_t* asset;
  const Pose* pose;
  std::uint32_t count;
};

/// Manifolds by ascending row of the list of pairs, and their points in the same order.
struct FoundManifolds {
  const Manifold* manifolds;
  const ManifoldPoint* points;
  const std::uint32_t* count;  ///< of manifolds
  const std::uint32_t* point_count;
  std::uint32_t most;  ///< manifolds
};

}  // namespace tandem::dynamics
