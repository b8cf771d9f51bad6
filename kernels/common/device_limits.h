#pragma once
#include <cstdint>

namespace tandem::gpu {

/// The limits of a GPU, and of the code that the program holds for it, which launches have to know.
struct DeviceLimits {
  std::uint32_t shared_bytes;  ///< shared memory that a thread block can have
  std::uint32_t processors;    ///< multiprocessors
  bool early_launch;           ///< kernels wait where wait_for_kernel_before() says so, see launch.h
};

/// While it lives, limits_of_device() tells its thread of another kind of GPU: no more shared memory than
/// there is, early launches only where there are some, and any number of multiprocessors; where these are
/// more than there are, thread blocks begin late. For tests. Condition: one at a time in a thread.
class PretendedDevice {
 public:
  explicit PretendedDevice(const DeviceLimits& limits);
  PretendedDevice(const PretendedDevice&) = delete;
  PretendedDevice& operator=(const PretendedDevice&) = delete;
  ~PretendedDevice();
};

}  // namespace tandem::gpu
