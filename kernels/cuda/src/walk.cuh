#pragma once
#include <algorithm>

#include "walk_lane.cuh"

// The walk of both trees of all object pairs, by warps that work on their own: each keeps the block pairs
// that wait on a stack in shared memory, takes 32 off at a time, a block pair a lane, and puts on what is
// below the hits. Candidates gather at the other end of the same memory until a warp is full of them. Nothing
// but contacts, and what float32 cannot decide, leaves the multiprocessor.
//
// A warp that has nothing left takes object pairs; when there are no more, it takes a number and waits at the
// mailbox with that number. Warps that have enough look now and then whether numbers were given out, and fill
// the next mailbox. The last warp that runs out of work sends the others home. No warp waits for one that has
// not started.
//
// Included by files that are compiled with and without fused operations: internal linkage.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kFull = 32;               // block pairs or candidates of a full warp
constexpr std::uint32_t kMostPairsAtOnce = 16;    // object pairs that a warp takes
constexpr std::uint32_t kRoundsBetweenLooks = 2;  // at whether another warp waits
constexpr std::uint32_t kFewestToShare = 32;
constexpr std::uint32_t kMostGifts = 4;
constexpr std::uint32_t kNoMore = 0xFFFFFFFFu;  // in a mailbox
constexpr std::uint32_t kOutRoom = 64;
constexpr float kTimesLarger = 4;  // where planes of leaves are worth it, as narrow_phase_walk.h says

// An entry of the stack names two blocks by 29 bits each. The upper bits say which node pairs count, where a
// leaf block met an internal one: a nibble of the leaf block's nodes, and which block that is.
constexpr std::uint32_t kIndexBits = 29;
constexpr std::uint32_t kIndexMask = (1u << kIndexBits) - 1;
constexpr std::uint32_t kAllNodes = 15;

struct Entry {
  std::uint32_t a, b;
};

__device__ inline Entry make_entry(std::uint32_t a, std::uint32_t b, std::uint32_t nodes, bool nodes_of_a) {
  return {a | nodes << kIndexBits, b | ((nodes >> 3) | static_cast<std::uint32_t>(nodes_of_a) << 1)
                                           << kIndexBits};
}

__device__ inline std::uint32_t mask_of(const Entry& entry) {
  const std::uint32_t high_b = entry.b >> kIndexBits;
  const std::uint32_t nodes = entry.a >> kIndexBits | (high_b & 1u) << 3;
  const std::uint32_t rows = (nodes & 1u) | (nodes & 2u) << 3 | (nodes & 4u) << 6 | (nodes & 8u) << 9;
  return (high_b & 2u) != 0 ? rows * 0xFu : nodes * 0x1111u;
}

/// The nodes i of a with a bit 4 i in the mask.
__device__ inline std::uint32_t nodes_of_column(std::uint32_t mask) {
  return (mask & 1u) | (mask >> 3 & 2u) | (mask >> 6 & 4u) | (mask >> 9 & 8u);
}

/// The shared memory of one warp, in words: the indices of the blocks at hand, contacts that wait, three
/// arrays of `size` entries.
__host__ __device__ constexpr std::uint32_t warp_words(std::uint32_t size) {
  return 8 * kFull + 5 * kOutRoom + (3 * size + 3) / 4 * 4;
}

template <class Means>
class Walk {
 public:
  __device__ Walk(const QueryArgs& args, std::uint32_t* memory, std::uint32_t warps)
      : args_(args),
        balance_(Means::kWorld ? args.state->world : args.state->frame),
        size_(args.stack_size),
        index_rows_(reinterpret_cast<uint4*>(memory)),
        out_(memory + 8 * kFull),
        pair_(out_ + 5 * kOutRoom),
        a_(pair_ + args.stack_size),
        b_(a_ + args.stack_size),
        warps_(warps) {}

  __device__ void run() {
    input_ = Means::kWorld ? args_.state->world_pairs : pair_count(args_);
    if (input_ == 0) return;
    more_input_ = true;
    last_seen_ = 0;
    if (lane_id() == 0) atomicAdd(&balance_.active, 1u);
    for (;;) {
      while (candidates_ >= kFull) settle(kFull);
      if (height_ < kFull && more_input_) take_pairs();
      if (height_ == 0) {
        if (candidates_ != 0) settle(candidates_);
        if (!more_input_ && !wait_for_gift()) break;
        continue;
      }
      step();
    }
    flush(out_count_);
    if (lane_id() == 0) {
      atomicAdd(&args_.state->block_pairs, block_pairs_);
      atomicAdd(&args_.state->candidates, candidates_seen_);
    }
  }

 private:
  /// Takes a few object pairs, fewer as they run out.
  __device__ void take_pairs() {
    const std::uint32_t left = input_ - last_seen_;
    std::uint32_t wanted = left / warps_;
    wanted = wanted < 1 ? 1 : wanted > kMostPairsAtOnce ? kMostPairsAtOnce : wanted;
    std::uint32_t first = 0;
    if (lane_id() == 0) first = atomicAdd(&balance_.next_pair, wanted);
    first = __shfl_sync(kAllLanes, first, 0);
    if (first >= input_) {
      more_input_ = false;
      return;
    }
    last_seen_ = first;
    const std::uint32_t got = wanted < input_ - first ? wanted : input_ - first;
    bool mine = lane_id() < got;
    std::uint32_t pair = first + lane_id();
    if (mine && Means::kWorld) pair = args_.world_pairs[pair];
    if (mine && !Means::kWorld) mine = args_.pairs[pair].in_frame != 0;
    const std::uint32_t lanes = __ballot_sync(kAllLanes, mine);
    if (mine) put(height_ + __popc(lanes & lanes_below()), pair, make_entry(0, 0, kAllNodes, false));
    height_ += __popc(lanes);
    __syncwarp();
  }

  __device__ void put(std::uint32_t at, std::uint32_t pair, const Entry& entry) {
    pair_[at] = pair;
    a_[at] = entry.a;
    b_[at] = entry.b;
  }

  /// Takes up to 32 block pairs off, tests them and puts on what is below: at most 16 for each, of children
  /// or of candidates. Where that would not fit, as many as fit go on, and the others stay as they were, or
  /// all but the last put on. A single one always fits into the reserve, and, being the last put on, so does
  /// all that is below it: from there on a step puts 15 on net only where both sides go down a level, and at
  /// most 3 where one does, so stack_reserve is 15 for each level of the deeper tree but one; candidates are
  /// settled in between.
  __device__ void step() {
    const std::uint32_t count = height_ < kFull ? height_ : kFull;
    const bool looks = ++rounds_ % kRoundsBetweenLooks == 0;
    uint4 seen = {0, 0, 0, 0};
    if (looks) seen = look();  // comes while the boxes are tested
    bool mine = lane_id() < count;
    std::uint32_t pair = 0;
    Entry entry = {0, 0};
    const Block *block_a = nullptr, *block_b = nullptr;
    const PairRecord* record = nullptr;
    if (mine) {
      const std::uint32_t at = height_ - count + lane_id();
      pair = pair_[at];
      entry = {a_[at], b_[at]};
      if (args_.first_contact_only) mine = *static_cast<volatile std::uint32_t*>(&args_.met[pair]) == 0;
    }
    if (mine) {
      record = &args_.pairs[pair];
      block_a = record->blocks_a + (entry.a & kIndexMask);
      block_b = record->blocks_b + (entry.b & kIndexMask);
    }
    std::uint32_t hits = 0, below = 0, leaves = 0;  // leaves: bit 0: a is a leaf block, bit 1: b is
    if (mine) {
      const bool leaf_a = is_leaf_block(block_a), leaf_b = is_leaf_block(block_b);
      float size_a, size_b;
      hits = Means::test(args_, *record, block_a, block_b, size_a, size_b) & mask_of(entry);
      leaves = static_cast<std::uint32_t>(leaf_a) | static_cast<std::uint32_t>(leaf_b) << 1;
      if (hits != 0) {
        index_rows_[2 * lane_id()] = __ldg(reinterpret_cast<const uint4*>(block_a->index));
        index_rows_[2 * lane_id() + 1] = __ldg(reinterpret_cast<const uint4*>(block_b->index));
        if (((entry.a ^ entry.b) & kIndexMask) == 0 && record->instance_a == record->instance_b)
          hits &= leaves != 0 ? kNodePairsAbove : kNodePairsAbove | kNodePairsEqual;
        if (leaves == 1 ? size_a > kTimesLarger * size_b : leaves == 2 && size_b > kTimesLarger * size_a)
          hits = Means::drop_beyond_planes(*record, *block_a, *block_b, leaf_a, hits);
        if (leaves == 0)
          leaves = size_a > kDescendsAlone * size_b ? 2 : size_b > kDescendsAlone * size_a ? 1 : 0;
      }
      below = hits;
      if (leaves == 1) {
        below |= hits >> 4;
        below = (below | below >> 8) & 0xFu;
      } else if (leaves == 2) {
        below |= hits >> 1;
        below = (below | below >> 2) & 0x1111u;
      }
    }
    std::uint32_t sum = sum_below(below, leaves);
    std::uint32_t total = __shfl_sync(kAllLanes, sum, 31), kept = 0;
    const int room =
        static_cast<int>(size_ - args_.stack_reserve) - static_cast<int>(candidates_ + height_ - count);
    const int all = static_cast<int>((total & 0xFFFFu) + (total >> 16));
    if (all > room) {
      // Those before this lane would stay, with nothing put on for them.
      const std::uint32_t before = sum - (__popc(below) << (leaves == 3 ? 16 : 0));
      const int left =
          all - static_cast<int>((before & 0xFFFFu) + (before >> 16)) + static_cast<int>(lane_id());
      const std::uint32_t fits = __ballot_sync(kAllLanes, left <= room && lane_id() < count);
      kept = fits != 0 ? __ffs(static_cast<int>(fits)) - 1 : count - 1;
      if (lane_id() < kept) below = 0;
      sum = sum_below(below, leaves);
      total = __shfl_sync(kAllLanes, sum, 31);
    }
    block_pairs_ += __popc(__ballot_sync(kAllLanes, mine && lane_id() >= kept));
    height_ -= count - kept;
    expand(pair, entry, hits | leaves << 16, below, sum, total);
    if (looks && height_ >= kFewestToShare) share(seen);
  }

  __device__ static bool is_leaf_block(const Block* block) {
    return __ldg(reinterpret_cast<const std::uint32_t*>(block->kind)) ==
           static_cast<std::uint32_t>(NodeKind::leaf);
  }

  /// How many come of this lane and those before it: children in the low half, candidates in the high one.
  __device__ static std::uint32_t sum_below(std::uint32_t below, std::uint32_t leaves) {
    std::uint32_t sum = __popc(below) << (leaves == 3 ? 16 : 0);
#pragma unroll
    for (int d = 1; d < 32; d *= 2) {
      const std::uint32_t other = __shfl_up_sync(kAllLanes, sum, d);
      if (static_cast<int>(lane_id()) >= d) sum += other;
    }
    return sum;
  }

  /// First each lane leaves a note, its number and a bit, wherever something of it is to come; then lanes
  /// carry out the notes, 32 at a time.
  __device__ void expand(std::uint32_t pair, const Entry& entry, std::uint32_t hits_and_leaves,
                         std::uint32_t below, std::uint32_t sum, std::uint32_t total) {
    __syncwarp();  // what is overwritten now, other lanes have read
    const bool to_candidates = hits_and_leaves >> 16 == 3;
    const std::uint32_t before = sum - (__popc(below) << (to_candidates ? 16 : 0));
    std::uint32_t* at =
        pair_ + (to_candidates ? size_ - 1 - candidates_ - (before >> 16) : height_ + (before & 0xFFFFu));
    const int direction = to_candidates ? -1 : 1;
    while (below != 0) {
      const int bit = 31 - __clz(static_cast<int>(below));
      *at = lane_id() * 16 + bit;
      at += direction;
      below ^= 1u << bit;
    }
    __syncwarp();
    const std::uint32_t children = total & 0xFFFFu, all = children + (total >> 16);
    for (std::uint32_t first = 0; first < all; first += kFull) {
      const std::uint32_t k = first + lane_id();
      const std::uint32_t slot = k < children ? height_ + k : size_ - 1 - candidates_ - (k - children);
      const std::uint32_t note = k < all ? pair_[slot] : 0, bit = note % 16;
      const int from = static_cast<int>(note / 16);
      const std::uint32_t its_pair = __shfl_sync(kAllLanes, pair, from);
      const Entry above = {__shfl_sync(kAllLanes, entry.a, from), __shfl_sync(kAllLanes, entry.b, from)};
      const std::uint32_t flags = __shfl_sync(kAllLanes, hits_and_leaves, from);
      if (k < all) put(slot, its_pair, below_of(above, from, flags, bit));
    }
    height_ += children;
    candidates_ += total >> 16;
    __syncwarp();
  }

  /// What comes of a bit of a block pair that hits. flags: hits, and above them 3 for two leaf blocks, 2
  /// where a descends alone, 1 where b does.
  __device__ Entry below_of(const Entry& above, int lane, std::uint32_t flags, std::uint32_t bit) const {
    const std::uint32_t i = bit / 4, j = bit % 4, a = above.a & kIndexMask, b = above.b & kIndexMask;
    const auto* index = reinterpret_cast<const std::uint32_t*>(index_rows_ + 2 * lane);
    const std::uint32_t leaves = flags >> 16, index_a = index[i], index_b = index[4 + j];
    if (leaves == 3) return {index_a, index_b};
    if (leaves == 0) return make_entry(index_a, index_b, kAllNodes, false);
    if (leaves == 2) return make_entry(index_a, b, flags >> (4 * i) & 0xFu, false);
    return make_entry(a, index_b, nodes_of_column(flags >> j & 0x1111u), true);
  }

  /// Decides the last candidates; count <= 32.
  __device__ void settle(std::uint32_t count) {
    const bool mine = lane_id() < count;
    Judged judged = {0, 0, false, false};
    std::uint32_t pair = 0, a = 0, b = 0;
    if (mine) {
      const std::uint32_t at = size_ - candidates_ + lane_id();
      pair = pair_[at], a = a_[at], b = b_[at];
      judged = Means::judge(args_.pairs[pair], a, b);
    }
    candidates_ -= count;
    candidates_seen_ += count;
    if (__any_sync(kAllLanes, judged.undecided)) {
      const Counter place = place_for(judged.undecided, &args_.state->undecided);
      if (judged.undecided && place < args_.capacity.undecided) args_.undecided[place] = {pair, a, b};
    }
    if (judged.contact) judged.contact = is_wanted(args_, pair);
    const std::uint32_t lanes = __ballot_sync(kAllLanes, judged.contact);
    if (lanes == 0) return;
    if (judged.contact) {
      const std::uint32_t at = out_count_ + __popc(lanes & lanes_below());
      const bool self = args_.pairs[pair].instance_a == args_.pairs[pair].instance_b;
      const Contact contact = make_contact(pair, self, a, b, judged.face_a, judged.face_b);
      out_[at] = contact.pair;
      out_[kOutRoom + at] = contact.triangle_a;
      out_[2 * kOutRoom + at] = contact.triangle_b;
      out_[3 * kOutRoom + at] = contact.face_a;
      out_[4 * kOutRoom + at] = contact.face_b;
    }
    out_count_ += __popc(lanes);
    __syncwarp();
    if (out_count_ >= kFull) flush(kFull);
  }

  /// Writes the last contacts; count <= 32.
  __device__ void flush(std::uint32_t count) {
    if (count == 0) return;
    out_count_ -= count;
    Counter first = 0;
    if (lane_id() == 0) first = atomicAdd(&args_.state->contacts, static_cast<Counter>(count));
    const Counter place = __shfl_sync(kAllLanes, first, 0) + lane_id();
    const std::uint32_t at = out_count_ + lane_id();
    if (lane_id() < count && place < args_.capacity.contacts) {
      args_.contacts[place] = {out_[at], out_[kOutRoom + at], out_[2 * kOutRoom + at],
                               out_[3 * kOutRoom + at], out_[4 * kOutRoom + at]};
    }
    __syncwarp();
  }

  __device__ uint4 look() const {
    uint4 seen;
    asm volatile("ld.volatile.global.v4.u32 {%0, %1, %2, %3}, [%4];"
                 : "=r"(seen.x), "=r"(seen.y), "=r"(seen.z), "=r"(seen.w)
                 : "l"(&balance_));
    return seen;  // active, given, asked, next_pair
  }

  /// Gives the oldest block pairs, which have the most below them, to warps that wait for some.
  __device__ void share(const uint4& seen) {
    const int waiting = __shfl_sync(kAllLanes, static_cast<int>(seen.z - seen.y), 0);
    if (waiting <= 0) return;
    std::uint32_t gifts = height_ / kFewestToShare;
    gifts = gifts < kMostGifts ? gifts : kMostGifts;
    gifts = gifts < static_cast<std::uint32_t>(waiting) ? gifts : waiting;
    std::uint32_t number = 0;
    if (lane_id() == 0) {
      // Active and given at once: a gift counts as active from now on, on behalf of the one who gets it.
      const Counter before =
          atomicAdd(reinterpret_cast<Counter*>(&balance_.active), static_cast<Counter>(gifts) << 32 | gifts);
      number = static_cast<std::uint32_t>(before >> 32);
    }
    number = __shfl_sync(kAllLanes, number, 0);
    std::uint32_t count = height_ / (gifts + 1);
    count = count < kFull ? count : kFull;
    for (std::uint32_t i = 0; i < gifts; ++i) give((number + i) % kChunks, count);
  }

  /// kChunks numbers ago the chunk and its mailbox served another warp, which has that number, and empties
  /// the mailbox when it is done with the chunk.
  __device__ void give(std::uint32_t chunk, std::uint32_t count) {
    auto* mailbox = static_cast<volatile std::uint32_t*>(&balance_.mailbox[chunk]);
    const std::uint32_t lane = lane_id();
    if (lane == 0) {
      while (*mailbox != 0) {
      }
      __threadfence();
    }
    __syncwarp();
    Chunk& to = args_.chunks[chunk];
    height_ -= count;
    if (lane < count) {
      to.pair[lane] = pair_[lane], to.a[lane] = a_[lane], to.b[lane] = b_[lane];
      // The newest fill the gap.
      const std::uint32_t last = height_ + lane;
      put(lane, pair_[last], {a_[last], b_[last]});
    }
    __threadfence();
    __syncwarp();
    if (lane == 0) *mailbox = count;
  }

  /// Asks for block pairs that another warp gives away, and waits. False: no warp has any left.
  __device__ bool wait_for_gift() {
    std::uint32_t number = 0, others = 0;
    if (lane_id() == 0) {
      number = atomicAdd(&balance_.asked, 1u) % kChunks;
      __threadfence();
      others = atomicSub(&balance_.active, 1u) - 1;
    }
    others = __shfl_sync(kAllLanes, others, 0);
    if (others == 0) {
      end_all();
      return false;
    }
    number = __shfl_sync(kAllLanes, number, 0);
    auto* mailbox = static_cast<volatile std::uint32_t*>(&balance_.mailbox[number]);
    std::uint32_t count = 0;
    if (lane_id() == 0) {
      while ((count = *mailbox) == 0) __nanosleep(100);
      __threadfence();
    }
    count = __shfl_sync(kAllLanes, count, 0);
    if (count == kNoMore) return false;
    const Chunk& from = args_.chunks[number];
    const std::uint32_t lane = lane_id();
    if (lane < count) put(lane, __ldcg(&from.pair[lane]), {__ldcg(&from.a[lane]), __ldcg(&from.b[lane])});
    height_ = count;
    __threadfence();
    __syncwarp();
    if (lane == 0) *mailbox = 0;
    return true;
  }

  /// Sends the waiting warps home. None is active, so nothing is given any more, and what was given has been
  /// received. A warp that starts late turns active, finds nothing, and, when none else is active, comes
  /// here.
  __device__ void end_all() {
    const uint4 seen = look();
    for (std::uint32_t i = seen.y + lane_id(); i < seen.z; i += 32) {
      *static_cast<volatile std::uint32_t*>(&balance_.mailbox[i % kChunks]) = kNoMore;
    }
  }

  const QueryArgs& args_;
  Balance& balance_;
  const std::uint32_t size_;
  uint4* const index_rows_;
  std::uint32_t *const out_, *const pair_, *const a_, *const b_;
  const std::uint32_t warps_;
  std::uint32_t input_ = 0, last_seen_ = 0, rounds_ = 0;
  std::uint32_t height_ = 0, candidates_ = 0, out_count_ = 0;
  Counter block_pairs_ = 0, candidates_seen_ = 0;
  bool more_input_ = true;
};

// 16 warps of 128 registers fill a multiprocessor. With 96 registers and 20 warps spills cost 10 % more.
constexpr std::uint32_t kWarpsPerBlock = 4, kBlocksPerProcessor = 4;

template <class Means>
__global__ void __launch_bounds__(32 * kWarpsPerBlock, kBlocksPerProcessor)
    walk(const __grid_constant__ QueryArgs args) {
  extern __shared__ float4 memory[];
  if (failed(args)) return;
  const std::uint32_t warp = threadIdx.x / 32;
  Walk<Means> walk(args, reinterpret_cast<std::uint32_t*>(memory) + warp * warp_words(args.stack_size),
                   gridDim.x * kWarpsPerBlock);
  walk.run();
}

template <class Means>
cudaError_t launch_walk(const QueryArgs& args, cudaStream_t stream) {
  const auto kernel = walk<Means>;
  const std::size_t bytes = kWarpsPerBlock * warp_words(args.stack_size) * sizeof(std::uint32_t);
  int device = 0, processors = 0, blocks = 0;
  cudaError_t error = cudaGetDevice(&device);
  if (error == cudaSuccess)
    error = cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device);
  if (error == cudaSuccess)
    error =
        cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(bytes));
  if (error == cudaSuccess)
    error = cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, 32 * kWarpsPerBlock, bytes);
  if (error != cudaSuccess) return error;
  blocks = std::min(blocks * processors, static_cast<int>(kChunks / 2 / kWarpsPerBlock));
  if (args.most_blocks != 0) blocks = std::min(blocks, static_cast<int>(args.most_blocks));
  kernel<<<static_cast<unsigned>(blocks), 32 * kWarpsPerBlock, bytes, stream>>>(args);
  return cudaGetLastError();
}

}  // namespace
}  // namespace tandem::gpu
