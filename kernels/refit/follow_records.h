#pragma once
#include <cuda_runtime_api.h>

#include <cstdint>

#include "kernels/geometry/inside_test.h"
#include "kernels/manifold/body.h"
#include "tandem/kernels/gpu_arrays.h"

// Questions that keep something of each asset in a form of their own take it anew from the records that they
// follow.
namespace tandem::gpu {

cudaError_t follow_records(const GpuAsset* records, std::uint32_t count, manifold::Shape* shapes,
                           cudaStream_t stream);
cudaError_t follow_records(const GpuAsset* records, std::uint32_t count, containment::Surface* surfaces,
                           cudaStream_t stream);

}  // namespace tandem::gpu
