#pragma once
#include <span>
#include <vector>

#include "engine.h"
#include "tandem/kernels/impact_query.h"

namespace tandem {

/// Bodies that move for a step of `duration` seconds; what it points to must stay.
struct MovingBodies {
  std::span<const AssetView> shapes;
  std::span<const Instance> bodies;
  std::span<const RigidMotion> motion;
  double duration;
  double tolerance;                      ///< ImpactOptions::tolerance
  const std::vector<ObjectPair>* given;  ///< null: the pairs are found, those that the filter looks at
  PairFilter filter;
};

/// When they meet. Pairs that are found are sorted.
struct TimedImpacts {
  std::vector<ObjectPair> pairs;
  std::vector<Impact> impacts;
  ImpactCounters counters;
  std::uint32_t rounds = 0;  ///< of block pairs
  Seconds seconds;           ///< of each repeat: a replayed graph, broad phase included
  GpuUse gpu;
};

/// Runs the query on the GPU until everything has room, then again for each repeat, timed by events. Throws
/// GpuError, EngineError or std::bad_alloc.
using ImpactsOnGpu = TimedImpacts(const MovingBodies& moving, std::uint32_t repeats);
ImpactsOnGpu time_impacts_on_gpu;

}  // namespace tandem
