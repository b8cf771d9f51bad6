#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "tandem/kernels/gpu_arrays.h"

// Questions that keep something of each asset in a form of their own take it anew from the records that they
// follow, by take_shape(const GpuAsset&, Taken&). Nothing begins early here.
namespace tandem::gpu {

inline constexpr std::uint32_t kFollowThreads = 128;

template <typename Taken>
__global__ void __launch_bounds__(kFollowThreads)
    take_shapes(const GpuAsset* records, std::uint32_t count, Taken* taken) {
  const std::uint32_t i = blockIdx.x * kFollowThreads + threadIdx.x;
  if (i < count) take_shape(records[i], taken[i]);
}

template <typename Taken>
cudaError_t take_shapes_of(const GpuAsset* records, std::uint32_t count, Taken* taken, cudaStream_t stream) {
  if (count == 0) return cudaSuccess;
  take_shapes<<<(count + kFollowThreads - 1) / kFollowThreads, kFollowThreads, 0, stream>>>(records, count,
                                                                                            taken);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
