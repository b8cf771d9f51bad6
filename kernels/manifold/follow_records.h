#pragma once
#include <cuda_runtime_api.h>

#include <cstdint>

#include "kernels/manifold/body.h"
#include "tandem/kernels/gpu_arrays.h"

namespace tandem::gpu {

/// Makes the shapes of assets from their records, both in GPU memory.
cudaError_t follow_records(const GpuAsset* records, std::uint32_t count, manifold::Shape* shapes,
                           cudaStream_t stream);

}  // namespace tandem::gpu
