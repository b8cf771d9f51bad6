#include "kernels/manifold/follow_records.h"

#include "kernels/common/follow_records.cuh"
#include "kernels/manifold/shape.h"

namespace tandem::manifold {

// Compiled without fused operations: diagonals are those of the CPU.
__device__ static void take_shape(const GpuAsset& asset, Shape& shape) {
  shape = shape_of(asset.tree, asset.lower, asset.upper, asset.origin);
}

}  // namespace tandem::manifold

namespace tandem::gpu {

cudaError_t follow_records(const GpuAsset* records, std::uint32_t count, manifold::Shape* shapes,
                           cudaStream_t stream) {
  return take_shapes_of(records, count, shapes, stream);
}

}  // namespace tandem::gpu
