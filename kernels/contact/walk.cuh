#pragma once
#include "kernels/contact/contact_output.cuh"
#include "kernels/contact/sharing_warp.cuh"
#include "kernels/contact/walk_lane.cuh"
#include "kernels/contact/walk_shape.h"
#include "kernels/contact/walk_stack.cuh"
#include "kernels/contact/work_sharing.h"

// The walk of both trees of all object pairs, by warps that work on their own (docs/gpu_walk.md). A warp
// takes 32 block pairs off its stack (walk_stack.cuh), one a lane, tests them, and puts on those that hit.
// Pairs of leaf blocks gather until a warp is full of their candidates, which it decides. A warp that has
// nothing left takes object pairs, and when there are no more, what other warps give it (work_sharing.h).
// Nothing but contacts, and what float32 cannot decide, leaves the multiprocessor.
//
// Included by files that are compiled with and without fused operations: internal linkage.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kFewestPairsAtOnce = 4, kMostPairsAtOnce = 16;  // object pairs that a warp takes
constexpr std::uint32_t kFewestToShare = 32;                            // block pairs, for each gift
constexpr std::uint32_t kRoundsBetweenCounts = 1u << 26;  // a lane counts at most 16 in each, in 32 bits

static_assert(kBlockWords == kPositionWords &&
              kWarpWords == ContactOutput::kSharedWords + SharingWarp::kSharedWords);

/// The place of a warp's shared memory, and the lane. It is read back from memory, so that the compiler keeps
/// them in registers and does not compute them anew.
struct WarpPlace {
  std::uint32_t memory, lane;
};
__device__ inline WarpPlace warp_place(std::uint32_t memory) {
  store_shared(memory + 4 * (threadIdx.x % 32), threadIdx.x % 32);
  store_shared(memory + 128, memory);
  __syncwarp();
  const WarpPlace place = {load_shared(memory + 128), load_shared(memory + 4 * (threadIdx.x % 32))};
  __syncwarp();
  return place;
}

/// The walk of one warp. Means (walk_lane.cuh) says how a lane tests a block pair and decides a candidate.
/// All lanes call each function, but for those that say so.
/// kShares: whether warps give work to each other, the same for all warps of a walk.
template <class Means, bool kShares>
class Walk {
 public:
  __device__ Walk(const QueryArgs& args, std::uint32_t positions, std::uint32_t sums, WarpPlace place)
      : args_(args),
        sums_(sums),
        balance_(Means::kWorld ? args.state->world : args.state->frame),
        lane_(place.lane),
        output_(place.memory, place.lane),
        warp_(args, balance_, place.memory + 4 * ContactOutput::kSharedWords, place.lane),
        stack_(positions, place.memory + 4 * kWarpWords, args.shape.stack_size, place.lane) {}

  __device__ void run() {
    const std::uint32_t pairs = input();
    if (pairs == 0) return;
    if (kShares) sharing().begin();
    take_first_pairs(pairs);
    // Each of these is called in one place: the code is to stay small, for the caches of instructions.
    bool all_done = false;
    for (;;) {
      const std::uint32_t least = all_done ? 1 : kFull;
      while (stack_.candidates() >= least) settle(min(stack_.candidates(), kFull));
      if (all_done) break;
      stack_.make_room(args_.shape.reserve + kRoomForOldest);
      if (stack_.waiting() < kFull && more_input_) take_pairs();
      if (stack_.waiting() != 0)
        step();
      else if (!more_input_)
        all_done = !kShares || !receive();
    }
    output_.finish(args_);
    add_counters_of_block();
  }

 private:
  __device__ WorkSharing<SharingWarp> sharing() const { return WorkSharing<SharingWarp>(warp_); }

  __device__ std::uint32_t input() const {
    return Means::kWorld ? args_.state->world_pairs : pair_count(args_);
  }

  __device__ std::uint32_t warps() const { return gridDim.x * args_.shape.warps; }

  /// Returns how many object pairs each warp takes where there are so many. Without sharing, few are spread
  /// over all warps.
  __device__ std::uint32_t share_of(std::uint32_t pairs) const {
    const std::uint32_t share =
        kShares ? max(pairs / warps(), kFewestPairsAtOnce) : (pairs + warps() - 1) / warps();
    return min(share, kMostPairsAtOnce);
  }

  /// The first without asking.
  __device__ void take_first_pairs(std::uint32_t pairs) {
    const std::uint32_t share = share_of(pairs);
    more_input_ = share * warps() < pairs;
    put_pairs(share * (threadIdx.x / 32 * gridDim.x + blockIdx.x), share, pairs);
  }

  /// Takes a few of the other object pairs, fewer as they run out. next_pair counts these.
  __device__ void take_pairs() {
    const std::uint32_t pairs = input(), before = warps() * share_of(pairs), others = pairs - before;
    std::uint32_t first = others, wanted = 0;
    if (lane_ == 0) {
      const std::uint32_t taken = *static_cast<volatile std::uint32_t*>(&balance_.next_pair);
      if (taken < others) {
        wanted = share_of(others - taken);
        first = atomicAdd(&balance_.next_pair, wanted);
      }
    }
    first = __shfl_sync(kAllLanes, first, 0);
    if (first >= others)
      more_input_ = false;
    else
      put_pairs(before + first, __shfl_sync(kAllLanes, wanted, 0), pairs);
  }

  __device__ void put_pairs(std::uint32_t first, std::uint32_t count, std::uint32_t pairs) {
    bool mine = lane_ < count && first < pairs && lane_ < pairs - first;
    std::uint32_t pair = first + lane_;
    bool self = false;
    if (mine && Means::kWorld) pair = args_.world_pairs[pair];
    if (mine && !Means::kWorld) mine = args_.pairs[pair].in_frame != 0;
    if (mine) self = args_.pairs[pair].instance_a == args_.pairs[pair].instance_b;
    stack_.put_roots(mine, pair, Means::Blocks::kRoots, self);
  }

  /// Takes up to 32 block pairs off, tests them and puts on those that hit.
  __device__ void step() {
    if constexpr (kShares) warp_.begin_look();  // comes while the boxes are tested
    const Taken taken = stack_.take_block_pairs(
        block_pairs_to_take(stack_.waiting(), stack_.room(), args_.shape.reserve), takes_oldest());
    const bool mine = taken.mine && is_open(taken.entry.x);
    Tested tested = {{taken.entry.x, 0, 0, 0}, false};
    if (mine) tested = test(taken);
    block_pairs_ += mine;
    if constexpr (Means::kCountsOnly) {
      if (tested.of_leaves) candidates_ += __popc(tested.entry.w & 0xFFFFu), tested.entry.w = 0;
    }
    stack_.put(tested.entry, tested.of_leaves);
    if constexpr (kShares) {
      warp_.end_look();
      if (stack_.waiting() >= kFewestToShare) share();
    }
    if (++rounds_ >= kRoundsBetweenCounts) add_counters(), rounds_ = 0;
  }

  /// Returns whether the next step takes the oldest block pairs. A walk that looks for first contacts reaches
  /// triangles sooner from the newest.
  __device__ bool takes_oldest() const {
    return kShares && !more_input_ && !args_.first_contact_only &&
           has_room_for_oldest(stack_.room(), args_.shape.reserve);
  }

  /// Returns false where the first contact is enough and the pair has one. One lane calls it.
  __device__ bool is_open(std::uint32_t pair) const {
    return !args_.first_contact_only || *static_cast<volatile std::uint32_t*>(&args_.met[pair]) == 0;
  }

  /// The part of a block pair that is left to do.
  struct Tested {
    uint4 entry;
    bool of_leaves;
  };

  /// Tests the block pair that a lane took off. One lane calls it.
  __device__ Tested test(const Taken& taken) const {
    const PairRecord& record = args_.pairs[taken.entry.x];
    const Below now = below_of<typename Means::Blocks>(record, taken.entry, taken.bit);
    Side side_a, side_b;
    std::uint32_t hits = Means::test(args_, record, now.a, now.b, side_a, side_b) & now.nodes;
    const bool leaf_a = side_a.is_leaf_block(), leaf_b = side_b.is_leaf_block();
    if ((taken.entry.z & kSelf) != 0 && now.a == now.b) hits &= own_node_pairs(leaf_a);
    if constexpr (Means::kTriesPlanes) {
      if (leaf_a != leaf_b && hits != 0 && worth_planes(leaf_a, side_a.size, side_b.size))
        hits = Means::drop_beyond_planes(record, now.a, now.b, hits);
    }
    if constexpr (Means::kMayLeaveOut) {
      if (leaf_a && leaf_b && (taken.entry.z & kSelf) != 0 && args_.neighbourhoods != nullptr)
        hits = without_neighbours(args_, record, side_a.below & ~OrientedBlock::kIsLeafBlock,
                                  side_b.below & ~OrientedBlock::kIsLeafBlock, hits);
    }
    if (leaf_a && leaf_b) return {entry_of(taken, hits, Descent::both, now, side_a, side_b), true};
    const Descent goes_on = leaf_a != leaf_b
                                ? descent_beside_leaves(leaf_a)
                                : descent_by_size(side_a.size, side_b.size, Means::Blocks::kDescends);
    uint4 entry = entry_of(taken, hits, goes_on, now, side_a, side_b);
    entry.y |= static_cast<std::uint32_t>(goes_on) << kNumberBits;
    entry.z |= taken.entry.z & kSelf;
    return {entry, false};
  }

  /// The entry of a block pair whose node pairs in `hits` meet, but for the bits above the numbers of blocks,
  /// which numbers of triangles may need. One lane calls it.
  __device__ static uint4 entry_of(const Taken& taken, std::uint32_t hits, Descent goes_on, const Below& now,
                                   const Side& side_a, const Side& side_b) {
    std::uint32_t left = hits;
    if (goes_on == Descent::b_alone) {
      left |= hits >> 4;
      left = (left | left >> 8) & 0xFu;
    }
    if (goes_on == Descent::a_alone) {
      left |= hits >> 1;
      left = (left | left >> 2) & 0x1111u;
    }
    return {taken.entry.x, goes_on == Descent::b_alone ? now.a : side_a.below & ~OrientedBlock::kIsLeafBlock,
            goes_on == Descent::a_alone ? now.b : side_b.below & ~OrientedBlock::kIsLeafBlock,
            left | hits << 16};
  }

  /// Decides the last candidates; count <= 32.
  __device__ void settle(std::uint32_t count) {
    const Taken taken = stack_.take_candidates(count);
    candidates_ += taken.mine;
    judge(taken.mine, taken.entry.x, taken.entry.y + taken.bit / 4, taken.entry.z + taken.bit % 4);
  }

  __device__ void judge(bool mine, std::uint32_t pair, std::uint32_t a, std::uint32_t b) {
    Judged judged = {0, 0, false, false};
    if (mine) judged = Means::judge(args_, pair, a, b);
    if (__any_sync(kAllLanes, judged.undecided)) {
      const Counter place = place_for(judged.undecided, &args_.state->undecided);
      if (judged.undecided && place < args_.capacity.undecided) args_.undecided[place] = {pair, a, b};
    }
    Contact contact = {};
    if (judged.contact) judged.contact = is_wanted(args_, pair);
    if (judged.contact) {
      const bool self = args_.pairs[pair].instance_a == args_.pairs[pair].instance_b;
      contact = make_contact(pair, self, a, b, judged.face_a, judged.face_b);
    }
    output_.add(args_, judged.contact, contact);
  }

  /// Gives the oldest entries to warps that wait for some. Condition: so many block pairs wait that they have
  /// two entries at least.
  __device__ void share() {
    static_assert(kFewestToShare > 16);
    const std::uint32_t gifts =
        sharing().gifts_wanted(min(min(stack_.waiting() / kFewestToShare, kMostGifts), stack_.height() - 1));
    if (gifts == 0) return;
    const std::uint32_t ticket = sharing().announce(gifts);
    const std::uint32_t count = min(stack_.height() / (gifts + 1), kFull);
    for (std::uint32_t i = 0; i < gifts; ++i) {
      stack_.take_oldest(count, [&](auto take_off) { sharing().give(ticket + i, count, take_off); });
    }
  }

  /// Waits for entries that another warp gives. False: all work is done.
  __device__ bool receive() {
    return stack_.put_given([&](auto put_on) { return sharing().receive(put_on); }) != 0;
  }

  /// Returns the sum over the warp.
  __device__ static Counter sum_of(std::uint32_t count) {
    const std::uint32_t high = __reduce_add_sync(kAllLanes, count >> 16),
                        low = __reduce_add_sync(kAllLanes, count & 0xFFFFu);
    return (static_cast<Counter>(high) << 16) + low;
  }

  __device__ void add_to_query(Counter block_pairs, Counter candidates) const {
    if ((block_pairs | candidates) == 0) return;
    atomicAdd(&args_.state->block_pairs, block_pairs);
    atomicAdd(&args_.state->candidates, candidates);
  }

  /// Adds what the lanes counted; before 32 bits are full.
  __device__ void add_counters() {
    const Counter block_pairs = sum_of(block_pairs_), candidates = sum_of(candidates_);
    if (lane_ == 0) add_to_query(block_pairs, candidates);
    block_pairs_ = candidates_ = 0;
  }

  /// Adds what the lanes counted, once for all warps of the block: all warps of a walk would wait for each
  /// other at the query's counters. Called once.
  __device__ void add_counters_of_block() {
    const Counter block_pairs = sum_of(block_pairs_), candidates = sum_of(candidates_);
    if (lane_ != 0) return;
    const bool small = (block_pairs | candidates) < kSmall;
    if (!small) add_to_query(block_pairs, candidates);
    add_shared(sums_, small ? static_cast<std::uint32_t>(block_pairs) : 0);
    add_shared(sums_ + 4, small ? static_cast<std::uint32_t>(candidates) : 0);
    __threadfence_block();
    if (add_shared(sums_ + 8, 1) != args_.shape.warps - 1) return;
    __threadfence_block();
    add_to_query(add_shared(sums_, 0), add_shared(sums_ + 4, 0));
  }

  static constexpr Counter kSmall = (Counter{1} << 32) / kMostWarpsPerBlock;  // so that a block's fit 32 bits

  const QueryArgs& args_;
  const std::uint32_t sums_;  // address: block pairs and candidates of the block, and warps that added theirs
  Balance& balance_;
  const std::uint32_t lane_;
  ContactOutput output_;
  const SharingWarp warp_;
  WalkStack stack_;
  std::uint32_t rounds_ = 0;
  std::uint32_t block_pairs_ = 0, candidates_ = 0;  // tested and decided by this lane
  bool more_input_ = true;
};

/// Address of the three words in which a block adds up its counters: the first warp has them free.
__device__ inline std::uint32_t sums_of_block(std::uint32_t memory) {
  return memory + 4 * (kBlockWords + ContactOutput::kSharedWords + SharingWarp::kFreeWord);
}

/// Prepares shared memory before a walk of the block.
__device__ inline void prepare_memory(float4* memory) {
  fill_positions(reinterpret_cast<std::uint32_t*>(memory));
  if (threadIdx.x < SharingWarp::kFreeWords)
    store_shared(
        sums_of_block(static_cast<std::uint32_t>(__cvta_generic_to_shared(memory))) + 4 * threadIdx.x, 0);
  __syncthreads();
}

/// The walk of a thread block. Condition: prepare_memory().
template <class Means, bool kShares>
__device__ void run_walk(const QueryArgs& args, float4* memory) {
  const auto positions = static_cast<std::uint32_t>(__cvta_generic_to_shared(memory));
  const std::uint32_t warp = threadIdx.x / 32;
  Walk<Means, kShares> walk(
      args, positions, sums_of_block(positions),
      warp_place(positions + 4 * (kBlockWords + warp * (kWarpWords + kEntryWords * args.shape.stack_size))));
  walk.run();
}

template <class Means, bool kShares>
__global__ void __launch_bounds__(32 * kMostWarpsPerBlock, 1) walk(const __grid_constant__ QueryArgs args) {
  extern __shared__ float4 memory[];
  prepare_memory(memory);
  wait_for_kernel_before();
  if (!failed(args)) run_walk<Means, kShares>(args, memory);
}

/// Launches a kernel of thread blocks in the shape of a walk.
inline cudaError_t launch_shaped(void (*kernel)(QueryArgs), const QueryArgs& args, cudaStream_t stream) {
  // This value is the same for every walk: CUDA keeps it with the kernel, and another thread's walk may need
  // more.
  const cudaError_t error = cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                                 static_cast<int>(most_shared_bytes(args.limits)));
  if (error != cudaSuccess) return error;
  const WalkShape& shape = args.shape;
  return launch_after(
      {shape.blocks, 32 * shape.warps, shape.shared_bytes(), stream, args.limits.early_launch}, kernel, args);
}

template <class Means>
cudaError_t launch_walk_of(const QueryArgs& args, cudaStream_t stream) {
  return launch_shaped(args.shape.shares ? walk<Means, true> : walk<Means, false>, args, stream);
}

template <class Means>
cudaError_t launch_walk(const QueryArgs& args, cudaStream_t stream) {
  return args.neighbourhoods != nullptr ? launch_walk_of<LeavingOut<Means>>(args, stream)
                                        : launch_walk_of<Means>(args, stream);
}

}  // namespace
}  // namespace tandem::gpu
