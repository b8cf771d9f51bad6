#pragma once
#include <cuda_runtime_api.h>

#include "copy_plan.h"

namespace tandem {

/// Copies placed pieces to `to`, into memory of the current device, on `stream`, and returns when they are
/// there. What lies between pieces is overwritten too. Where threads cannot be started or memory cannot be
/// pinned, fewer threads copy, or CUDA from pageable memory. Throws nothing.
/// Result: cudaSuccess, or the first error; then nothing is being copied any more.
/// Conditions: `bytes` is what place() returned, and there is room for as many; staging.chunk_bytes > 0.
cudaError_t copy_pieces(std::span<const Piece> pieces, std::uint64_t bytes, const Staging& staging,
                        unsigned char* to, cudaStream_t stream);

}  // namespace tandem
