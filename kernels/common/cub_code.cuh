#pragma once
#include <cub/util_device.cuh>

namespace tandem::gpu {

/// Has the code of CUB's kernels loaded onto the current GPU. It is called before the first call of CUB that
/// a process may make on a GPU.
///
/// CUB asks CUDA once for each GPU which code the program holds for it, and keeps the answer as long as the
/// process runs, an error too. CUDA loads the code for that, which fails where the GPU is full: then every
/// later call of CUB would fail with that error. Here the answer is not kept, and code that is loaded stays.
inline cudaError_t load_cub_code() {
  int version = 0;
  const cudaError_t error = cub::PtxVersionUncached(version);
  if (error != cudaSuccess) static_cast<void>(cudaGetLastError());
  return error;
}

}  // namespace tandem::gpu
