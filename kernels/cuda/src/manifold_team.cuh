#pragma once
#include <cstdint>

#include "tandem/kernels/detail/manifold/team.h"

// Teams of a GPU, see manifold/team.h: a warp, and a thread block.
namespace tandem::gpu {

/// What both have in common: numbers in memory that the team shares.
struct SharedNumbers {
  __device__ static std::uint32_t load(const std::uint32_t& at) {
    return *static_cast<const volatile std::uint32_t*>(&at);
  }
  __device__ static void store(std::uint32_t& at, std::uint32_t value) {
    *static_cast<volatile std::uint32_t*>(&at) = value;
  }
  __device__ static std::uint32_t add(std::uint32_t& at, std::uint32_t value) { return atomicAdd(&at, value); }
  __device__ static std::uint32_t compare_and_swap(std::uint32_t& at, std::uint32_t expected,
                                                   std::uint32_t value) {
    return atomicCAS(&at, expected, value);
  }
};

/// A crew is a team's first warp.
struct WarpCrew : SharedNumbers {
  __device__ static constexpr std::uint32_t crew_size() { return 32; }
  __device__ static void crew_sync() {
    __threadfence_block();
    __syncwarp();
  }
  template <typename Found, typename Of>
  __device__ static void one_by_one(const Found& found, const Of& of) {
    const bool has = static_cast<bool>(found);
    for (std::uint32_t left = __ballot_sync(0xFFFFFFFFu, has); left != 0; left &= left - 1) {
      if (threadIdx.x % 32 == static_cast<std::uint32_t>(__ffs(static_cast<int>(left)) - 1)) of();
      crew_sync();
    }
  }
};

struct Sum {
  template <typename T>
  __device__ T operator()(T x, T y) const {
    return x + y;
  }
};
struct Least {
  template <typename T>
  __device__ T operator()(T x, T y) const {
    return y < x ? y : x;
  }
};
struct Greatest {
  template <typename T>
  __device__ T operator()(T x, T y) const {
    return y > x ? y : x;
  }
};

template <typename T, typename Of>
__device__ T over_warp(T value, Of of) {
  for (int distance = 16; distance > 0; distance /= 2)
    value = of(value, __shfl_xor_sync(0xFFFFFFFFu, value, distance));
  return value;
}

struct WarpTeam : WarpCrew {
  __device__ static bool in_crew() { return true; }
  __device__ static std::uint32_t rank() { return threadIdx.x % 32; }
  __device__ static constexpr std::uint32_t size() { return 32; }
  __device__ static void sync() {
    __threadfence_block();
    __syncwarp();
  }
  template <typename T>
  __device__ static T sum(T value) {
    return over_warp(value, Sum());
  }
  template <typename T>
  __device__ static T least(T value) {
    return over_warp(value, Least());
  }
  template <typename T>
  __device__ static T greatest(T value) {
    return over_warp(value, Greatest());
  }
  __device__ static bool any(bool value) { return __any_sync(0xFFFFFFFFu, value) != 0; }
};

template <std::uint32_t kThreads>
struct BlockTeam : WarpCrew {
  Counter* scratch;  ///< shared, one for each warp

  __device__ static bool in_crew() { return threadIdx.x < 32; }
  __device__ static std::uint32_t rank() { return threadIdx.x; }
  __device__ static constexpr std::uint32_t size() { return kThreads; }
  __device__ static void sync() { __syncthreads(); }
  template <typename T>
  __device__ T sum(T value) const {
    return over_block(value, Sum());
  }
  template <typename T>
  __device__ T least(T value) const {
    return over_block(value, Least());
  }
  template <typename T>
  __device__ T greatest(T value) const {
    return over_block(value, Greatest());
  }
  __device__ static bool any(bool value) { return __syncthreads_or(value) != 0; }

 private:
  template <typename T, typename Of>
  __device__ T over_block(T value, Of of) const {
    static_assert(sizeof(T) <= sizeof(Counter));
    T* const part = reinterpret_cast<T*>(scratch);
    constexpr std::uint32_t kApart = sizeof(Counter) / sizeof(T);
    value = over_warp(value, of);
    __syncthreads();  // what an earlier call left has been read
    if (threadIdx.x % 32 == 0) part[kApart * (threadIdx.x / 32)] = value;
    __syncthreads();
    value = part[0];
    for (std::uint32_t i = 1; i < kThreads / 32; ++i) value = of(value, part[kApart * i]);
    return value;
  }
};

}  // namespace tandem::gpu
