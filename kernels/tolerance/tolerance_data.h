#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/launch.h"
#include "kernels/common/pair_record.h"
#include "kernels/tolerance/tolerance_rule.h"
#include "tandem/kernels/gpu_tolerance_query.h"

// The kernels of a query by tolerance, one before a contact query and one behind it, share this data, all of
// it in GPU memory.
namespace tandem::gpu {

/// Zero when a query begins, up to the report.
struct ToleranceState {
  Counter verdicts[3];  ///< how many, by verdict
  std::uint32_t finished_blocks;
  GpuToleranceReport report;
};

/// The arguments of both kernels.
struct ToleranceArgs {
  const GpuAsset* levels;
  const levels::LevelRange* assets;  ///< where the levels of each lie
  std::uint32_t asset_count;
  GpuInstances instances;
  GpuPairs given;
  double tolerance;
  std::uint32_t pair_capacity;
  ToleranceState* state;
  GpuToleranceReport* host_report;  ///< in CPU memory
  std::uint32_t* level;             ///< of each instance
  std::uint32_t* asset;             ///< the same by place among all levels: an asset of the contact query
  PairVerdict* verdicts;
  const std::uint32_t* met;  ///< GpuContactQuery::met()
  const GpuContactReport* query;
  DeviceLimits limits;
};

/// Chooses the level of each instance.
cudaError_t choose_levels(const ToleranceArgs& args, cudaStream_t stream);

/// Makes verdicts of what the contact query found, and the report.
cudaError_t judge_pairs(const ToleranceArgs& args, cudaStream_t stream);

}  // namespace tandem::gpu
