#pragma once
#include "kernels/common/traversal.h"
#include "kernels/contact/gpu_query_data.h"
#include "kernels/contact/walk_memory.cuh"

// The stack has what waits in a warp of the walk: entries in shared memory, each with up to 16 bits. From the
// front grows the stack of tested block pairs whose block pairs below are still to be tested, a bit for each;
// from the back the pairs of leaf blocks, a bit for each candidate. An entry is
//
//        31  30 29  28                                  0
//   x   |                  object pair                   |
//   y   | g |  how  |         family of a                |    g: 1 while one warp gives the entry to another
//   z   |   -   | s |         family of b                |    s: both are of one instance
//   w   |          hits          |   still to be taken   |    16 bits each
//
// A family is the children of a block, by a number that the means of the walk understand (walk_lane.cuh). For
// a pair of leaf blocks, y and z are the numbers of the first triangles, in 32 bits. `how` the pair goes on
// (Descent) says what a bit stands for:
//
//   both      bit 4 i + j: child i of y, or triangle y + i, against child, or triangle, j of z
//   b_alone   bit j: y, a block of its own, against child j of z; the hits say with which of y's nodes
//   a_alone   bit 4 i: child i of y against z, a block of its own; the hits say with which of z's nodes
//
// Object pairs begin as if both roots were the only children.
//
// Included by files that are compiled with and without fused operations: internal linkage.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kFull = 32;  // block pairs or candidates of a full warp

constexpr std::uint32_t kNumberMask = (1u << kNumberBits) - 1;  // of y and z
constexpr std::uint32_t kSelf = 1u << kNumberBits;              // in z
constexpr std::uint32_t kGiven = 1u << 31;  // in y: each half of an entry is not 0 while it is given

/// A block pair, by numbers, and which of its node pairs count.
struct Below {
  std::uint32_t a, b, nodes;
};

/// The block pair that a bit of an entry stands for. Blocks: see walk_lane.cuh.
template <class Blocks>
__device__ Below below_of(const PairRecord& record, const uint4& entry, std::uint32_t bit) {
  const auto goes_on = static_cast<Descent>(entry.y >> kNumberBits & 3u);
  const std::uint32_t hits = entry.w >> 16;
  Below below = {entry.y & kNumberMask, entry.z & kNumberMask, kAllNodePairs};
  if (goes_on != Descent::b_alone) below.a = Blocks::child(Blocks::of_a(record), below.a, bit / 4);
  if (goes_on != Descent::a_alone) below.b = Blocks::child(Blocks::of_b(record), below.b, bit % 4);
  if (goes_on == Descent::a_alone) below.nodes = (hits >> bit & 0xFu) * 0x1111u;
  if (goes_on == Descent::b_alone) below.nodes = (hits >> bit & 0x1111u) * 0xFu;
  return below;
}

constexpr std::uint32_t kPositionWords = 256;

/// Fills in for each byte the positions of its bits that are set, three bits each, in ascending order.
__device__ inline void fill_positions(std::uint32_t* positions) {
  for (std::uint32_t byte = threadIdx.x; byte < kPositionWords; byte += blockDim.x) {
    std::uint32_t word = 0, at = 0;
    for (std::uint32_t bit = 0; bit < 8; ++bit) {
      if ((byte >> bit & 1u) != 0) word |= bit << at, at += 3;
    }
    positions[byte] = word;
  }
}

/// Position of bit number `rank`, from 0, of those set in 16 bits. positions: address of the above.
__device__ inline std::uint32_t position_of(std::uint32_t positions, std::uint32_t bits, std::uint32_t rank) {
  const std::uint32_t in_low = __popc(bits & 0xFFu);
  const bool high = rank >= in_low;
  const std::uint32_t word = load_shared(positions + 4 * ((high ? bits >> 8 : bits) & 0xFFu));
  return (word >> 3 * (high ? rank - in_low : rank) & 7u) | (high ? 8 : 0);
}

/// The entry that a lane takes off.
struct Taken {
  uint4 entry;
  std::uint32_t bit;
  bool mine;  ///< whether there is something for this lane
};

/// All lanes of the warp call each function.
class WalkStack {
 public:
  /// memory: address of `size` entries.
  __device__ WalkStack(std::uint32_t positions, std::uint32_t memory, std::uint32_t size, std::uint32_t lane)
      : positions_(positions), memory_(memory), size_(size), lane_(lane) {}

  __device__ std::uint32_t height() const { return height_; }          ///< entries of the stack
  __device__ std::uint32_t waiting() const { return waiting_; }        ///< its bits: block pairs
  __device__ std::uint32_t candidates() const { return candidates_; }  ///< bits of pairs of leaf blocks
  __device__ std::uint32_t room() const { return size_ - base_ - height_ - leaf_pairs_; }  ///< entries

  /// Moves the stack to the start of its memory if there is less room than wanted behind it, and some before.
  __device__ void make_room(std::uint32_t wanted) {
    if (base_ == 0 || room() >= wanted) return;
    for (std::uint32_t first = 0; first < height_; first += kFull) {
      const bool mine = first + lane_ < height_;
      uint4 entry = {0, 0, 0, 0};
      if (mine) entry = load_shared4(at(base_ + first + lane_));
      __syncwarp();  // what is overwritten from now on, all lanes have read
      if (mine) store_shared4(at(first + lane_), entry);
    }
    base_ = 0;
    __syncwarp();
  }

  /// Puts on the roots of an object pair for each lane that has one. roots: the family of a tree's root.
  __device__ void put_roots(bool mine, std::uint32_t pair, std::uint32_t roots, bool self) {
    const std::uint32_t lanes = __ballot_sync(kAllLanes, mine);
    if (mine)
      store_shared4(at(base_ + height_ + __popc(lanes & lanes_below())),
                    {pair, roots, roots | (self ? kSelf : 0), 1});
    height_ += __popc(lanes);
    waiting_ += __popc(lanes);
    __syncwarp();
  }

  /// Puts on the entry of each lane that has something to be taken.
  __device__ void put(const uint4& entry, bool of_leaves) {
    const std::uint32_t bits = __popc(entry.w & 0xFFFFu);
    const std::uint32_t lanes = __ballot_sync(kAllLanes, bits != 0 && !of_leaves);
    const std::uint32_t leaf_lanes = __ballot_sync(kAllLanes, bits != 0 && of_leaves);
    const std::uint32_t all = __reduce_add_sync(kAllLanes, of_leaves ? bits << 16 : bits);
    const std::uint32_t before = __popc((of_leaves ? leaf_lanes : lanes) & lanes_below());
    const std::uint32_t place = of_leaves ? size_ - 1 - leaf_pairs_ - before : base_ + height_ + before;
    if (bits != 0) store_shared4(at(place), entry);
    height_ += __popc(lanes);
    leaf_pairs_ += __popc(leaf_lanes);
    waiting_ += all & 0xFFFFu;
    candidates_ += all >> 16;
    __syncwarp();
  }

  /// Takes the oldest or the newest block pairs off, one a lane. Condition: count <= 32, count <= waiting();
  /// put() follows.
  __device__ Taken take_block_pairs(std::uint32_t count, bool oldest) {
    waiting_ -= count;
    const std::uint32_t before = height_;
    const Taken taken =
        take(count, at(oldest ? base_ : base_ + height_ - 1), oldest ? kBytes : 0 - kBytes, height_);
    if (oldest) base_ += before - height_;
    return taken;
  }

  /// Takes the newest candidates off, one a lane. Condition: count <= 32, count <= candidates().
  __device__ Taken take_candidates(std::uint32_t count) {
    candidates_ -= count;
    const Taken taken = take(count, at(size_ - leaf_pairs_), kBytes, leaf_pairs_);
    __syncwarp();  // other lanes may read next what the last of these stored
    return taken;
  }

  /// Takes the oldest entries off, which have the most below them: give(take_off) calls take_off(lane, words)
  /// once in each lane below `count`, for an entry that is given away. Condition: count <= height().
  template <class Give>
  __device__ void take_oldest(std::uint32_t count, Give give) {
    std::uint32_t bits = 0;
    give([&](std::uint32_t lane, std::uint64_t(&words)[2]) {
      const uint4 entry = load_shared4(at(base_ + lane));
      bits = __popc(entry.w & 0xFFFFu);
      words[0] = std::uint64_t{entry.y | kGiven} << 32 | entry.x;
      words[1] = std::uint64_t{entry.w} << 32 | entry.z;
    });
    base_ += count;
    height_ -= count;
    waiting_ -= __reduce_add_sync(kAllLanes, bits);
    __syncwarp();
  }

  /// Puts on entries that another warp gave: receive(put_on) calls put_on(lane, words) once in each lane that
  /// gets one. Result: how many, as receive() tells. Condition: the stack is empty.
  template <class Receive>
  __device__ std::uint32_t put_given(Receive receive) {
    std::uint32_t bits = 0;
    base_ = 0;
    height_ = receive([&](std::uint32_t lane, const std::uint64_t(&words)[2]) {
      const auto w = static_cast<std::uint32_t>(words[1] >> 32);
      store_shared4(at(lane), {static_cast<std::uint32_t>(words[0]),
                               static_cast<std::uint32_t>(words[0] >> 32) & ~kGiven,
                               static_cast<std::uint32_t>(words[1]), w});
      bits = __popc(w & 0xFFFFu);
    });
    waiting_ = __reduce_add_sync(kAllLanes, bits);
    __syncwarp();
    return height_;
  }

 private:
  static constexpr std::uint32_t kBytes = 4 * kEntryWords;  // of an entry

  __device__ std::uint32_t lanes_below() const { return (1u << lane_) - 1; }
  __device__ std::uint32_t at(std::uint32_t entry) const { return memory_ + kBytes * entry; }  ///< address

  /// Takes `count` bits off, one a lane, neighbours from one entry. first: address of the entry that is taken
  /// from first; step: the way to the next. entries: how many there are, before and after. Condition: they
  /// have so many bits.
  ///
  /// Lane l looks at the l-th of these entries. Each has at least one bit, at most 16, so four ballots tell
  /// how many bits those before it have. Numbered through, the first bits of the entries are starts: the
  /// entry that lane l takes from is the one of the last start up to l.
  __device__ Taken take(std::uint32_t count, std::uint32_t first, std::uint32_t step,
                        std::uint32_t& entries) {
    const bool there = lane_ < entries;
    const std::uint32_t bits = there ? load_shared(first + step * lane_ + 12) & 0xFFFFu : 1;
    const std::uint32_t more = __popc(bits) - 1;  // than one
    std::uint32_t before = lane_;
#pragma unroll
    for (int digit = 0; digit < 4; ++digit) {
      before += __popc(__ballot_sync(kAllLanes, (more >> digit & 1u) != 0) & lanes_below()) << digit;
    }
    const std::uint32_t starts = __reduce_or_sync(kAllLanes, there && before < 32 ? 1u << before : 0);
    const std::uint32_t emptied = __popc(__ballot_sync(kAllLanes, there && before + more < count));
    Taken out = {{0, 0, 0, 0}, 0, lane_ < count};
    std::uint32_t from = 0, left = 0;
    if (out.mine) {
      const std::uint32_t up_to = starts & (2 * lanes_below() + 1);
      from = first + step * (__popc(up_to) - 1);
      out.entry = load_shared4(from);
      out.bit = position_of(positions_, out.entry.w & 0xFFFFu, lane_ - (31 - __clz(static_cast<int>(up_to))));
      left = out.entry.w & (0xFFFEu << out.bit & 0xFFFFu);
    }
    __syncwarp();  // what is overwritten from now on, all lanes have read
    if (lane_ == count - 1 && left != 0) store_shared(from + 12, (out.entry.w & 0xFFFF0000u) | left);
    entries -= emptied;
    return out;
  }

  const std::uint32_t positions_;  // address
  const std::uint32_t memory_;     // address
  const std::uint32_t& size_;
  const std::uint32_t lane_;
  std::uint32_t base_ = 0;                      // entries of memory before the stack, free
  std::uint32_t height_ = 0, leaf_pairs_ = 0;   // entries
  std::uint32_t waiting_ = 0, candidates_ = 0;  // their bits
};

}  // namespace
}  // namespace tandem::gpu
