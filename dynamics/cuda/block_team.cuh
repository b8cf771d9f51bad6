#pragma once
#include <algorithm>
#include <cstdint>

#include "dynamics/team.h"

namespace tandem::dynamics {

/// The threads of a block as a team, see SerialTeam. Each thread sums up every kSize-th thing; these sums are
/// added up within warps by halves, and then warp after warp.
class BlockTeam {
 public:
  static constexpr bool kIsMany = true;
  static constexpr std::uint32_t kSize = 128, kWarps = kSize / 32;

  /// What sums need of the block's shared memory.
  struct Shared {
    static constexpr int kMostSums = 3;
    double of_warp[kMostSums][kWarps];
  };

  __device__ explicit BlockTeam(Shared& shared) : shared_(shared) {}

  __device__ std::uint32_t rank() const { return threadIdx.x; }
  __device__ std::uint32_t size() const { return kSize; }
  __device__ void barrier() const { __syncthreads(); }
  template <typename Visit>
  __device__ void each(std::uint32_t count, const Visit& visit) const {
    for (std::uint32_t i = threadIdx.x; i < count; i += kSize) visit(i);
  }
  template <int kCount, typename Add>
  __device__ Sums<kCount> sum(Sums<kCount> start, std::uint32_t count, const Add& add) const {
    static_assert(kCount <= Shared::kMostSums);
    Sums<kCount> own = {};
    for (std::uint32_t i = threadIdx.x; i < count; i += kSize) add(i, own);
    for (int k = 0; k < kCount; ++k) {
      for (int half = 16; half > 0; half /= 2) own.of[k] += __shfl_down_sync(0xFFFFFFFFu, own.of[k], half);
      if (threadIdx.x % 32 == 0) shared_.of_warp[k][threadIdx.x / 32] = own.of[k];
    }
    __syncthreads();
    for (int k = 0; k < kCount; ++k) {
      for (const double of_warp : shared_.of_warp[k]) start.of[k] += of_warp;
    }
    __syncthreads();
    return start;
  }
  template <typename Of>
  __device__ double most(double start, std::uint32_t count, const Of& of) const {
    double own = start;
    for (std::uint32_t i = threadIdx.x; i < count; i += kSize) own = std::max(own, of(i));
    for (int half = 16; half > 0; half /= 2) own = std::max(own, __shfl_down_sync(0xFFFFFFFFu, own, half));
    if (threadIdx.x % 32 == 0) shared_.of_warp[0][threadIdx.x / 32] = own;
    __syncthreads();
    for (const double of_warp : shared_.of_warp[0]) start = std::max(start, of_warp);
    __syncthreads();
    return start;
  }

 private:
  Shared& shared_;
};

/// The threads of a warp as a team.
class WarpTeam {
 public:
  static constexpr bool kIsMany = true;
  static constexpr std::uint32_t kSize = 32;

  __device__ std::uint32_t rank() const { return threadIdx.x % kSize; }
  __device__ std::uint32_t size() const { return kSize; }
  __device__ void barrier() const { __syncwarp(); }
  template <typename Visit>
  __device__ void each(std::uint32_t count, const Visit& visit) const {
    for (std::uint32_t i = rank(); i < count; i += kSize) visit(i);
  }
  template <int kCount, typename Add>
  __device__ Sums<kCount> sum(Sums<kCount> start, std::uint32_t count, const Add& add) const {
    Sums<kCount> own = {};
    for (std::uint32_t i = rank(); i < count; i += kSize) add(i, own);
    for (int k = 0; k < kCount; ++k)
      start.of[k] += of_all(own.of[k], [](double p, double q) { return p + q; });
    return start;
  }
  template <typename Of>
  __device__ double most(double start, std::uint32_t count, const Of& of) const {
    for (std::uint32_t i = rank(); i < count; i += kSize) start = std::max(start, of(i));
    return of_all(start, [](double p, double q) { return std::max(p, q); });
  }

 private:
  // Each step adds the same two numbers in both threads, so all get the same.
  template <typename Join>
  __device__ static double of_all(double own, const Join& join) {
    for (int half = 16; half > 0; half /= 2) own = join(own, __shfl_xor_sync(0xFFFFFFFFu, own, half));
    return own;
  }
};

}  // namespace tandem::dynamics
