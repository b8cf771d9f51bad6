#pragma once
#include <cstdint>
#include <cstring>

#include "kernels/manifold/surface_line.h"
#include "kernels/manifold/team.h"

// Teams of a GPU, see manifold/team.h: a warp, and a thread block.
namespace tandem::gpu {

/// The base of both teams: numbers in memory that the team shares.
struct SharedNumbers {
  __device__ static std::uint32_t load(const std::uint32_t& at) {
    return *static_cast<const volatile std::uint32_t*>(&at);
  }
  __device__ static void store(std::uint32_t& at, std::uint32_t value) {
    *static_cast<volatile std::uint32_t*>(&at) = value;
  }
  __device__ static std::uint32_t concurrent_load(std::uint32_t& at) { return atomicOr(&at, 0u); }
  __device__ static void concurrent_store(std::uint32_t& at, std::uint32_t value) { atomicExch(&at, value); }
  __device__ static void set_bits(std::uint32_t& at, std::uint32_t bits) { atomicOr(&at, bits); }
  __device__ static std::uint32_t add(std::uint32_t& at, std::uint32_t value) {
    return atomicAdd(&at, value);
  }
  __device__ static std::uint32_t compare_and_swap(std::uint32_t& at, std::uint32_t expected,
                                                   std::uint32_t value) {
    return atomicCAS(&at, expected, value);
  }
};

/// The memory that the groups of a warp need for walks through trees.
struct WarpWalks {
  std::uint32_t waiting[1024];  ///< blocks
  std::uint32_t triangles[32];  ///< of leaves just found
};

/// Some lanes of a warp, see manifold/team.h. All groups of a warp run in step.
template <std::uint32_t kWidth>
struct LaneGroup {
  static constexpr std::uint32_t kRoom = 1024 * kWidth / 32;
  std::uint32_t *waiting, *triangles;

  __device__ explicit LaneGroup(WarpWalks& walks)
      : waiting(walks.waiting + threadIdx.x % 32 / kWidth * kRoom),
        triangles(walks.triangles + threadIdx.x % 32 / kWidth * kWidth) {}

  __device__ static std::uint32_t rank() { return threadIdx.x % kWidth; }
  __device__ static void sync() { __syncwarp(); }
  __device__ static bool any_of_warp(bool value) { return __any_sync(kWarp, value) != 0; }
  /// A bit for each of the group.
  __device__ static std::uint32_t ballot(bool value) {
    const std::uint32_t all = __ballot_sync(kWarp, value);
    if constexpr (kWidth == 32) return all;
    return all >> (threadIdx.x % 32 / kWidth * kWidth) & ((1u << kWidth % 32) - 1);
  }
  template <typename Found, typename Better>
  __device__ static Found best(Found found, const Better& better) {
    for (std::uint32_t bit = kWidth / 2; bit > 0; bit /= 2) found = better(found, exchanged(found, bit));
    return found;
  }

 private:
  static constexpr std::uint32_t kWarp = 0xFFFFFFFFu;

  /// Returns what the lane has whose number differs in one bit.
  template <typename T>
  __device__ static T exchanged(const T& own, std::uint32_t bit) {
    constexpr int kWords = sizeof(T) / 4;
    static_assert(sizeof(T) % 4 == 0);
    std::uint32_t word[kWords];
    memcpy(word, &own, sizeof(T));
    for (int i = 0; i < kWords; ++i) word[i] = __shfl_xor_sync(kWarp, word[i], bit, kWidth);
    T out;
    memcpy(&out, word, sizeof(T));
    return out;
  }
};

/// Answers a question about a posed body by a group, as manifold::walk_surface() does by one thread: each of
/// it takes a node of a block, later a triangle. Groups that run in step come here together.
template <std::uint32_t kWidth, typename Questions>
__device__ __noinline__ void walk_surface(const LaneGroup<kWidth>& group, Questions& questions,
                                          std::uint32_t question, bool asked) {
  static_assert(kNodesPerBlock == 4);
  // With so many blocks left a group looks at one at a time, which never takes more.
  constexpr std::uint32_t kReserve = 3 * kMaxDepth + 4, kAtOnce = kWidth / 4;
  static_assert(LaneGroup<kWidth>::kRoom > kReserve + 3 * kAtOnce);
  std::uint32_t waiting = asked ? 1 : 0;
  if (asked && group.rank() == 0) group.waiting[0] = 0;
  group.sync();
  const std::uint32_t node = group.rank() % 4, before = (1u << group.rank()) - 1;
  const manifold::Shape& shape = *questions.body(question).shape;
  const Block* const blocks = shape.blocks;
  const OrientedBlock* const oriented_blocks = shape.oriented_blocks;
  auto test = questions.test(question);
  while (group.any_of_warp(waiting > 0)) {
    const std::uint32_t most = waiting + 3 * kAtOnce + kReserve <= LaneGroup<kWidth>::kRoom ? kAtOnce : 1;
    const std::uint32_t taken = waiting < most ? waiting : most;
    bool inner = false, leaf = false;
    std::uint32_t below = 0;
    if (group.rank() / 4 < taken) {
      const std::uint32_t index = group.waiting[waiting - 1 - group.rank() / 4];
      const auto passes = [&](const auto& block, const auto& test_of_block) {
        return test_of_block.passes(
            {{block.centre[0][node], block.centre[1][node], block.centre[2][node]}},
            {{block.half_extent[0][node], block.half_extent[1][node], block.half_extent[2][node]}});
      };
      if (blocks != nullptr) {
        const Block& block = blocks[index];
        leaf = block.is_leaf_block();
        below = block.index[node];
        inner = passes(block, test);
      } else {
        const OrientedBlock& block = oriented_blocks[index];
        leaf = block.is_leaf_block();
        below = (block.first_below & ~OrientedBlock::kIsLeafBlock) + node;
        inner = passes(block, test.turned(manifold::BlockAxes(block.rotation)));
      }
      leaf = leaf && inner, inner = inner && !leaf;
    }
    const std::uint32_t inners = group.ballot(inner), leaves = group.ballot(leaf);
    group.sync();  // all have taken theirs
    waiting -= taken;
    if (inner) group.waiting[waiting + __popc(inners & before)] = below;
    if (leaf) group.triangles[__popc(leaves & before)] = below;
    waiting += __popc(inners);
    group.sync();
    if (!group.any_of_warp(leaves != 0)) continue;
    typename Questions::Found found;
    if (group.rank() < __popc(leaves)) questions.visit(question, group.triangles[group.rank()], found);
    if (group.any_of_warp(static_cast<bool>(found))) {
      found =
          group.best(found, [&](const auto& x, const auto& y) { return questions.better(question, x, y); });
      group.sync();  // all are done with the question as it was
      if (found && group.rank() == 0) questions.merge(question, found);
      group.sync();
      test = questions.test(question);
    }
    group.sync();
  }
}

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

/// Returns for each of several values what `of` makes of those of all lanes.
template <typename T, int kCount, typename Of>
__device__ __forceinline__ void over_warp(T (&values)[kCount], Of of) {
#pragma unroll
  for (int i = 0; i < kCount; ++i) values[i] = over_warp(values[i], of);
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
  template <typename T, int kCount>
  __device__ __forceinline__ static void sums(T (&values)[kCount]) {
    over_warp(values, Sum());
  }
  template <typename T, int kCount>
  __device__ __forceinline__ static void least_ones(T (&values)[kCount]) {
    over_warp(values, Least());
  }
  template <typename T, int kCount>
  __device__ __forceinline__ static void greatest_ones(T (&values)[kCount]) {
    over_warp(values, Greatest());
  }
  __device__ static bool any(bool value) { return __any_sync(0xFFFFFFFFu, value) != 0; }

  template <int kWidth, typename Of>
  __device__ void for_each_group(std::uint32_t count, const Of& of) const {
    constexpr std::uint32_t kGroups = 32 / kWidth;
    const LaneGroup<kWidth> group(*walks);
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
  __device__ static void sync() {
    __syncwarp();  // a warp comes to a barrier as one
    __syncthreads();
  }
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
  __device__ static bool any(bool value) {
    __syncwarp();
    return __syncthreads_or(value) != 0;
  }

  template <typename T, int kCount>
  __device__ __forceinline__ void sums(T (&values)[kCount]) const {
    over_block(values, Sum());
  }
  template <typename T, int kCount>
  __device__ __forceinline__ void least_ones(T (&values)[kCount]) const {
    over_block(values, Least());
  }
  template <typename T, int kCount>
  __device__ __forceinline__ void greatest_ones(T (&values)[kCount]) const {
    over_block(values, Greatest());
  }

  template <int kWidth, typename Of>
  __device__ void for_each_group(std::uint32_t count, const Of& of) const {
    constexpr std::uint32_t kGroups = kThreads / kWidth;
    const LaneGroup<kWidth> group(walks[threadIdx.x / 32]);
    for (std::uint32_t first = 0; first < count; first += kGroups) {
      const std::uint32_t i = first + threadIdx.x / kWidth;
      of(group, i, i < count);
    }
  }

 private:
  template <typename T, typename Of>
  __device__ T over_block(T value, Of of) const {
    T values[1] = {value};
    over_block(values, of);
    return values[0];
  }
  template <typename T, int kCount, typename Of>
  __device__ __forceinline__ void over_block(T (&values)[kCount], Of of) const {
    static_assert(sizeof(T) <= sizeof(Counter) && kCount <= BlockScratch<kThreads>::kMost);
    over_warp(values, of);
    const auto part = [&](int i, std::uint32_t warp) -> T& {
      return *reinterpret_cast<T*>(&scratch->part[i][warp]);
    };
    sync();  // what an earlier call left has been read
    if (threadIdx.x % 32 == 0) {
#pragma unroll
      for (int i = 0; i < kCount; ++i) part(i, threadIdx.x / 32) = values[i];
    }
    sync();
#pragma unroll
    for (int i = 0; i < kCount; ++i) {
      values[i] = part(i, 0);
#pragma unroll 4
      for (std::uint32_t warp = 1; warp < kThreads / 32; ++warp) values[i] = of(values[i], part(i, warp));
    }
  }
};

}  // namespace tandem::gpu
