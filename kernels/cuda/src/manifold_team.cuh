#pragma once
#include <cstdint>
#include <cstring>

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
  __device__ static std::uint32_t add(std::uint32_t& at, std::uint32_t value) {
    return atomicAdd(&at, value);
  }
  __device__ static std::uint32_t compare_and_swap(std::uint32_t& at, std::uint32_t expected,
                                                   std::uint32_t value) {
    return atomicCAS(&at, expected, value);
  }
};

/// What the groups of a warp need for walks through trees.
struct WarpWalks {
  std::uint32_t waiting[1024];                   ///< blocks
  std::uint32_t triangles[32 * kNodesPerBlock];  ///< of leaves just found
};

/// Some lanes of a warp, see manifold/team.h. All groups of a warp run in step.
template <std::uint32_t kWidth>
struct LaneGroup {
  static constexpr std::uint32_t kRoom = 1024 * kWidth / 32;
  std::uint32_t *waiting, *triangles;

  __device__ explicit LaneGroup(WarpWalks& walks)
      : waiting(walks.waiting + threadIdx.x % 32 / kWidth * kRoom),
        triangles(walks.triangles + threadIdx.x % 32 / kWidth * kWidth * kNodesPerBlock) {}

  __device__ static std::uint32_t rank() { return threadIdx.x % kWidth; }
  __device__ static constexpr std::uint32_t size() { return kWidth; }
  __device__ static void sync() { __syncwarp(); }
  __device__ static bool any_of_all(bool value) { return __any_sync(0xFFFFFFFFu, value) != 0; }
  __device__ static std::uint32_t sum_before(std::uint32_t value, std::uint32_t& total) {
    std::uint32_t sum = value;
    for (std::uint32_t distance = 1; distance < kWidth; distance *= 2) {
      const std::uint32_t other = __shfl_up_sync(0xFFFFFFFFu, sum, distance, kWidth);
      if (rank() >= distance) sum += other;
    }
    total = __shfl_sync(0xFFFFFFFFu, sum, kWidth - 1, kWidth);
    return sum - value;
  }
  template <typename Found, typename Better>
  __device__ static Found best(Found found, const Better& better) {
    for (std::uint32_t distance = kWidth / 2; distance > 0; distance /= 2)
      found = better(found, exchanged(found, distance));
    return found;
  }

 private:
  /// What the lane has whose number differs in one bit.
  template <typename T>
  __device__ static T exchanged(const T& own, std::uint32_t bit) {
    constexpr int kWords = sizeof(T) / 4;
    static_assert(sizeof(T) % 4 == 0);
    std::uint32_t word[kWords];
    memcpy(word, &own, sizeof(T));
    for (int i = 0; i < kWords; ++i) word[i] = __shfl_xor_sync(0xFFFFFFFFu, word[i], bit, kWidth);
    T out;
    memcpy(&out, word, sizeof(T));
    return out;
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

/// Of each of several values what `of` makes of those of all lanes.
template <typename T, int kMost, typename Of>
__device__ void over_warp(T (&values)[kMost], int count, Of of) {
#pragma unroll
  for (int i = 0; i < kMost; ++i) {
    if (i < count) values[i] = over_warp(values[i], of);
  }
}

struct WarpTeam : SharedNumbers {
  WarpWalks* walks;

  __device__ explicit WarpTeam(WarpWalks* of_warp) : walks(of_warp) {}
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
  template <typename T, int kMost>
  __device__ static void sums(T (&values)[kMost], int count = kMost) {
    over_warp(values, count, Sum());
  }
  template <typename T, int kMost>
  __device__ static void least_ones(T (&values)[kMost], int count = kMost) {
    over_warp(values, count, Least());
  }
  template <typename T, int kMost>
  __device__ static void greatest_ones(T (&values)[kMost], int count = kMost) {
    over_warp(values, count, Greatest());
  }
  __device__ static bool any(bool value) { return __any_sync(0xFFFFFFFFu, value) != 0; }

  static constexpr int kHalf = 16;
  template <int kWidth, typename Of>
  __device__ void for_each_group(std::uint32_t count, const Of& of) const {
    constexpr std::uint32_t kGroups = 32 / kWidth;
    LaneGroup<kWidth> group(*walks);
    for (std::uint32_t first = 0; first < count; first += kGroups) {
      const std::uint32_t i = first + rank() / kWidth;
      of(group, i, i < count);
    }
  }
};

/// A thread block shares this for what its warps tell each other.
template <std::uint32_t kThreads>
struct BlockScratch {
  static constexpr int kMost = 32;  ///< values at a time
  Counter part[kMost][kThreads / 32];
};

template <std::uint32_t kThreads>
struct BlockTeam : SharedNumbers {
  BlockScratch<kThreads>* scratch;
  WarpWalks* walks;  ///< of each warp

  __device__ BlockTeam(BlockScratch<kThreads>* of_block, WarpWalks* of_warps)
      : scratch(of_block), walks(of_warps) {}

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

  template <typename T, int kMost>
  __device__ void sums(T (&values)[kMost], int count = kMost) const {
    over_block(values, count, Sum());
  }
  template <typename T, int kMost>
  __device__ void least_ones(T (&values)[kMost], int count = kMost) const {
    over_block(values, count, Least());
  }
  template <typename T, int kMost>
  __device__ void greatest_ones(T (&values)[kMost], int count = kMost) const {
    over_block(values, count, Greatest());
  }

  static constexpr int kHalf = 32;
  template <int kWidth, typename Of>
  __device__ void for_each_group(std::uint32_t count, const Of& of) const {
    constexpr std::uint32_t kGroups = kThreads / kWidth;
    LaneGroup<kWidth> group(walks[threadIdx.x / 32]);
    for (std::uint32_t first = 0; first < count; first += kGroups) {
      const std::uint32_t i = first + threadIdx.x / kWidth;
      of(group, i, i < count);
    }
  }

 private:
  template <typename T, typename Of>
  __device__ T over_block(T value, Of of) const {
    T values[1] = {value};
    over_block(values, 1, of);
    return values[0];
  }
  template <typename T, int kMost, typename Of>
  __device__ void over_block(T (&values)[kMost], int count, Of of) const {
    static_assert(sizeof(T) <= sizeof(Counter) && kMost <= BlockScratch<kThreads>::kMost);
    over_warp(values, count, of);
    const auto part = [&](int i, std::uint32_t warp) -> T& {
      return *reinterpret_cast<T*>(&scratch->part[i][warp]);
    };
    __syncthreads();  // what an earlier call left has been read
#pragma unroll
    for (int i = 0; i < kMost; ++i) {
      if (i < count && threadIdx.x % 32 == 0) part(i, threadIdx.x / 32) = values[i];
    }
    __syncthreads();
#pragma unroll
    for (int i = 0; i < kMost; ++i) {
      if (i >= count) continue;
      values[i] = part(i, 0);
      for (std::uint32_t warp = 1; warp < kThreads / 32; ++warp) values[i] = of(values[i], part(i, warp));
    }
  }
};

}  // namespace tandem::gpu
