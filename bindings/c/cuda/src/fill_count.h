#pragma once
#include <cuda_runtime_api.h>

#include <cstdint>

namespace tandem::c {

/// Queues that *to becomes `value`; it may be captured into a graph, which keeps the value.
cudaError_t fill_count(std::uint32_t* to, std::uint32_t value, cudaStream_t stream);

}  // namespace tandem::c
