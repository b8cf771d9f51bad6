#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "launch.h"
#include "pair_record.h"
#include "tandem/kernels/detail/tolerance_rule.h"
#include "tandem/kernels/gpu_tolerance_query.h"

// What the kernels of a query by tolerance share, all of it in GPU memory. A round is a contact query of the
// pairs that are open, at levels that the kernel before it chose, and a kernel that judges what it found.
namespace tandem::gpu {

/// Zero when a query begins, up to the report.
struct ToleranceState {
  std::uint32_t open[kMaxLevels + 1];  ///< pairs of each round; of the first one those given are open
  Counter verdicts[3];                 ///< how many, by verdict
  std::uint32_t finished_blocks;
  GpuToleranceReport report;
};

/// The arguments of all kernels of a query.
struct ToleranceArgs {
  const GpuAsset* levels;
  const levels::LevelRange* assets;  ///< where the levels of each lie
  std::uint32_t asset_count;
  GpuInstances instances;
  GpuPairs given;
  double tolerance;
  std::uint32_t rounds;
  std::uint32_t pair_capacity;
  ToleranceState* state;
  GpuToleranceReport* host_report;  ///< in CPU memory
  std::uint32_t* last;              ///< of each instance: the last level that a round looks at
  std::uint32_t* level;             ///< the same in the round, by place among all levels
  ObjectPair* open[2];              ///< of rounds of even and of odd number
  std::uint32_t* rows[2];           ///< the same by place among those given
  PairVerdict* verdicts;
  const std::uint32_t* met;     ///< GpuContactQuery::met()
  const GpuQueryReport* query;  ///< of the round
  DeviceLimits limits;
};

/// Finds the last level of each instance, and the levels of the first round.
cudaError_t begin_rounds(const ToleranceArgs& args, cudaStream_t stream);

/// Takes what the contact query of a round found. The last round writes the report.
cudaError_t judge_round(const ToleranceArgs& args, std::uint32_t round, cudaStream_t stream);

}  // namespace tandem::gpu
