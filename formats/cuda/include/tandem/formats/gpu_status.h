#pragma once
#include <cuda_runtime_api.h>

#include "tandem/formats/status.h"

namespace tandem {

/// The status that names a CUDA error. `driver_version` is that of cudaDriverGetVersion(), 0 where there is
/// no driver; CUDA itself calls a missing driver too old.
inline Status status_of(cudaError_t error, int driver_version) {
  switch (error) {
    case cudaSuccess:
      return Status::kOk;
    case cudaErrorMemoryAllocation:
      return Status::kOutOfGpuMemory;
    case cudaErrorNoDevice:
    case cudaErrorDevicesUnavailable:
    case cudaErrorStubLibrary:
      return Status::kNoGpu;
    case cudaErrorInsufficientDriver:
      return driver_version == 0 ? Status::kNoGpu : Status::kDriverTooOld;
    case cudaErrorSystemDriverMismatch:
    case cudaErrorCompatNotSupportedOnDevice:
    case cudaErrorUnsupportedPtxVersion:
      return Status::kDriverTooOld;
    case cudaErrorNoKernelImageForDevice:
    case cudaErrorInvalidDeviceFunction:
      return Status::kGpuNotSupported;
    default:
      return Status::kCudaFailed;
  }
}

/// Returns the status of an error, given the version of the driver that is here.
inline Status status_of(cudaError_t error) {
  int driver_version = 0;
  if (error == cudaErrorInsufficientDriver) static_cast<void>(cudaDriverGetVersion(&driver_version));
  return status_of(error, driver_version);
}

}  // namespace tandem
