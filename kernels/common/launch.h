#pragma once
#include <cuda_runtime.h>

#include <cstddef>
#include <utility>

#include "kernels/common/device_limits.h"

// Kernels that get ready while the one before them ends.
namespace tandem::gpu {

#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
#error "Tandem needs GPUs of compute capability 8.0 or later: warps add up by __reduce_add_sync()"
#endif

/// Code for GPUs from this one on waits where wait_for_kernel_before() says so; a value of __CUDA_ARCH__.
inline constexpr int kFirstThatWaits = 900;

/// Finds the limits of the current device. Result: an error also where the program holds no code for it.
cudaError_t limits_of_device(DeviceLimits& out);

struct Grid {
  unsigned blocks, threads;
  std::size_t shared_bytes;
  cudaStream_t stream;
  bool early;  ///< DeviceLimits::early_launch
};

#ifdef __CUDACC__

/// Launches a kernel that may get its blocks ready while the one before it in the stream ends, and calls
/// wait_for_kernel_before() before it reads or writes what other kernels do.
template <typename... Parameters, typename... Arguments>
cudaError_t launch_after(const Grid& grid, void (*kernel)(Parameters...), Arguments&&... arguments) {
  cudaLaunchAttribute early = {};
  early.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  early.val.programmaticStreamSerializationAllowed = 1;
  cudaLaunchConfig_t config = {};
  config.gridDim = grid.blocks;
  config.blockDim = grid.threads;
  config.dynamicSmemBytes = grid.shared_bytes;
  config.stream = grid.stream;
  config.attrs = &early;
  config.numAttrs = grid.early ? 1 : 0;
  return cudaLaunchKernelEx(&config, kernel, std::forward<Arguments>(arguments)...);
}

/// The blocks of the next kernel may get ready as soon as all of this one have come here.
__device__ inline void let_next_kernel_begin() {
#if __CUDA_ARCH__ >= 900  // kFirstThatWaits
  asm volatile("griddepcontrol.launch_dependents;" ::: "memory");
#endif
}

/// Waits until all that the kernel before did is done and seen.
__device__ inline void wait_for_kernel_before() {
  let_next_kernel_begin();
#if __CUDA_ARCH__ >= 900  // kFirstThatWaits
  asm volatile("griddepcontrol.wait;" ::: "memory");
#endif
}

#endif

}  // namespace tandem::gpu
