#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/launch.h"
#include "kernels/common/pair_record.h"
#include "kernels/geometry/inside_test.h"
#include "tandem/kernels/gpu_containment_query.h"

namespace tandem::containment {

/// Gives a surface the shape of an asset.
TANDEM_HD inline void take_shape(const GpuAsset& asset, Surface& surface) {
  surface.triangles = asset.tree.triangles;
  surface.blocks = asset.tree.blocks;
  surface.oriented_blocks = asset.tree.oriented_blocks;
  for (int k = 0; k < 3; ++k) {
    surface.origin[k] = asset.origin[k];
    surface.lower[k] = asset.lower[k];
    surface.upper[k] = asset.upper[k];
  }
  surface.farthest = farthest_of(asset.extent);
}

}  // namespace tandem::containment

// The kernels that find bodies within bodies share this data, all of it in GPU memory.
namespace tandem::gpu {

/// The place of a row among those of its pair.
struct FoundContainment {
  Containment row;
  std::uint32_t rank;
};

struct ContainmentState {
  std::uint32_t next_pair;  ///< that no warp has taken
  Counter found;            ///< rows, those without room too
  GpuContainmentReport report;
};

/// Pairs whose rows are added up.
inline constexpr std::uint32_t kPairsPerSum = 4096;

struct ContainmentArgs {
  const containment::Surface* surfaces;
  GpuInstances instances;
  GpuPairs pairs;
  GpuContactGroups groups;
  const GpuContactReport* query;
  GpuContainmentCapacity capacity;
  ContainmentState* state;
  GpuContainmentReport* host_report;  ///< in CPU memory
  std::uint32_t* rows_of_pair;
  std::uint32_t* sums;  ///< of the rows of kPairsPerSum pairs each
  FoundContainment* found;
  Containment* contained;
  DeviceLimits limits;
};

/// Finds all rows, and puts them in order.
cudaError_t find_contained(const ContainmentArgs& args, cudaStream_t stream);

}  // namespace tandem::gpu
