#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <span>

#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/status.h"
#include "tandem/kernels/pair_filter.h"

namespace tandem {

struct ObjectPair;

/// Owns a table in GPU memory of pairs of instances that a broad phase is not to look at, such as those that
/// a joint connects. Throws nothing.
class GpuExcludedPairs {
 public:
  /// Takes these pairs, in CPU memory, instead of those before, as ExcludedPairTable::set() does, and waits
  /// for the stream; what waits there for the table before must be done. Result: also those of CUDA that
  /// status_of() names. After an error no pair is excluded.
  Status upload(std::span<const ObjectPair> pairs, cudaStream_t stream);

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
