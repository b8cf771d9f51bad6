#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/launch.h"
#include "kernels/refit/refit_plan.h"
#include "tandem/kernels/gpu_deformer.h"

// The kernels that refit trees share this data, all of it in GPU memory.
namespace tandem::gpu {

/// What one thread block found of some positions of a body.
struct PositionCheck {
  float lower[3], upper[3];  ///< of all of them, where none is bad
  std::uint32_t first_bad;   ///< vertex that is not finite or beyond kMaxCoordinate; kNoIndex: there is none
  std::uint32_t unused;
  double rounding[3];  ///< the farthest that a position is from float32 numbers, along each axis
};
static_assert(sizeof(PositionCheck) == 56);

/// A body that deforms: its own copy of the tree, and where its plan begins.
struct DeformingBody {
  Triangle* triangles;
  PreciseCorners* precise;      ///< or null: positions are in float32
  Block* blocks;                ///< or null
  OrientedBlock* oriented;      ///< or null
  Box* roots;                   ///< boxes that go from round to round
  PositionCheck* checks;        ///< `check_count` of them, each of about as many vertices
  const CornerSource* corners;  ///< of the plan
  std::uint64_t vertices;       ///< source vertices
  std::uint32_t check_count;
  std::uint32_t asset;  ///< its number among the records
};

/// What a thread block does: part `item` of the vertices, or a cluster.
struct RefitWork {
  std::uint32_t body, item;
};

struct DeformState {
  GpuDeformReport report;
};

struct DeformArgs {
  const DeformingBody* bodies;
  const RefitBlock* blocks;  ///< this and the next three: of all plans
  const RefitCluster* clusters;
  const std::uint16_t* height_ends;
  const std::uint32_t* inputs;
  const RefitWork* work;  ///< of the checks, then of each round
  GpuPositions positions;
  GpuAssetRecords records;
  std::uint32_t body_count;
  std::uint32_t rounds;
  std::uint32_t work_end[kMostRefitRounds + 1];  ///< of the checks, then of each round
  DeformState* state;
  GpuDeformReport* host_report;  ///< in CPU memory
  DeviceLimits limits;
};

/// Checks all positions, refits the bodies whose positions are sound, and writes the records and the report.
cudaError_t refit_bodies(const DeformArgs& args, cudaStream_t stream);

}  // namespace tandem::gpu
