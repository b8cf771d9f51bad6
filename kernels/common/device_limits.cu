#include "kernels/common/device_limits.h"

#include <algorithm>
#include <optional>

#include "kernels/common/launch.h"

namespace tandem::gpu {
namespace {

thread_local std::optional<DeviceLimits> pretended;

/// Never launched. It is compiled for the same kinds of GPU as all kernels here, so CUDA knows by it what
/// code there is for a GPU.
__global__ void any_kernel() {}

}  // namespace

PretendedDevice::PretendedDevice(const DeviceLimits& limits) {
  pretended = limits;
}
PretendedDevice::~PretendedDevice() {
  pretended.reset();
}

cudaError_t limits_of_device(DeviceLimits& out) {
  int device = 0, shared_bytes = 0, processors = 0;
  cudaFuncAttributes code = {};
  cudaError_t error = cudaGetDevice(&device);
  if (error == cudaSuccess)
    error = cudaDeviceGetAttribute(&shared_bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device);
  if (error == cudaSuccess)
    error = cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device);
  if (error == cudaSuccess) error = cudaFuncGetAttributes(&code, any_kernel);
  if (error != cudaSuccess) return error;
  out = {static_cast<std::uint32_t>(shared_bytes), static_cast<std::uint32_t>(processors),
         code.ptxVersion >= kFirstThatWaits / 10};
  if (pretended) {
    out = {std::min(out.shared_bytes, pretended->shared_bytes), pretended->processors,
           out.early_launch && pretended->early_launch};
  }
  return cudaSuccess;
}

}  // namespace tandem::gpu
