#pragma once
#include "kernels/scene/broad_phase_boxes.cuh"
#include "kernels/scene/broad_phase_output.cuh"

// Few boxes: each is tested against each, by one kernel that does all.
//
// Float32 ends as in the tree, by another monotone function, float(x) = fl32(fl(x - middle)): boxes that meet
// still do. The few that may meet are decided by float64. Boxes are numbered in tiles of 64, and a task is a
// pair of tiles.
namespace tandem {
namespace {

constexpr std::uint32_t kTile = 64;
constexpr std::uint32_t kTileThreads = 2 * kTile;
constexpr std::uint32_t kTileWarps = kTileThreads / kFanOut;
constexpr std::uint32_t kShare = kTile / kTileWarps;  // a warp's of the other tile: 16 boxes

// Counters::found holds pairs in its low bits and blocks that are done in the others: one addition makes room
// for a block's pairs and tells whether it is the last. 2^13 boxes make less than 2^26 pairs with each other
// and less than 2^45 with others that are kept; blocks are kMostDirectBlocks at most.
constexpr int kFoundBits = 48;

struct Tiles {
  WorldBox exact[2][kTile];  // of the own tile, of the other
  Node rounded[2][kTile];
  Node around[kTileWarps];          // the own tile, for each warp
  std::uint32_t count[kTileWarps];  // pairs that a warp found
  unsigned long long begin;         // where the block's pairs go
};

// Bits below `end`, of 16.
__device__ std::uint32_t bits_below(int end) {
  return (1u << min(max(end, 0), 16)) - 1;
}

// The lower tile of a pair is the other, the higher one the block's own.
template <typename Boxes, typename Rule>
class Direct {
 public:
  __device__ Direct(const Boxes& boxes, std::uint32_t count, const Rule& rule, const Output& output,
                    Tiles& tiles)
      : boxes_(boxes), count_(count), rule_(rule), output_(output), tiles_(tiles) {}

  // Tasks from `task` up to `end`, of which there is one.
  __device__ void run(std::uint32_t task, std::uint32_t end) {
    begin_at(task);
    fetch(0, own_, threadIdx.x / kTile == 1);
    bool fresh = true;  // the own tile
    for (;;) {
      fetch(1, other_, threadIdx.x / kTile == 0);
      __syncthreads();
      if (fresh) surround_own();
      fresh = false;
      const std::uint32_t hits = decided(hits_of_rounded());
      const bool last = ++task == end;
      store(hits, last);
      if (last) return;
      if (other_++ < own_) continue;
      other_ = 0;
      ++own_;
      fetch(0, own_, threadIdx.x / kTile == 1);
      fresh = true;
    }
  }

 private:
  // Tasks in this order: (own, other) = (0, 0), (1, 0), (1, 1), (2, 0), ...
  __device__ void begin_at(std::uint32_t task) {
    own_ = static_cast<std::uint32_t>((sqrtf(8.0f * static_cast<float>(task) + 1) - 1) / 2);
    while (own_ * (own_ + 1) / 2 > task) --own_;
    while ((own_ + 1) * (own_ + 2) / 2 <= task) ++own_;
    other_ = task - own_ * (own_ + 1) / 2;
  }

  // Tile `tile` into shared memory, one box for each thread that is to. The own ones are checked in the task
  // of a tile with itself.
  __device__ void fetch(int side, std::uint32_t tile, bool mine) {
    if (!mine) return;
    const std::uint32_t i = tile * kTile + threadIdx.x % kTile;
    WorldBox box = {};
    Node node = nothing();
    if (i < count_) {
      if (side == 1 && own_ == other_) {
        good_ &= take(boxes_, i, output_.counters, box);
      } else {
        static_cast<void>(boxes_.get(i, box));
      }
      for (int k = 0; k < 3; ++k) {
        const double origin = middle(k);
        node.lo[k] = static_cast<float>(box.lo[k] - origin);
        node.hi[k] = static_cast<float>(box.hi[k] - origin);
      }
      if (rule_.worlds() != nullptr) node.last = rule_.worlds()[boxes_.number(i)];
    }
    tiles_.exact[side][threadIdx.x % kTile] = box;
    tiles_.rounded[side][threadIdx.x % kTile] = node;
  }

  // The median of three boxes: one that has flown away costs the others no resolution. Where it is not
  // finite, one of them is not in range, and there are no pairs.
  __device__ double middle(int axis) const {
    const double a = boxes_.near(0, axis), b = boxes_.near(count_ / 2, axis),
                 c = boxes_.near(count_ - 1, axis);
    return fmax(fmin(a, b), fmin(fmax(a, b), c));
  }

  __device__ void surround_own() {
    const Node a = tiles_.rounded[0][lane_], b = tiles_.rounded[0][lane_ + kFanOut];
    Node both = {};
    for (int k = 0; k < 3; ++k) {
      both.lo[k] = fminf(a.lo[k], b.lo[k]);
      both.hi[k] = fmaxf(a.hi[k], b.hi[k]);
    }
    both = union_of_warp(both, {});
    if (lane_ == 0) tiles_.around[threadIdx.x / kFanOut] = both;
    __syncwarp();
  }

  // A lane has the own boxes `lane` and `lane + 32`: of these the boxes of the warp's share that they may
  // meet, 16 bits each.
  __device__ std::uint32_t hits_of_rounded() const {
    // Neighbours in space that are neighbours by number too: most shares are out of the own tile's reach.
    if (!__any_sync(kAllLanes, may_meet(tiles_.around[threadIdx.x / kFanOut],
                                        tiles_.rounded[1][share_ + lane_ % kShare])))
      return 0;
    const Node mine[2] = {tiles_.rounded[0][lane_], tiles_.rounded[0][lane_ + kFanOut]};
    std::uint32_t hits = 0;
#pragma unroll
    for (std::uint32_t i = 0; i < kShare; ++i) {
      const Node& theirs = tiles_.rounded[1][share_ + i];
      hits |= may_meet(mine[0], theirs) && worlds_meet(mine[0], theirs) ? 1u << i : 0;
      hits |= may_meet(mine[1], theirs) && worlds_meet(mine[1], theirs) ? 1u << 16 << i : 0;
    }
    if (own_ != other_) return hits;
    const int before = static_cast<int>(lane_) - static_cast<int>(share_);
    return hits & (bits_below(before) | bits_below(before + static_cast<int>(kFanOut)) << 16);
  }

  __device__ bool worlds_meet(const Node& a, const Node& b) const {
    return rule_.worlds() == nullptr || tandem::worlds_meet(a.last, b.last);
  }

  __device__ std::uint32_t own_of(std::uint32_t bit) const {
    return lane_ + bit / 16 * kFanOut;
  }
  __device__ std::uint32_t other_of(std::uint32_t bit) const {
    return share_ + bit % 16;
  }

  // The boxes' own numbers.
  __device__ std::uint32_t own_number(std::uint32_t bit) const {
    return boxes_.number(own_ * kTile + own_of(bit));
  }
  __device__ std::uint32_t other_number(std::uint32_t bit) const {
    return boxes_.number(other_ * kTile + other_of(bit));
  }

  __device__ std::uint32_t decided(std::uint32_t hits) const {
    for (std::uint32_t left = hits; left != 0; left &= left - 1) {
      const std::uint32_t bit = lowest(left);
      if (!overlap(tiles_.exact[0][own_of(bit)], tiles_.exact[1][other_of(bit)]) ||
          !rule_(other_number(bit), own_number(bit)))
        hits &= ~(1u << bit);
    }
    return hits;
  }

  // Writes the block's pairs; at the end of the last block, the report too.
  __device__ void store(std::uint32_t hits, bool last) {
    std::uint32_t end = count_of(hits);
    if (__any_sync(kAllLanes, hits != 0)) {
      for (std::uint32_t step = 1; step < kFanOut; step *= 2) {
        const std::uint32_t before = __shfl_up_sync(kAllLanes, end, step);
        end += lane_ >= step ? before : 0;
      }
    }
    if (lane_ == kFanOut - 1) tiles_.count[threadIdx.x / kFanOut] = end;
    // Who told of an error is seen to by the fence.
    if (__syncthreads_or(!good_)) __threadfence();
    std::uint32_t all = 0, first = 0;
    for (std::uint32_t warp = 0; warp < kTileWarps; ++warp) {
      if (warp == threadIdx.x / kFanOut) first = all;
      all += tiles_.count[warp];
    }
    if (all == 0 && !last) return;
    if (threadIdx.x == 0) tiles_.begin = make_room(all, last);
    if (all == 0) return;
    __syncthreads();
    unsigned long long place = tiles_.begin + first + end - count_of(hits);
    for (; hits != 0; hits &= hits - 1) {
      const std::uint32_t bit = lowest(hits);
      output_.write(place++, other_number(bit), own_number(bit));
    }
  }

  __device__ unsigned long long make_room(std::uint32_t pairs, bool last) const {
    constexpr unsigned long long kOneBlock = 1ull << kFoundBits;
    const unsigned long long before = atomicAdd(&output_.counters->found, pairs + (last ? kOneBlock : 0)),
                             begin = before % kOneBlock;
    if (last && before / kOneBlock == gridDim.x - 1) {
      __threadfence();
      write_report(output_, begin + pairs);
    }
    return begin;
  }

  const Boxes& boxes_;
  std::uint32_t count_;
  const Rule& rule_;
  const Output& output_;
  Tiles& tiles_;
  std::uint32_t own_ = 0, other_ = 0;
  bool good_ = true;
  std::uint32_t lane_ = threadIdx.x % kFanOut, share_ = threadIdx.x / kFanOut * kShare;
};

// `tasks` for each block, the last one's maybe fewer.
template <typename Boxes, typename Rule>
__global__ void __launch_bounds__(kTileThreads)
    collect_directly(const __grid_constant__ Boxes boxes, std::uint32_t count,
                     const __grid_constant__ Rule rule, const __grid_constant__ Output output,
                     std::uint32_t tasks, std::uint32_t all_tasks) {
  __shared__ Tiles tiles;
  gpu::wait_for_kernel_before();
  const std::uint32_t first = blockIdx.x * tasks;
  Direct<Boxes, Rule>(boxes, count, rule, output, tiles).run(first, min(first + tasks, all_tasks));
}

}  // namespace
}  // namespace tandem
