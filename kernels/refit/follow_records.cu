#include "kernels/refit/follow_records.h"

#include "kernels/containment/containment_data.h"
#include "kernels/manifold/shape.h"

// These kernels are compiled without fused operations: diagonals are those of the CPU.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

using gpu::take_shape;  // of a surface
__device__ void take_shape(const GpuAsset& asset, manifold::Shape& shape) {
  shape = manifold::shape_of(asset.tree, asset.lower, asset.upper, asset.origin);
}

template <typename Taken>
__global__ void __launch_bounds__(kThreads)
    take_shapes(const GpuAsset* records, std::uint32_t count, Taken* taken) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i < count) take_shape(records[i], taken[i]);
}

template <typename Taken>
cudaError_t follow(const GpuAsset* records, std::uint32_t count, Taken* taken, cudaStream_t stream) {
  if (count == 0) return cudaSuccess;
  take_shapes<<<(count + kThreads - 1) / kThreads, kThreads, 0, stream>>>(records, count, taken);
  return cudaGetLastError();
}

}  // namespace

cudaError_t follow_records(const GpuAsset* records, std::uint32_t count, manifold::Shape* shapes,
                           cudaStream_t stream) {
  return follow(records, count, shapes, stream);
}

cudaError_t follow_records(const GpuAsset* records, std::uint32_t count, containment::Surface* surfaces,
                           cudaStream_t stream) {
  return follow(records, count, surfaces, stream);
}

}  // namespace tandem::gpu
