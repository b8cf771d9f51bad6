#pragma once
#include <cstdint>

#include "tandem/formats/platform.h"

namespace tandem::dynamics {

/// Says whether meet() may be called here.
#ifdef __CUDA_ARCH__
inline constexpr bool kCanMeet = true;
#else
inline constexpr bool kCanMeet = false;
#endif

/// Waits until all threads of all blocks, which must run at once, have come. arrived: how many blocks have, 0
/// before the first meeting. meetings: how many there are with this one. A meeting only keeps time: it does
/// not promise that what a thread wrote before it can be read after it.
TANDEM_HD inline void meet(std::uint32_t& arrived, std::uint32_t meetings) {
#ifdef __CUDA_ARCH__
  __syncthreads();
  if (threadIdx.x == 0) {
    // The counter only grows, if need be beyond its largest number.
    const std::uint32_t all = meetings * gridDim.x;
    const auto address = __cvta_generic_to_global(&arrived);
    asm volatile("red.relaxed.gpu.global.add.u32 [%0], 1;" ::"l"(address) : "memory");
    for (;;) {
      std::uint32_t seen;
      asm volatile("ld.relaxed.gpu.global.u32 %0, [%1];" : "=r"(seen) : "l"(address) : "memory");
      if (static_cast<std::int32_t>(seen - all) >= 0) break;
      __nanosleep(20);
    }
  }
  __syncthreads();
#else
  static_cast<void>(arrived), static_cast<void>(meetings);
#endif
}

}  // namespace tandem::dynamics
