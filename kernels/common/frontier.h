#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/launch.h"
#include "kernels/common/pair_record.h"
#include "tandem/formats/block.h"

// Breadth-first rounds over the block pairs of all object pairs together. A round takes what the round before
// it put there, a few lanes for each entry, and appends what follows; one pair of huge meshes fills the GPU
// as well as many pairs of small ones do, and no warp waits for another. Rounds are kernels of their own:
// what one of them reads does not change while it runs, so all that it decides, and so all that it appends,
// is the same on every run; only the order of entries is not.
namespace tandem::gpu {

/// The most rounds that two trees take. Proof: let the level of a block be 1 for the root, and of a block
/// pair the sum of both. What follows from an entry has a higher level; the first round has level 2, and no
/// level is above 2 kMaxDepth.
TANDEM_HD constexpr std::uint32_t rounds_of(std::uint32_t depth_a, std::uint32_t depth_b) {
  return depth_a + depth_b - 1;
}
inline constexpr std::uint32_t kMostRounds = rounds_of(kMaxDepth, kMaxDepth);

/// An array in GPU memory to which kernels append. Entries beyond the capacity are counted and not stored.
template <typename Entry>
struct AppendList {
  Entry* entries;
  Counter* count;
  std::uint32_t capacity;
};

/// The entries of the rounds: those of a round lie beside those of the next, and take the place of those of
/// the round before. Counters are zero when the rounds begin.
template <typename Entry>
struct Frontier {
  Entry* entries;   ///< 2 * capacity of them
  Counter* counts;  ///< kMostRounds + 1 of them: how many each round has, those without room too
  std::uint32_t capacity;

  TANDEM_HD AppendList<Entry> round(std::uint32_t number) const {
    return {entries + (number % 2 == 0 ? 0 : capacity), counts + number, capacity};
  }
};

#ifdef __CUDACC__

/// Launches all rounds, kernels (args, number of the round) that call wait_for_kernel_before().
template <typename Args>
cudaError_t launch_rounds(const Grid& grid, void (*kernel)(Args, std::uint32_t), const Args& args,
                          std::uint32_t rounds) {
  cudaError_t error = cudaSuccess;
  for (std::uint32_t i = 0; i < rounds && error == cudaSuccess; ++i)
    error = launch_after(grid, kernel, args, i);
  return error;
}

/// Returns how many entries are stored. Condition: kernels that append have ended.
template <typename Entry>
__device__ inline std::uint32_t stored_in(const AppendList<Entry>& list) {
  const Counter count = *list.count;
  return count < list.capacity ? static_cast<std::uint32_t>(count) : list.capacity;
}

/// Shares entries of a list out among the warps of the grid, kLanes lanes for each, several turns at a time
/// where there are many: visit(first, turns) has the entries first + 32 / kLanes * turn, first being that of
/// the lane's part of the warp; they may lie beyond the count. All lanes of a warp call it together.
template <std::uint32_t kLanes, typename Visit>
__device__ inline void share_out(std::uint32_t count, std::uint32_t most_turns, const Visit& visit) {
  constexpr std::uint32_t kAtOnce = 32 / kLanes;
  const std::uint32_t warps = gridDim.x * (blockDim.x / 32),
                      warp = blockIdx.x * (blockDim.x / 32) + threadIdx.x / 32;
  const std::uint32_t fair = (count + kAtOnce * warps - 1) / (kAtOnce * warps);
  const std::uint32_t turns = fair < most_turns ? fair : most_turns;
  const std::uint64_t step = std::uint64_t{kAtOnce} * warps * turns;
  for (std::uint64_t begin = std::uint64_t{kAtOnce} * warp * turns; begin < count; begin += step)
    visit(static_cast<std::uint32_t>(begin) + lane_id() / kLanes, turns);
}

/// Collects what the lanes of a warp are about to append, up to kMost entries each, so that one atomic
/// operation is enough for all.
template <typename Entry, int kMost>
class AppendBatch {
 public:
  /// Condition: `turn` is known when the code is compiled, as in an unrolled loop, and was not put before.
  __device__ void put(int turn, const Entry& entry) {
    entry_[turn] = entry;
    has_ |= 1u << turn;
  }

  /// All lanes of the warp take part. The batch is empty afterwards.
  __device__ void append_to(const AppendList<Entry>& list) {
    std::uint32_t before[kMost], all = 0;
#pragma unroll
    for (int i = 0; i < kMost; ++i) {
      const std::uint32_t lanes = __ballot_sync(kAllLanes, (has_ >> i & 1) != 0);
      before[i] = all + __popc(lanes & lanes_below());
      all += __popc(lanes);
    }
    if (all == 0) return;
    Counter first = 0;
    if (lane_id() == 0) first = atomicAdd(list.count, static_cast<Counter>(all));
    first = __shfl_sync(kAllLanes, first, 0);
#pragma unroll
    for (int i = 0; i < kMost; ++i) {
      if ((has_ >> i & 1) != 0 && first + before[i] < list.capacity)
        list.entries[first + before[i]] = entry_[i];
    }
    has_ = 0;
  }

 private:
  Entry entry_[kMost];
  std::uint32_t has_ = 0;
};

#endif

}  // namespace tandem::gpu
