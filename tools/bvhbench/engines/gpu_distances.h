#pragma once
#include <span>
#include <vector>

#include "engine.h"
#include "tandem/kernels/distance_query.h"

namespace tandem {

/// Bodies at rest, and what is asked about them; what it points to must stay.
struct BodiesApart {
  std::span<const AssetView> shapes;
  std::span<const Instance> bodies;
  DistanceTolerance tolerance;
  double reach;
  const std::vector<ObjectPair>* given;  ///< null: pairs are those within reach that the filter looks at
  PairFilter filter;
};

/// How near they are. Pairs that are found are sorted.
struct TimedDistances {
  std::vector<ObjectPair> pairs;
  std::vector<ObjectDistance> distances;
  DistanceCounters counters;
  std::uint32_t rounds = 0;  ///< of block pairs
  Seconds seconds;  ///< of each repeat: a replayed graph, the broad phase included where pairs are found
  Seconds nearest;  ///< the same without the broad phase
  GpuUse gpu;
};

/// Runs the query on the GPU until everything has room, then again for each repeat, timed by events. Throws
/// GpuError, EngineError or std::bad_alloc.
using DistancesOnGpu = TimedDistances(const BodiesApart& bodies, std::uint32_t repeats);
DistancesOnGpu time_distances_on_gpu;

}  // namespace tandem
