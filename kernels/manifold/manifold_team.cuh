#pragma once
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "kernels/manifold/surface_line.h"
#include "kernels/manifold/team.h"

// Teams of a GPU, see manifold/team.h: a warp, and a thread block.
namespace tandem::gpu {

/// The memory that a warp needs for walks through trees.
struct WarpWalks {
  static constexpr std::uint32_t kRoom = 384, kMostTriangles = 64;

  // Those that wait to be looked at, and the question that asks for each. Blocks are oriented where there are
  // no others.
  std::uint32_t block[kRoom], triangle[kMostTriangles];
  std::uint8_t asks[kRoom], asks_triangle[kMostTriangles];
  const unsigned char* tree[2];  ///< the blocks of each body
  bool oriented[2];
};

/// Answers questions of a set of at most 32 by a warp. Blocks of all of them wait on one stack: four lanes
/// take one of them, a node each. Triangles are looked at when there are enough for all lanes, or no blocks
/// are left. All of this is in shared memory, and is short: warps that do different things share a cache of
/// instructions.
class LineWalks {
 public:
  __device__ LineWalks(WarpWalks& walks, const manifold::LineQuestions& questions,
                       const manifold::LineQuestion* shared)
      : walks_(walks), questions_(questions), shared_(shared) {}

  __device__ void walk(std::uint32_t questions) {
    blocks_ = __popc(questions);
    if ((questions >> lane() & 1u) != 0)
      put(walks_.block, walks_.asks, __popc(questions & before()), 0, lane());
    __syncwarp();
    triangles_ = 0;
    do {
#pragma unroll 1
      while (blocks_ > 0 && triangles_ < 32) look_at_blocks();
      visit();
    } while (blocks_ > 0 || triangles_ > 0);
  }

 private:
  __device__ static std::uint32_t lane() {
    return threadIdx.x % 32;
  }
  /// The lanes before this one.
  __device__ static std::uint32_t before() {
    return (1u << lane()) - 1;
  }

  __device__ static void put(std::uint32_t* waiting, std::uint8_t* asks, std::uint32_t place,
                             std::uint32_t index, std::uint32_t question) {
    waiting[place] = index, asks[place] = static_cast<std::uint8_t>(question);
  }

  /// Returns whether a lane's node of a block passes a question's test. below: what is below it.
  __device__ bool passes(std::uint32_t block, const manifold::LineQuestion& question, std::uint32_t& below,
                         bool& is_leaf) const {
    static_assert(offsetof(Block, half_extent) == offsetof(OrientedBlock, half_extent));
    const std::uint32_t node = lane() % kNodesPerBlock;
    const int side = question.side;
    const bool oriented = walks_.oriented[side];
    const unsigned char* const at =
        walks_.tree[side] + std::size_t{block} * (oriented ? sizeof(OrientedBlock) : sizeof(Block));
    const float* const box = reinterpret_cast<const float*>(at) + node;
    manifold::FloatVector centre, half;
#pragma unroll
    for (int k = 0; k < 3; ++k)
      centre.x[k] = box[k * kNodesPerBlock], half.x[k] = box[(3 + k) * kNodesPerBlock];
    manifold::LineTest test = question.test;
    if (oriented) {
      const auto& of = *reinterpret_cast<const OrientedBlock*>(at);
      below = (of.first_below & ~OrientedBlock::kIsLeafBlock) + node, is_leaf = of.is_leaf_block();
      test = test.turned(manifold::ToBlock(of.rotation));
    } else {
      const auto& of = *reinterpret_cast<const Block*>(at);
      below = of.index[node], is_leaf = of.is_leaf_block();
    }
    return test.passes(centre, half);
  }

  /// Takes some blocks off the stack, and puts there what is below the nodes that pass.
  __device__ void look_at_blocks() {
    static_assert(kNodesPerBlock == 4);
    // With so many blocks left they are taken one by one, depth first, and need no more room than this.
    constexpr std::uint32_t kReserve = 3 * kMaxDepth + 4, kAtOnce = 8;
    static_assert(WarpWalks::kRoom > kReserve + 32 + 4 * kAtOnce);
    const std::uint32_t most = blocks_ + 3 * kAtOnce + kReserve <= WarpWalks::kRoom ? kAtOnce : 1;
    const std::uint32_t taken = blocks_ < most ? blocks_ : most;
    bool passed = false, is_leaf = false;
    std::uint32_t below = 0, question = 0;
    if (lane() / 4 < taken) {
      const std::uint32_t place = blocks_ - 1 - lane() / 4;
      question = walks_.asks[place];
      passed = passes(walks_.block[place], shared_[question], below, is_leaf);
    }
    const std::uint32_t inner = __ballot_sync(kWarp, passed && !is_leaf),
                        leaf = __ballot_sync(kWarp, passed && is_leaf);
    __syncwarp();  // all have taken theirs
    blocks_ -= taken;
    if (passed && is_leaf)
      put(walks_.triangle, walks_.asks_triangle, triangles_ + __popc(leaf & before()), below, question);
    if (passed && !is_leaf)
      put(walks_.block, walks_.asks, blocks_ + __popc(inner & before()), below, question);
    blocks_ += __popc(inner), triangles_ += __popc(leaf);
    __syncwarp();
  }

  /// Looks at triangles, one of each lane.
  __device__ void visit() {
    manifold::Crossing crossing;
    std::uint32_t question = 0;
    if (lane() < triangles_) {
      const std::uint32_t place = triangles_ - 1 - lane();
      question = walks_.asks_triangle[place];
      crossing = questions_.visit(question, walks_.triangle[place]);
    }
    __syncwarp();  // all have taken theirs
    triangles_ = triangles_ < 32 ? 0 : triangles_ - 32;
    // One lane of each question takes at a time.
    for (bool found = crossing.found(); __any_sync(kWarp, found);) {
      const std::uint32_t same = __match_any_sync(kWarp, found ? question : kNoIndex);
      const bool takes = found && (same & before()) == 0;
      if (takes) questions_.take(question, crossing);
      found = found && !takes;
      __syncwarp();
    }
  }

  static constexpr std::uint32_t kWarp = 0xFFFFFFFFu;

  WarpWalks& walks_;
  const manifold::LineQuestions& questions_;
  const manifold::LineQuestion* shared_;
  std::uint32_t blocks_ = 0, triangles_ = 0;  ///< that wait
};

/// A place in shared memory, as a function that is not inlined takes it: the compiler then knows what it is.
template <typename T>
struct SharedPlace {
  std::size_t at;

  __device__ explicit SharedPlace(T* place) : at(__cvta_generic_to_shared(place)) {}
  __device__ T* operator()() const { return static_cast<T*>(__cvta_shared_to_generic(at)); }
};

/// Answers questions about lines by several warps, the number `warp` here.
inline __device__ __noinline__ void walk_lines(SharedPlace<WarpWalks> of_warp,
                                               SharedPlace<const manifold::BodyPair> of_pair,
                                               SharedPlace<manifold::LineQuestion> asked_for,
                                               std::uint32_t count, std::uint32_t warp, std::uint32_t warps) {
  static_assert(manifold::LineMemory::kMost <= 32);
  WarpWalks& walks = *of_warp();
  const manifold::BodyPair& bodies = *of_pair();
  manifold::LineQuestion* const shared = asked_for();
  const manifold::LineQuestions questions(bodies, shared);
  const std::uint32_t lane = threadIdx.x % 32;
  if (lane < 2) {
    const manifold::Shape& shape = *bodies[static_cast<int>(lane)].shape;
    walks.oriented[lane] = shape.blocks == nullptr;
    walks.tree[lane] = shape.blocks == nullptr ? reinterpret_cast<const unsigned char*>(shape.oriented_blocks)
                                               : reinterpret_cast<const unsigned char*>(shape.blocks);
  }
  bool asked = lane < count && lane % warps == warp && shared[lane].side >= 0;
  if (asked) questions.prepare(lane);
  LineWalks all(walks, questions, shared);
#pragma unroll 1
  for (std::uint32_t left = __ballot_sync(0xFFFFFFFFu, asked); left != 0;
       left = __ballot_sync(0xFFFFFFFFu, asked)) {
    all.walk(left);
    asked = asked && questions.has_to_look_further(lane);
    if (asked) questions.look_further(lane);
  }
}

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

  __device__ static void walk(WarpWalks& walks, const manifold::LineQuestions& questions, std::uint32_t count,
                              std::uint32_t warp, std::uint32_t warps) {
    gpu::walk_lines(SharedPlace(&walks), SharedPlace(&questions.bodies()), SharedPlace(questions.questions()),
                    count, warp, warps);
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

/// Whole numbers in the order of what they are made of, which is not NaN.
__device__ inline std::uint32_t in_order(std::uint32_t x) {
  return x;
}
__device__ inline std::uint32_t in_order(int x) {
  return static_cast<std::uint32_t>(x) ^ 1u << 31;
}
__device__ inline std::uint32_t in_order(float x) {
  const int bits = __float_as_int(x);
  return in_order(bits ^ (bits >> 31 & 0x7FFFFFFF));
}
__device__ inline Counter in_order(Counter x) {
  return x;
}
__device__ inline Counter in_order(std::uint64_t x) {
  return x;
}
__device__ inline Counter in_order(double x) {
  const long long bits = __double_as_longlong(x), low = 0x7FFFFFFFFFFFFFFF;
  return static_cast<Counter>(bits ^ (bits >> 63 & low)) ^ Counter { 1 } << 63;
}

/// What in_order() made a number of.
template <typename T>
__device__ T from_order(decltype(in_order(T())) number) {
  if constexpr (std::is_same_v<T, int>) {
    return static_cast<int>(number ^ 1u << 31);
  } else if constexpr (std::is_same_v<T, float>) {
    const int bits = from_order<int>(number);
    return __int_as_float(bits ^ (bits >> 31 & 0x7FFFFFFF));
  } else if constexpr (std::is_same_v<T, double>) {
    const auto bits = static_cast<long long>(number ^ Counter{1} << 63), low = 0x7FFFFFFFFFFFFFFFll;
    return __longlong_as_double(bits ^ (bits >> 63 & low));
  } else {
    return number;
  }
}

/// The greatest number of a warp's lanes.
__device__ inline std::uint32_t greatest_of_lanes(std::uint32_t number) {
  return __reduce_max_sync(0xFFFFFFFFu, number);
}
__device__ inline Counter greatest_of_lanes(Counter number) {
  const auto upper = static_cast<std::uint32_t>(number >> 32), lower = static_cast<std::uint32_t>(number);
  const std::uint32_t greatest = greatest_of_lanes(upper);
  return Counter{greatest} << 32 | greatest_of_lanes(upper == greatest ? lower : 0u);
}

/// A whole number: sums of any kind wrap around.
template <typename T>
__device__ T over_warp(T value, Sum) {
  const auto sum = [](std::uint64_t part) {
    return __reduce_add_sync(0xFFFFFFFFu, static_cast<std::uint32_t>(part));
  };
  if constexpr (sizeof(T) == 4) return static_cast<T>(sum(static_cast<std::uint64_t>(value)));
  // Parts of 27 bits: the sum of 32 of them fits.
  constexpr std::uint64_t kPart = (std::uint64_t{1} << 27) - 1;
  const auto bits = static_cast<std::uint64_t>(value);
  const std::uint64_t lower = sum(bits & kPart), middle = sum(bits >> 27 & kPart), upper = sum(bits >> 54);
  return static_cast<T>(lower + (middle << 27) + (upper << 54));
}
template <typename T>
__device__ T over_warp(T value, Greatest) {
  return from_order<T>(greatest_of_lanes(in_order(value)));
}
template <typename T>
__device__ T over_warp(T value, Least) {
  return from_order<T>(~greatest_of_lanes(~in_order(value)));
}

/// Returns for each of several values what `of` makes of those of all lanes.
template <typename T, int kCount, typename Of>
__device__ __forceinline__ void each_over_warp(T (&values)[kCount], Of of) {
#pragma unroll
  for (int i = 0; i < kCount; ++i) values[i] = over_warp(values[i], of);
}

struct WarpTeam : TeamOfWarps {
  WarpWalks* walks;
  /// The warps of the block begin their walks together, and so share what they fetch of the code. Condition:
  /// all of them are such teams until they exit.
  bool in_step;

  __device__ explicit WarpTeam(WarpWalks* of_warp, bool goes_in_step = false)
      : walks(of_warp), in_step(goes_in_step) {}
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
    each_over_warp(values, Sum());
  }
  template <typename T, int kCount>
  __device__ __forceinline__ static void least_ones(T (&values)[kCount]) {
    each_over_warp(values, Least());
  }
  template <typename T, int kCount>
  __device__ __forceinline__ static void greatest_ones(T (&values)[kCount]) {
    each_over_warp(values, Greatest());
  }
  __device__ static bool any(bool value) { return __any_sync(0xFFFFFFFFu, value) != 0; }

  __device__ void walk_lines(const manifold::LineQuestions& questions, std::uint32_t count) const {
    sync();
    if (in_step) __syncthreads();
    walk(*walks, questions, count, 0, 1);
    sync();
  }
};

/// A thread block shares this for what its warps tell each other.
template <std::uint32_t kThreads>
struct BlockScratch {
  static constexpr int kMost = 32;  ///< values at a time
  Counter part[kMost][kThreads / 32];
};

/// A thread block; or, with kOrWarp, that or one of its warps. Which of them is known when it runs, so that a
/// kernel has the code for both once: instructions are what small scenes wait for.
template <std::uint32_t kThreads, bool kOrWarp = false>
struct BlockTeam : TeamOfWarps {
  BlockScratch<kThreads>* scratch;  ///< null for a warp
  WarpWalks* walks;                 ///< of each warp of the team

  __device__ BlockTeam(BlockScratch<kThreads>* of_block, WarpWalks* of_warps)
      : scratch(of_block), walks(of_warps) {}

  __device__ bool is_block() const { return !kOrWarp || scratch != nullptr; }
  __device__ std::uint32_t rank() const { return is_block() ? threadIdx.x : threadIdx.x % 32; }
  __device__ std::uint32_t size() const { return is_block() ? kThreads : 32; }
  __device__ void sync() const {
    WarpTeam::sync();  // a warp comes to a barrier as one
    if (is_block()) __syncthreads();
  }
  template <typename T>
  __device__ T sum(T value) const {
    return over_team(value, Sum());
  }
  template <typename T>
  __device__ T least(T value) const {
    return over_team(value, Least());
  }
  template <typename T>
  __device__ T greatest(T value) const {
    return over_team(value, Greatest());
  }
  __device__ bool any(bool value) const {
    const bool of_warp = WarpTeam::any(value);
    return is_block() ? __syncthreads_or(of_warp) != 0 : of_warp;
  }

  template <typename T, int kCount>
  __device__ __forceinline__ void sums(T (&values)[kCount]) const {
    over_team(values, Sum());
  }
  template <typename T, int kCount>
  __device__ __forceinline__ void least_ones(T (&values)[kCount]) const {
    over_team(values, Least());
  }
  template <typename T, int kCount>
  __device__ __forceinline__ void greatest_ones(T (&values)[kCount]) const {
    over_team(values, Greatest());
  }

  __device__ void walk_lines(const manifold::LineQuestions& questions, std::uint32_t count) const {
    sync();
    const std::uint32_t warp = rank() / 32;
    walk(walks[warp], questions, count, warp, size() / 32);
    sync();
  }

 private:
  template <typename T, typename Of>
  __device__ T over_team(T value, Of of) const {
    T values[1] = {value};
    over_team(values, of);
    return values[0];
  }
  template <typename T, int kCount, typename Of>
  __device__ __forceinline__ void over_team(T (&values)[kCount], Of of) const {
    static_assert(sizeof(T) <= sizeof(Counter) && kCount <= BlockScratch<kThreads>::kMost);
    each_over_warp(values, of);
    if (!is_block()) return;
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

/// Memory that teams share, without contents at first.
template <typename T>
struct Raw {
  alignas(16) unsigned char bytes[sizeof(T)];
  __device__ T& get() { return *reinterpret_cast<T*>(bytes); }
};

/// Calls of(row) for rows below `rows` that no other team has taken.
template <typename AnyTeam, typename Of>
__device__ void take_rows(const AnyTeam& team, std::uint32_t rows, std::uint32_t& next, std::uint32_t& taken,
                          const Of& of) {
  for (;;) {
    if (team.rank() == 0) team.store(taken, atomicAdd(&next, 1u));
    team.sync();
    const std::uint32_t row = team.load(taken);
    if (row >= rows) return;
    of(row);
    team.sync();
  }
}

/// Calls of(team, row, 0) for rows below `many`, by blocks, then of(team, row, warp) for rows below `few`, by
/// warps.
template <std::uint32_t kSize, typename Of>
__device__ void share_out(std::uint32_t many, std::uint32_t& next_many, std::uint32_t few,
                          std::uint32_t& next_few, const Of& of) {
  __shared__ BlockScratch<kSize> scratch;
  __shared__ std::uint32_t taken[kSize / 32];
  for (bool by_block = true;;) {
    const std::uint32_t own = by_block ? 0 : threadIdx.x / 32;
    const BlockTeam<kSize, true> team(by_block ? &scratch : nullptr, nullptr);
    if (team.rank() == 0) team.store(taken[own], atomicAdd(by_block ? &next_many : &next_few, 1u));
    team.sync();
    const std::uint32_t row = team.load(taken[own]);
    if (row < (by_block ? many : few)) {
      of(team, row, own);
    } else if (!by_block) {
      return;
    } else {
      by_block = false;
    }
    team.sync();
  }
}

}  // namespace tandem::gpu
