#pragma once
#include "kernels/common/launch.h"
#include "kernels/scene/broad_phase_output.cuh"

// The walk of the tree against itself.
namespace tandem {
namespace {

constexpr std::uint32_t kWarps = 4;      // of a thread block
constexpr std::uint32_t kWaiting = 256;  // hits that a warp holds back

struct alignas(16) WarpMemory {
  Node own[kFanOut];
  unsigned long long waiting[kWaiting];  // hits: own << 32 | leaf; pairs, once decided
};

// One group of 32 boxes against itself and all that come after, or a part of these.
template <typename Rule>
class Walk {
 public:
  // part: of the children of a node, which groups to take, a bit each.
  __device__ Walk(const Tree& tree, const WorldBox* boxes, const Rule& rule, const Output& output,
                  WarpMemory& memory, std::uint32_t group, std::uint32_t part)
      : tree_(tree),
        boxes_(boxes),
        rule_(rule),
        output_(output),
        memory_(memory),
        group_(group),
        part_(part) {
    mine_ = leaf(group * kFanOut + lane_index());
    has_worlds_ = rule.worlds() != nullptr;
    memory_.own[lane_index()] = mine_;
    around_ = tree_.level(1)[group];
    __syncwarp();
  }

  __device__ void run() {
    int level = tree_.top;
    std::uint32_t first = 0, pending = children_hit(level, first);
    // Lane i keeps what is left to do at level i.
    std::uint32_t kept_first = 0, kept_pending = 0;
    for (;;) {
      if (pending == 0) {
        if (level == tree_.top) break;
        ++level;
        first = __shfl_sync(kAllLanes, kept_first, level);
        pending = __shfl_sync(kAllLanes, kept_pending, level);
        continue;
      }
      const std::uint32_t child = first + lowest(pending);
      pending &= pending - 1;
      const Node& theirs = tree_.level(level)[child];
      const std::uint32_t rows = __ballot_sync(
          kAllLanes, may_meet(mine_, theirs) && (!has_worlds_ || mine_.leaf_worlds().meets(theirs.worlds())));
      if (rows == 0) continue;
      if (level == 1) {
        test_group(child, rows);
        continue;
      }
      if (lane_index() == static_cast<std::uint32_t>(level)) {
        kept_first = first;
        kept_pending = pending;
      }
      --level;
      first = child * kFanOut;
      pending = children_hit(level, first);
    }
    flush();
  }

 private:
  __device__ Node leaf(std::uint32_t i) const { return i < tree_.count[0] ? tree_.level(0)[i] : nothing(); }

  // Returns which of 32 nodes of a level the group may meet and are not wholly before it.
  __device__ std::uint32_t children_hit(int level, std::uint32_t first) const {
    const std::uint32_t i = first + lane_index();
    const bool hit = i < tree_.count[level] && i >= group_ >> kFanOutBits * (level - 1) &&
                     may_meet(around_, tree_.level(level)[i]) &&
                     (!has_worlds_ || around_.worlds().meets(tree_.level(level)[i].worlds()));
    return __ballot_sync(kAllLanes, hit) & (level == 1 ? part_ : kAllLanes);
  }

  __device__ bool leaves_may_meet(const Node& a, const Node& b) const {
    return may_meet(a, b) && (!has_worlds_ || worlds_meet(a.last, b.last));
  }

  // rows: lanes whose own box may meet the other group. The fewer of these and of the other's boxes that may
  // meet this group take turns.
  __device__ void test_group(std::uint32_t other, std::uint32_t rows) {
    const std::uint32_t first = other * kFanOut;
    const Node theirs = leaf(first + lane_index());
    const std::uint32_t columns =
        __ballot_sync(kAllLanes, may_meet(around_, theirs) &&
                                     (!has_worlds_ || around_.worlds().meets(theirs.leaf_worlds())));
    if (columns == 0) return;
    if (count_of(rows) <= count_of(columns)) {
      std::uint32_t hits = hits_of_rows(rows, theirs);
      if (other == group_) hits &= lanes_below();
      store(hits, first + lane_index(), 32);
    } else {
      store(hits_of_columns(columns, theirs), static_cast<unsigned long long>(lane_index()) << 32 | first, 0);
    }
  }

  // A bit for each own box: whether it may meet this lane's other box.
  __device__ std::uint32_t hits_of_rows(std::uint32_t rows, const Node& theirs) const {
    std::uint32_t hits = 0;
    while (rows != 0) {  // two at a time, or the last one twice
      const std::uint32_t low = lowest(rows),
                          high = 31 - static_cast<std::uint32_t>(__clz(static_cast<int>(rows)));
      const std::uint32_t two[2] = {1u << low, 1u << high};
      hits |= leaves_may_meet(memory_.own[low], theirs) ? two[0] : 0;
      hits |= leaves_may_meet(memory_.own[high], theirs) ? two[1] : 0;
      rows &= ~(two[0] | two[1]);
    }
    return hits;
  }

  // A bit for each other box: whether it may meet this lane's own one.
  __device__ std::uint32_t hits_of_columns(std::uint32_t columns, const Node& theirs) const {
    std::uint32_t hits = 0;
    for (; columns != 0; columns &= columns - 1) {
      const int column = static_cast<int>(lowest(columns));
      Node box;
      for (int k = 0; k < 3; ++k) {
        box.lo[k] = __shfl_sync(kAllLanes, theirs.lo[k], column);
        box.hi[k] = __shfl_sync(kAllLanes, theirs.hi[k], column);
      }
      box.last = __shfl_sync(kAllLanes, theirs.last, column);
      hits |= leaves_may_meet(mine_, box) ? 1u << column : 0;
    }
    return hits;
  }

  // Puts every lane's hits to those that wait: for bit i, hit + (i << shift).
  __device__ void store(std::uint32_t hits, unsigned long long hit, int shift) {
    std::uint32_t end = count_of(hits);
    for (std::uint32_t step = 1; step < kFanOut; step *= 2) {
      const std::uint32_t before = __shfl_up_sync(kAllLanes, end, step);
      end += lane_index() >= step ? before : 0;
    }
    const std::uint32_t all = __shfl_sync(kAllLanes, end, kFanOut - 1);
    if (all == 0) return;
    if (count_ + all > kWaiting) flush();
    if (all <= kWaiting) {
      for (end += count_; hits != 0; hits &= hits - 1)
        memory_.waiting[--end] = hit + (static_cast<unsigned long long>(lowest(hits)) << shift);
      count_ += all;
      return;
    }
    while (__any_sync(kAllLanes, hits != 0)) {  // one of each lane at a time
      const std::uint32_t hitting = __ballot_sync(kAllLanes, hits != 0);
      if (hits != 0)
        memory_.waiting[count_ + count_of(hitting & lanes_below())] =
            hit + (static_cast<unsigned long long>(lowest(hits)) << shift);
      hits &= hits - 1;
      count_ += count_of(hitting);
      if (count_ > kWaiting - kFanOut) flush();
    }
  }

  // Turns the waiting hits that are pairs into pairs.
  __device__ void decide() {
    __syncwarp();
    std::uint32_t decided = 0;
    for (std::uint32_t first = 0; first < count_; first += kFanOut) {
      bool meet = false;
      std::uint32_t a = 0, b = 0;
      if (first + lane_index() < count_) {
        const unsigned long long hit = memory_.waiting[first + lane_index()];
        const Node &own = memory_.own[hit >> 32], theirs = tree_.level(0)[static_cast<std::uint32_t>(hit)];
        a = min(own.box(), theirs.box());
        b = max(own.box(), theirs.box());
        meet = surely_meet(own, theirs) || overlap(boxes_[a], boxes_[b]);
        if (meet) meet = rule_(a, b);
      }
      const std::uint32_t meeting = __ballot_sync(kAllLanes, meet);
      __syncwarp();  // all have read what may now be overwritten
      if (meet) {
        memory_.waiting[decided + count_of(meeting & lanes_below())] = output_.key(a, b);
      }
      decided += count_of(meeting);
      __syncwarp();
    }
    count_ = decided;
  }

  // Stores what waits, as far as there is room.
  __device__ void flush() {
    decide();
    unsigned long long begin = 0;
    if (lane_index() == 0 && count_ > 0)
      begin = atomicAdd(&output_.counters->found, static_cast<unsigned long long>(count_));
    begin = __shfl_sync(kAllLanes, begin, 0);
    for (std::uint32_t i = lane_index(); i < count_; i += kFanOut) {
      if (begin + i < output_.capacity) output_.pairs[begin + i] = memory_.waiting[i];
    }
    __syncwarp();
    count_ = 0;
  }

  const Tree& tree_;
  const WorldBox* boxes_;
  const Rule& rule_;
  const Output& output_;
  WarpMemory& memory_;
  std::uint32_t group_, part_, count_ = 0;
  bool has_worlds_ = false;
  Node mine_, around_;
};

// `split` warps share a group: a power of two, at most 16.
template <typename Rule>
__global__ void __launch_bounds__(kWarps* kFanOut)
    collect_pairs(const __grid_constant__ Tree tree, std::uint32_t split, const WorldBox* boxes,
                  const __grid_constant__ Rule rule, const __grid_constant__ Output output) {
  __shared__ WarpMemory memories[kWarps];
  gpu::wait_for_kernel_before();
  const std::uint32_t warp = threadIdx.x / kFanOut;
  const std::uint64_t task = static_cast<std::uint64_t>(blockIdx.x) * kWarps + warp;
  if (task >= static_cast<std::uint64_t>(tree.count[1]) * split || output.counters->error != kNoError) return;
  const std::uint32_t part = kAllLanes / ((1u << split) - 1) << task % split;  // every split-th bit
  Walk<Rule>(tree, boxes, rule, output, memories[warp], static_cast<std::uint32_t>(task / split), part).run();
}

}  // namespace
}  // namespace tandem
