#pragma once
#include <cstdint>
#include <cstring>

#include "kernels/manifold/surface_line.h"
#include "kernels/manifold/team.h"

// Teams of a GPU, see manifold/team.h: a warp, and a thread block.
namespace tandem::gpu {

/// The base of both teams: numbers in memory that the team shares, and what the lanes of a warp tell each
/// other.
struct TeamOfWarps {
  static constexpr bool kHasWarps = true;

  __device__ static std::uint32_t lane() { return threadIdx.x % 32; }
  /// A bit for each lane.
  __device__ static std::uint32_t ballot(bool value) { return __ballot_sync(0xFFFFFFFFu, value); }
  __device__ static std::uint32_t first_bit(std::uint32_t bits) {
    return static_cast<std::uint32_t>(__ffs(static_cast<int>(bits)) - 1);
  }
  template <typename T>
  __device__ static T from_lane(T value, std::uint32_t lane) {
    return __shfl_sync(0xFFFFFFFFu, value, static_cast<int>(lane));
  }

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

/// The memory that a warp needs for walks through trees.
struct WarpWalks {
  static constexpr std::uint32_t kRoom = 512, kMostLeaves = 64;

  std::uint32_t block[kRoom], triangle[kMostLeaves];     ///< that wait to be looked at
  std::uint8_t asks[kRoom], asks_triangle[kMostLeaves];  ///< the question that asks for each
};

/// Answers questions first, first + step, ... of at most 32 by a warp. Blocks of all of them wait on one
/// stack: four lanes take one of them, a node each. Triangles are looked at when there are enough for all
/// lanes, or no blocks are left.
class LineWalks {
 public:
  __device__ LineWalks(WarpWalks& walks, manifold::LineQuestions& questions)
      : walks_(walks), questions_(questions) {}

  __device__ void walk(std::uint32_t questions) {
    const std::uint32_t lane = threadIdx.x % 32;
    blocks_ = __popc(questions);
    if ((questions >> lane & 1u) != 0) {
      const std::uint32_t place = __popc(questions & ((1u << lane) - 1));
      walks_.block[place] = 0, walks_.asks[place] = static_cast<std::uint8_t>(lane);
    }
    __syncwarp();
    std::uint32_t leaves = 0;
    do {
      while (blocks_ > 0 && leaves < 32) leaves = look_at_blocks(leaves);
      leaves = visit(leaves);
    } while (blocks_ > 0 || leaves > 0);
  }

 private:
  /// Takes some blocks off the stack, and puts there what is below the nodes that pass. Result: how many
  /// triangles wait.
  __device__ std::uint32_t look_at_blocks(std::uint32_t leaves) {
    static_assert(kNodesPerBlock == 4);
    // With so many blocks left they are taken one by one, depth first, and need no more room than this.
    constexpr std::uint32_t kReserve = 3 * kMaxDepth + 4, kAtOnce = 8;
    static_assert(WarpWalks::kRoom > kReserve + 32 + 4 * kAtOnce);
    const std::uint32_t lane = threadIdx.x % 32, node = lane % 4, before = (1u << lane) - 1;
    const std::uint32_t most = blocks_ + 3 * kAtOnce + kReserve <= WarpWalks::kRoom ? kAtOnce : 1;
    const std::uint32_t taken = blocks_ < most ? blocks_ : most;
    bool passes = false, is_leaf = false;
    std::uint32_t below = 0;
    std::uint8_t question = 0;
    if (lane / 4 < taken) {
      const std::uint32_t place = blocks_ - 1 - lane / 4, index = walks_.block[place];
      question = walks_.asks[place];
      const manifold::LineTest test = questions_.test(question);
      const manifold::Shape& shape = *questions_.body(question).shape;
      const auto look = [&](const auto& block, const manifold::LineTest& along_axes) {
        is_leaf = block.is_leaf_block();
        passes = along_axes.passes(
            {{block.centre[0][node], block.centre[1][node], block.centre[2][node]}},
            {{block.half_extent[0][node], block.half_extent[1][node], block.half_extent[2][node]}});
      };
      if (shape.blocks != nullptr) {
        const Block& block = shape.blocks[index];
        below = block.index[node];
        look(block, test);
      } else {
        const OrientedBlock& block = shape.oriented_blocks[index];
        below = (block.first_below & ~OrientedBlock::kIsLeafBlock) + node;
        look(block, test.turned(manifold::ToBlock(block.rotation)));
      }
    }
    const std::uint32_t inner = __ballot_sync(kWarp, passes && !is_leaf),
                        leaf = __ballot_sync(kWarp, passes && is_leaf);
    __syncwarp();  // all have taken theirs
    blocks_ -= taken;
    if (passes && is_leaf) {
      const std::uint32_t place = leaves + __popc(leaf & before);
      walks_.triangle[place] = below, walks_.asks_triangle[place] = question;
    } else if (passes) {
      const std::uint32_t place = blocks_ + __popc(inner & before);
      walks_.block[place] = below, walks_.asks[place] = question;
    }
    blocks_ += __popc(inner);
    __syncwarp();
    return leaves + __popc(leaf);
  }

  /// Looks at triangles, one of each lane. Result: how many are left.
  __device__ std::uint32_t visit(std::uint32_t leaves) {
    const std::uint32_t lane = threadIdx.x % 32;
    manifold::Crossing crossing;
    std::uint8_t question = 0;
    if (lane < leaves) {
      const std::uint32_t place = leaves - 1 - lane;
      question = walks_.asks_triangle[place];
      crossing = questions_.visit(question, walks_.triangle[place]);
    }
    for (std::uint32_t found = __ballot_sync(kWarp, crossing.found()); found != 0; found &= found - 1) {
      if (lane + 1 == static_cast<std::uint32_t>(__ffs(static_cast<int>(found))))
        questions_.take(question, crossing);
      __syncwarp();
    }
    __syncwarp();  // all have taken theirs
    return leaves < 32 ? 0 : leaves - 32;
  }

  static constexpr std::uint32_t kWarp = 0xFFFFFFFFu;

  WarpWalks& walks_;
  manifold::LineQuestions& questions_;
  std::uint32_t blocks_ = 0;
};

/// Answers questions about lines by several warps, the number `warp` here.
inline __device__ __noinline__ void walk_lines(WarpWalks& walks, manifold::LineQuestions& questions,
                                               std::uint32_t count, const manifold::LineQuestion* shared,
                                               std::uint32_t warp, std::uint32_t warps) {
  static_assert(manifold::LineMemory::kMost <= 32);
  const std::uint32_t lane = threadIdx.x % 32;
  bool asked = lane < count && lane % warps == warp && shared[lane].side >= 0;
  if (asked) questions.prepare(lane);
  LineWalks all(walks, questions);
#pragma unroll 1
  for (std::uint32_t left = TeamOfWarps::ballot(asked); left != 0; left = TeamOfWarps::ballot(asked)) {
    all.walk(left);
    asked = asked && questions.has_to_look_further(lane);
    if (asked) questions.look_further(lane);
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

struct WarpTeam : TeamOfWarps {
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

  __device__ void walk_lines(manifold::LineQuestions& questions, std::uint32_t count,
                             const manifold::LineQuestion* shared) const {
    sync();
    gpu::walk_lines(*walks, questions, count, shared, 0, 1);
    sync();
  }
};

/// A thread block shares this for what its warps tell each other.
template <std::uint32_t kThreads>
struct BlockScratch {
  static constexpr int kMost = 32;  ///< values at a time
  Counter part[kMost][kThreads / 32];
};

template <std::uint32_t kThreads>
struct BlockTeam : TeamOfWarps {
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

  __device__ void walk_lines(manifold::LineQuestions& questions, std::uint32_t count,
                             const manifold::LineQuestion* shared) const {
    sync();
    const std::uint32_t warp = threadIdx.x / 32;
    gpu::walk_lines(walks[warp], questions, count, shared, warp, kThreads / 32);
    sync();
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
