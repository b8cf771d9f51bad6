#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>

#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/status.h"
#include "tandem/kernels/pair_filter.h"

namespace tandem {

/// Owns a copy in GPU memory of a table of excluded pairs, for the broad phase there. Throws nothing.
class GpuExcludedPairs {
 public:
  /// Copies a table, ExcludedPairTable::view(), instead of the one before, and waits for the stream; what
  /// looks at the one before must be done. Result: kOk, or what status_of() names. After an error no pair is
  /// excluded.
  Status upload(const ExcludedPairs& table, cudaStream_t stream);

  /// Points into GPU memory; valid until the next upload().
  const ExcludedPairs& view() const { return view_; }

  std::size_t bytes() const { return slots_.bytes(); }  ///< of GPU memory: at most 32 for each pair
  cudaError_t cuda_error() const { return error_; }

 private:
  GpuArray<std::uint64_t> slots_;
  ExcludedPairs view_;
  cudaError_t error_ = cudaSuccess;
};

}  // namespace tandem
