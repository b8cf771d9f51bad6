#pragma once
#include <cuda_runtime_api.h>

#include <cstdint>

#include "kernels/geometry/inside_test.h"
#include "tandem/kernels/gpu_arrays.h"

namespace tandem::gpu {

/// Gives the surfaces of assets the shapes that their records have, both in GPU memory.
cudaError_t follow_records(const GpuAsset* records, std::uint32_t count, containment::Surface* surfaces,
                           cudaStream_t stream);

}  // namespace tandem::gpu
