#pragma once
#include <span>
#include <vector>

#include "engine.h"
#include "tandem/kernels/tolerance_query.h"

namespace tandem {

/// Bodies with levels of detail, and what is asked about them; what it points to must stay.
struct BodiesWithLevels {
  std::span<const AssetView> shapes;
  std::span<const Instance> bodies;
  double tolerance;
  const std::vector<ObjectPair>* given;  ///< null: pairs are those that the filter looks at
  PairFilter filter;
};

/// What is certain of pairs. Pairs that are found are sorted.
struct TimedVerdicts {
  std::vector<ObjectPair> pairs;
  std::vector<PairVerdict> verdicts;
  ToleranceCounters counters;
  /// Of each repeat; on a GPU a replayed graph, the broad phase included where pairs are found.
  Seconds seconds;
  Seconds deciding;  ///< on a GPU: the same without the broad phase
  GpuUse gpu;
};

/// Runs the query on the GPU until everything has room, then again for each repeat, timed by events. Throws
/// GpuError, EngineError or std::bad_alloc.
using VerdictsOnGpu = TimedVerdicts(const BodiesWithLevels& bodies, std::uint32_t repeats);
VerdictsOnGpu time_verdicts_on_gpu;

}  // namespace tandem
