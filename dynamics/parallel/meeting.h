#pragma once
#include <cstdint>

#include "tandem/formats/platform.h"

namespace tandem::dynamics {

/// Says whether workers can meet: threads of a GPU can, all of whose blocks run at once.
#ifdef __CUDA_ARCH__
inline constexpr bool kCanMeet = true;
#else
inline constexpr bool kCanMeet = false;
#endif

/// Lets all blocks of a GPU meet again and again. Meetings only keep time: they do not promise that what a
/// thread wrote before one can be read after it. A block comes to the next meeting once all of its threads
/// have called come(); what a thread does between come() and wait() it does while others are on their way.
class Meetings {
 public:
  /// All threads of a block must make theirs at once. arrived: how often blocks have come, 0 before the first
  /// meeting.
  TANDEM_HD explicit Meetings(std::uint32_t* arrived) : arrived_(arrived) {
#ifdef __CUDA_ARCH__
    if (threadIdx.x == 0) *last_of_block() = 0;
    __syncthreads();
#endif
  }

  /// Comes to the next meeting. Condition: the thread has waited for the one before.
  TANDEM_HD void come() {
#ifdef __CUDA_ARCH__
    ++meetings_;
    __syncthreads();
    if (threadIdx.x == 0) asm volatile("red.relaxed.gpu.global.add.u32 [%0], 1;" ::"l"(arrived()) : "memory");
#endif
  }

  /// Waits until all blocks have come to the meeting to which this thread came last.
  TANDEM_HD void wait() const {
#ifdef __CUDA_ARCH__
    // The first warp looks at the counter of all blocks, the others at what it has seen.
    if (threadIdx.x >= 32) {
      while (!has_reached(*last_of_block(), meetings_)) __nanosleep(20);
      return;
    }
    if (has_reached(*last_of_block(), meetings_)) return;
    while (!has_reached(look(), meetings_ * gridDim.x)) __nanosleep(20);
    *last_of_block() = meetings_;
#endif
  }

 private:
#ifdef __CUDA_ARCH__
  // Counters only grow, if need be beyond their largest number.
  __device__ static bool has_reached(std::uint32_t counter, std::uint32_t number) {
    return static_cast<std::int32_t>(counter - number) >= 0;
  }
  __device__ static volatile std::uint32_t* last_of_block() {
    __shared__ volatile std::uint32_t last;
    return &last;
  }
  __device__ std::size_t arrived() const {
    return __cvta_generic_to_global(arrived_);
  }
  __device__ std::uint32_t look() const {
    std::uint32_t seen;
    asm volatile("ld.relaxed.gpu.global.u32 %0, [%1];" : "=r"(seen) : "l"(arrived()) : "memory");
    return seen;
  }
#endif

  [[maybe_unused]] std::uint32_t* arrived_;
  [[maybe_unused]] std::uint32_t meetings_ = 0;
};

}  // namespace tandem::dynamics
