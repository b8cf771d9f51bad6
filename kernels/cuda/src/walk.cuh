#pragma once
#include <algorithm>
#include <bit>

#include "walk_lane.cuh"
#include "walk_memory.cuh"

// The walk of both trees of all object pairs, by warps that work on their own. What waits lies on a stack in
// shared memory: block pairs that were tested, each with the hits whose block pairs below are still to be
// tested. A warp takes the next 32 of these off, one a lane, tests them, and puts those that hit on. Pairs of
// leaf blocks gather at the other end of the same memory, until a warp is full of their candidates. Nothing
// but contacts, and what float32 cannot decide, leaves the multiprocessor.
//
// A warp that has nothing left takes object pairs; when there are no more, it takes a number and waits at the
// mailbox with that number. Warps that have enough look every round whether numbers were given out, and fill
// the next mailbox. The last warp that runs out of work sends the others home. No warp waits for one that has
// not started; those that start when all others have gone do what is theirs.
//
// Included by files that are compiled with and without fused operations: internal linkage.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kFull = 32;  // block pairs or candidates of a full warp
constexpr std::uint32_t kFewestPairsAtOnce = 4, kMostPairsAtOnce = 16;  // object pairs that a warp takes
constexpr std::uint32_t kFewestToShare = 32;                            // block pairs, for each gift
constexpr std::uint32_t kMostGifts = 3;                                 // at once
constexpr std::uint32_t kHome = 0xFEu, kTaken = 0xFFu;                  // in a mailbox
constexpr std::uint32_t kNothing = 0xFFFFFFFFu;
constexpr std::uint32_t kOutRoom = 64;
constexpr std::uint32_t kWarpsPerBlock = 16, kBlocksPerProcessor = 1;

// An entry of the stack: x: object pair; y: what of a lies below, and in its free bits how the pair goes on;
// z: what of b lies below, and whether both are of one instance; w: a bit for each block pair below that is
// still to be taken, and above them the hits. Where both descend these are the same, and bit 4 i + j stands
// for the blocks, or triangles, y + i and z + j. Where a alone does, z is b's block itself and bit 4 i stands
// for y + i against it, and the hits say against which nodes of it; where b alone does, y is a's block and
// bit j stands for z + j. Object pairs begin as if both roots were the only children.
enum GoesOn : std::uint32_t { kBoth, kBAlone, kAAlone };
constexpr std::uint32_t kSelf = 1u << kNumberBits;  // in z

/// A block pair, by numbers of walk blocks, and which of its node pairs count.
struct Below {
  std::uint32_t a, b, nodes;
};

/// The block pair that a bit of an entry stands for.
__device__ inline Below below_of(const uint4& entry, std::uint32_t bit) {
  const std::uint32_t goes_on = entry.y >> kNumberBits & 3u, hits = entry.w >> 16;
  Below below = {entry.y & kNumberMask, entry.z & kNumberMask, kAllNodePairs};
  if (goes_on != kBAlone) below.a += bit / 4;
  if (goes_on != kAAlone) below.b += bit % 4;
  if (goes_on == kAAlone) below.nodes = (hits >> bit & 0xFu) * 0x1111u;
  if (goes_on == kBAlone) below.nodes = (hits >> bit & 0x1111u) * 0xFu;
  return below;
}

/// For each byte the positions of its bits that are set, three bits each, in ascending order.
__device__ inline void fill_positions(std::uint32_t* positions) {
  for (std::uint32_t byte = threadIdx.x; byte < 256; byte += blockDim.x) {
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

/// The shared memory of one warp, in words: contacts that wait, the number of the mailbox that the warp has
/// not given back, what was last seen of Balance, the stack.
__host__ __device__ constexpr std::uint32_t warp_words(std::uint32_t size) {
  return 5 * kOutRoom + 4 + 4 + 4 * size;
}
constexpr std::uint32_t kSharedWords = 256;  // of all warps of a block: positions

template <class Means>
class Walk {
 public:
  /// memory: address of the warp's shared memory.
  __device__ Walk(const QueryArgs& args, std::uint32_t positions, std::uint32_t memory)
      : args_(args), balance_(Means::kWorld ? args.state->world : args.state->frame), positions_(positions) {
    // Through memory, so that the compiler keeps them in registers and does not compute them anew.
    store_shared(memory + 4 * (threadIdx.x % 32), threadIdx.x % 32);
    store_shared(memory + 128, memory + 4 * warp_words(0));
    __syncwarp();
    lane_ = load_shared(memory + 4 * (threadIdx.x % 32));
    stack_ = load_shared(memory + 128);
    __syncwarp();
    if (lane_ == 0) store_shared(held(), kNothing);
  }

  __device__ void run() {
    const std::uint32_t pairs = input();
    if (pairs == 0) return;
    if (lane_ == 0) atomicAdd(&balance_.active, 1u);
    // The first without asking.
    const std::uint32_t share = share_of(pairs);
    more_input_ = share * warps() < pairs;
    put_pairs(share * (threadIdx.x / 32 * gridDim.x + blockIdx.x), share, pairs);
    for (;;) {
      // Each of these is called in one place: the code is to stay small, for the caches of instructions.
      const std::uint32_t least = waiting_ == 0 && !more_input_ ? 1 : kFull;
      while (candidates_ >= least) settle(candidates_ < kFull ? candidates_ : kFull);
      if (waiting_ < kFull && more_input_) take_pairs();
      if (waiting_ != 0)
        step();
      else if (least == 1 &&
               !wait_for_gift())  // not where take_pairs() just found the end: see to the rest first
        break;
    }
    flush(out_count_);
    add_counters();
  }

 private:
  __device__ std::uint32_t lanes_below() const { return (1u << lane_) - 1; }
  __device__ std::uint32_t out() const { return stack_ - 4 * warp_words(0); }
  __device__ std::uint32_t seen() const { return stack_ - 16; }  ///< active, given, asked, next_pair
  __device__ std::uint32_t held() const { return stack_ - 32; }

  __device__ std::uint32_t input() const {
    return Means::kWorld ? args_.state->world_pairs : pair_count(args_);
  }

  /// Adds what the lanes counted; before 32 bits are full.
  __device__ void add_counters() {
    const std::uint32_t high = __reduce_add_sync(kAllLanes, block_pairs_ >> 16),
                        low = __reduce_add_sync(kAllLanes, block_pairs_ & 0xFFFFu);
    const std::uint32_t high_seen = __reduce_add_sync(kAllLanes, candidates_seen_ >> 16),
                        low_seen = __reduce_add_sync(kAllLanes, candidates_seen_ & 0xFFFFu);
    if (lane_ == 0) {
      atomicAdd(&args_.state->block_pairs, (static_cast<Counter>(high) << 16) + low);
      atomicAdd(&args_.state->candidates, (static_cast<Counter>(high_seen) << 16) + low_seen);
    }
    block_pairs_ = candidates_seen_ = 0;
  }

  __device__ static std::uint32_t warps() { return gridDim.x * kWarpsPerBlock; }

  /// How many object pairs each warp begins with.
  __device__ static std::uint32_t share_of(std::uint32_t pairs) {
    const std::uint32_t share = pairs / warps();
    return min(max(share, kFewestPairsAtOnce), kMostPairsAtOnce);
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
    if (mine && Means::kWorld) pair = args_.world_pairs[pair];
    if (mine && !Means::kWorld) mine = args_.pairs[pair].in_frame != 0;
    const std::uint32_t lanes = __ballot_sync(kAllLanes, mine);
    if (mine) {
      const PairRecord& record = args_.pairs[pair];
      const std::uint32_t self = record.instance_a == record.instance_b ? kSelf : 0;
      store_shared4(stack_ + 16 * (height_ + __popc(lanes & lanes_below())),
                    {pair, record.root_a, record.root_b | self, 1});
    }
    height_ += __popc(lanes);
    waiting_ += __popc(lanes);
    __syncwarp();
  }

  /// What a lane got.
  struct Taken {
    uint4 entry;
    std::uint32_t bit;
    bool mine;
  };

  /// Takes `count` bits of the newest entries off, one a lane, neighbours from one entry. newest: address of
  /// the newest entry; kOlder: the way to the one before it. entries: how many there are, before and after.
  /// Condition: they have so many bits.
  ///
  /// Lane l looks at the l-th newest entry. Each has at least one bit, at most 16, so four ballots tell how
  /// many bits those before it have. Numbered through, the first bits of the entries are starts: the entry
  /// that lane l takes from is the one of the last start up to l.
  template <int kOlder>
  __device__ Taken take(std::uint32_t count, std::uint32_t newest, std::uint32_t& entries) {
    constexpr auto kStep = static_cast<std::uint32_t>(kOlder * 16);
    const bool there = lane_ < entries;
    const std::uint32_t bits = there ? load_shared(newest + kStep * lane_ + 12) & 0xFFFFu : 1;
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
      from = newest + kStep * (__popc(up_to) - 1);
      out.entry = load_shared4(from);
      out.bit = position_of(positions_, out.entry.w & 0xFFFFu, lane_ - (31 - __clz(static_cast<int>(up_to))));
      left = out.entry.w & (0xFFFEu << out.bit & 0xFFFFu);
    }
    __syncwarp();  // what is overwritten from now on, all lanes have read
    if (lane_ == count - 1 && left != 0) store_shared(from + 12, (out.entry.w & 0xFFFF0000u) | left);
    entries -= emptied;
    return out;
  }

  /// Takes up to 32 block pairs off, tests them and puts on those that hit: no more than were taken. Where
  /// there is little room, fewer are taken, at last one at a time: from there on at most one entry for each
  /// level of the two trees goes on before what was below is reached again, and at most 32 pairs of leaf
  /// blocks, each with a candidate. So stack_reserve is the two depths and 32.
  __device__ void step() {
    const std::uint32_t room = args_.stack_size - height_ - leaf_pairs_, reserve = args_.stack_reserve;
    std::uint32_t count = waiting_ < kFull ? waiting_ : kFull;
    if (room < count + reserve) count = room > reserve ? room - reserve : 1;
    look();  // comes while the boxes are tested
    const Taken taken = take<-1>(count, stack_ + 16 * (height_ - 1), height_);
    waiting_ -= count;
    bool mine = taken.mine;
    const std::uint32_t pair = taken.entry.x;
    if (mine && args_.first_contact_only) mine = *static_cast<volatile std::uint32_t*>(&args_.met[pair]) == 0;
    std::uint32_t hits = 0, below = 0, goes_on = kBoth;
    bool of_leaves = false;
    Below now = {0, 0, 0};
    if (mine) {
      const PairRecord& record = args_.pairs[pair];
      now = below_of(taken.entry, taken.bit);
      Side side_a, side_b;
      hits = Means::test(args_, record, now.a, now.b, side_a, side_b) & now.nodes;
      const bool leaf_a = (side_a.first_below & kIsLeafBlock) != 0,
                 leaf_b = (side_b.first_below & kIsLeafBlock) != 0;
      of_leaves = leaf_a & leaf_b;
      if ((taken.entry.z & kSelf) != 0 && now.a == now.b) hits &= own_node_pairs(leaf_a);
      if (leaf_a != leaf_b && hits != 0 && worth_planes(leaf_a, side_a.size, side_b.size))
        hits = Means::drop_beyond_planes(args_, record, now.a, now.b, hits);
      const Descent descent = leaf_a != leaf_b ? descent_beside_leaves(leaf_a)
                                               : descent_by_size(side_a.size, side_b.size, Means::kDescends);
      below = hits;
      if (!of_leaves && descent == Descent::b_alone) {
        goes_on = kBAlone;
        below |= hits >> 4;
        below = (below | below >> 8) & 0xFu;
      }
      if (!of_leaves && descent == Descent::a_alone) {
        goes_on = kAAlone;
        below |= hits >> 1;
        below = (below | below >> 2) & 0x1111u;
      }
      if (goes_on != kBAlone) now.a = side_a.first_below & ~kIsLeafBlock;
      if (goes_on != kAAlone) now.b = side_b.first_below & ~kIsLeafBlock;
      if (!of_leaves) {
        now.a |= goes_on << kNumberBits;
        now.b |= taken.entry.z & kSelf;
      }
    }
    block_pairs_ += mine;
    if constexpr (Means::kCountsOnly) {
      if (of_leaves) candidates_seen_ += __popc(below), below = 0;
    }
    put({pair, now.a, now.b, below | hits << 16}, of_leaves);
    asm volatile("cp.async.wait_all;" ::: "memory");
    __syncwarp();
    if (waiting_ >= kFewestToShare) share();
    if (++rounds_ >= 1u << 26) add_counters(), rounds_ = 0;
  }

  /// Puts on the entry of each lane that has something below.
  __device__ void put(const uint4& entry, bool of_leaves) {
    const std::uint32_t bits = __popc(entry.w & 0xFFFFu);
    const std::uint32_t lanes = __ballot_sync(kAllLanes, bits != 0 && !of_leaves);
    const std::uint32_t leaf_lanes = __ballot_sync(kAllLanes, bits != 0 && of_leaves);
    const std::uint32_t all = __reduce_add_sync(kAllLanes, of_leaves ? bits << 16 : bits);
    const std::uint32_t before = __popc((of_leaves ? leaf_lanes : lanes) & lanes_below());
    const std::uint32_t at = of_leaves ? args_.stack_size - 1 - leaf_pairs_ - before : height_ + before;
    if (bits != 0) store_shared4(stack_ + 16 * at, entry);
    height_ += __popc(lanes);
    leaf_pairs_ += __popc(leaf_lanes);
    waiting_ += all & 0xFFFFu;
    candidates_ += all >> 16;
    __syncwarp();
  }

  /// Decides the last candidates; count <= 32.
  __device__ void settle(std::uint32_t count) {
    const Taken taken = take<1>(count, stack_ + 16 * (args_.stack_size - leaf_pairs_), leaf_pairs_);
    candidates_ -= count;
    candidates_seen_ += taken.mine;
    judge(taken.mine, taken.entry.x, taken.entry.y + taken.bit / 4, taken.entry.z + taken.bit % 4);
  }

  __device__ void judge(bool mine, std::uint32_t pair, std::uint32_t a, std::uint32_t b) {
    Judged judged = {0, 0, false, false};
    if (mine) judged = Means::judge(args_.pairs[pair], a, b);
    if (__any_sync(kAllLanes, judged.undecided)) {
      const Counter place = place_for(judged.undecided, &args_.state->undecided);
      if (judged.undecided && place < args_.capacity.undecided) args_.undecided[place] = {pair, a, b};
    }
    if (judged.contact) judged.contact = is_wanted(args_, pair);
    const std::uint32_t lanes = __ballot_sync(kAllLanes, judged.contact);
    if (lanes == 0) return;
    if (judged.contact) {
      const bool self = args_.pairs[pair].instance_a == args_.pairs[pair].instance_b;
      const Contact contact = make_contact(pair, self, a, b, judged.face_a, judged.face_b);
      const std::uint32_t words[5] = {contact.pair, contact.triangle_a, contact.triangle_b, contact.face_a,
                                      contact.face_b};
      const std::uint32_t at = out() + 4 * (out_count_ + __popc(lanes & lanes_below()));
#pragma unroll
      for (int i = 0; i < 5; ++i) store_shared(at + 4 * kOutRoom * i, words[i]);
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
    if (lane_ == 0) first = atomicAdd(&args_.state->contacts, static_cast<Counter>(count));
    const Counter place = __shfl_sync(kAllLanes, first, 0) + lane_;
    std::uint32_t words[5];
#pragma unroll
    for (int i = 0; i < 5; ++i)
      words[i] = load_shared(out() + 4 * (kOutRoom * i + (out_count_ + lane_) % kOutRoom));
    if (lane_ < count && place < args_.capacity.contacts)
      args_.contacts[place] = {words[0], words[1], words[2], words[3], words[4]};
    __syncwarp();
  }

  /// Begins to fetch the head of Balance.
  __device__ void look() const {
    __syncwarp();  // all lanes have read what was seen before
    if (lane_ == 0)
      asm volatile("cp.async.cg.shared.global [%0], [%1], 16;" ::"r"(seen()), "l"(&balance_) : "memory");
  }

  /// Gives the oldest entries, which have the most below them, to warps that wait for some.
  __device__ void share() {
    const auto waiting = static_cast<int>(load_shared(seen() + 8) - load_shared(seen() + 4));
    if (waiting <= 0 || height_ < 2) return;
    std::uint32_t gifts = waiting_ / kFewestToShare;
    gifts = gifts < kMostGifts ? gifts : kMostGifts;
    gifts = gifts < static_cast<std::uint32_t>(waiting) ? gifts : waiting;
    gifts = gifts < height_ - 1 ? gifts : height_ - 1;
    std::uint32_t number = 0;
    if (lane_ == 0) {
      // Active and given at once: a gift counts as active from now on, on behalf of the one who gets it.
      const Counter before =
          atomicAdd(reinterpret_cast<Counter*>(&balance_.active), static_cast<Counter>(gifts) << 32 | gifts);
      number = static_cast<std::uint32_t>(before >> 32);
    }
    number = __shfl_sync(kAllLanes, number, 0);
    std::uint32_t count = height_ / (gifts + 1);
    count = count < kFull ? count : kFull;
    for (std::uint32_t i = 0; i < gifts; ++i) give(number + i, count);
  }

  /// Numbers take the mailboxes in turn. A mailbox tells which turn it serves, and of the number of that turn
  /// how many entries it got, kHome where there will be none, or kTaken once that was seen to; 0 before the
  /// first.
  __device__ std::uint32_t place_of(std::uint32_t number) const {
    return number & ((1u << args_.mailbox_bits) - 1);
  }
  __device__ std::uint32_t turn_of(std::uint32_t number) const {
    return number >> args_.mailbox_bits;
  }

  /// Gives back the mailbox of the last gift, and the chunk with it. By lane 0: not when the gift is
  /// received, because the fence takes as long as a hundred instructions, but when the warp is idle again.
  __device__ void give_back() const {
    const std::uint32_t number = load_shared(held());
    if (number == kNothing) return;
    store_release(&balance_.mailbox[place_of(number)], turn_of(number) << 8 | kTaken);
    store_shared(held(), kNothing);
  }

  /// Where another number had the mailbox before, the warp with that number gives it back. So does this warp
  /// before it waits for that: then none waits for another in a circle. At least twice as many entries are
  /// there as are given.
  __device__ void give(std::uint32_t number, std::uint32_t count) {
    std::uint32_t* const mailbox = &balance_.mailbox[place_of(number)];
    if (turn_of(number) != 0) {
      if (lane_ == 0) {
        give_back();
        const std::uint32_t given_back = (turn_of(number) - 1) << 8 | kTaken;
        while (load_relaxed(mailbox) != given_back || load_acquire(mailbox) != given_back) {
        }
      }
      __syncwarp();
    }
    height_ -= count;
    std::uint32_t bits = 0;
    if (lane_ < count) {
      const uint4 entry = load_shared4(stack_ + 16 * lane_);
      bits = __popc(entry.w & 0xFFFFu);
      store_entry(&args_.chunks[place_of(number)].entry[lane_], entry);
      // The newest fill the gap.
      store_shared4(stack_ + 16 * lane_, load_shared4(stack_ + 16 * (height_ + lane_)));
    }
    waiting_ -= __reduce_add_sync(kAllLanes, bits);
    __syncwarp();
    if (lane_ == 0) store_relaxed(mailbox, turn_of(number) << 8 | count);
  }

  /// How many entries a mailbox has for the number of this turn, or kHome.
  __device__ static std::uint32_t gift_in(std::uint32_t word, std::uint32_t turn) {
    return word >> 8 == turn ? word & 0xFFu : 0;
  }

  /// Asks for entries that another warp gives away, and waits. False: there are none any more.
  __device__ bool wait_for_gift() {
    std::uint32_t number = 0, count = 0;
    bool last = false;
    if (lane_ == 0) {
      give_back();
      number = atomicAdd(&balance_.asked, 1u);
      // Nobody sees that this warp is no longer active before its number is given out.
      last = subtract_release(&balance_.active, 1) == 1;
    }
    if (__shfl_sync(kAllLanes, last, 0)) send_home();
    number = __shfl_sync(kAllLanes, number, 0);
    if (lane_ == 0) {
      std::uint32_t* const mailbox = &balance_.mailbox[place_of(number)];
      while ((count = gift_in(load_relaxed(mailbox), turn_of(number))) == 0) __nanosleep(100);
      if (count == kHome) store_relaxed(mailbox, turn_of(number) << 8 | kTaken);
    }
    count = __shfl_sync(kAllLanes, count, 0);
    if (count == kHome) return false;
    std::uint32_t bits = 0;
    if (lane_ < count) {
      // The number may be there before the entries are, each of which has a bit.
      uint4* const from = &args_.chunks[place_of(number)].entry[lane_];
      uint4 entry;
      do {
        entry = load_entry(from);
      } while (entry.w == 0);
      store_entry(from, {0, 0, 0, 0});
      store_shared4(stack_ + 16 * lane_, entry);
      bits = __popc(entry.w & 0xFFFFu);
    }
    height_ = count;
    waiting_ = __reduce_add_sync(kAllLanes, bits);
    if (lane_ == 0) store_shared(held(), number);
    __syncwarp();
    return true;
  }

  /// Sends the warps that wait home, this one among them, if still none is active: blocks that start late
  /// have object pairs of their own. With active == 0 all that was given has been received, and all mailboxes
  /// of earlier turns were given back. The numbers that go home count as given from then on, in one step with
  /// the look at `active`, so that a warp that starts later gives nothing to those who have gone.
  __device__ void send_home() {
    std::uint32_t first = 0, end = 0;
    if (lane_ == 0) {
      __threadfence();
      auto* const both = reinterpret_cast<Counter*>(&balance_.active);  // given in the upper half
      for (;;) {
        const Counter before = *static_cast<volatile Counter*>(both);
        const std::uint32_t given = static_cast<std::uint32_t>(before >> 32),
                            asked = *static_cast<volatile std::uint32_t*>(&balance_.asked);
        if (static_cast<std::uint32_t>(before) != 0 || static_cast<int>(asked - given) <= 0) break;
        if (atomicCAS(both, before, static_cast<Counter>(asked) << 32) == before) {
          first = given, end = asked;
          break;
        }
      }
    }
    first = __shfl_sync(kAllLanes, first, 0);
    end = __shfl_sync(kAllLanes, end, 0);
    for (std::uint32_t i = first + lane_; static_cast<int>(end - i) > 0; i += 32) {
      store_relaxed(&balance_.mailbox[place_of(i)], turn_of(i) << 8 | kHome);
    }
  }

  const QueryArgs& args_;
  Balance& balance_;
  const std::uint32_t positions_;
  std::uint32_t stack_;  // address
  std::uint32_t lane_;
  std::uint32_t rounds_ = 0;
  std::uint32_t height_ = 0, leaf_pairs_ = 0;   // entries
  std::uint32_t waiting_ = 0, candidates_ = 0;  // their bits
  std::uint32_t out_count_ = 0;
  std::uint32_t block_pairs_ = 0, candidates_seen_ = 0;  // of this lane
  bool more_input_ = true;
};

template <class Means>
__global__ void __launch_bounds__(32 * kWarpsPerBlock, kBlocksPerProcessor)
    walk(const __grid_constant__ QueryArgs args) {
  extern __shared__ float4 memory[];
  fill_positions(reinterpret_cast<std::uint32_t*>(memory));
  __syncthreads();
  wait_for_kernel_before();
  if (failed(args)) return;
  const auto positions = static_cast<std::uint32_t>(__cvta_generic_to_shared(memory));
  Walk<Means> walk(args, positions,
                   positions + 4 * (kSharedWords + threadIdx.x / 32 * warp_words(args.stack_size)));
  walk.run();
}

template <class Means>
cudaError_t launch_walk(const QueryArgs& args, cudaStream_t stream) {
  const auto kernel = walk<Means>;
  const std::size_t bytes =
      (kSharedWords + kWarpsPerBlock * warp_words(args.stack_size)) * sizeof(std::uint32_t);
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
  // Where more is given than was asked for, no look finds anybody waiting, so each warp gives once more at
  // most: no more than kMostGifts a warp are given ahead, and the number that had a mailbox before was asked
  // for.
  constexpr std::uint32_t kGiftsPerBlock = kMostGifts * kWarpsPerBlock;
  blocks = std::min(blocks * processors, static_cast<int>(kChunks / kGiftsPerBlock));
  if (args.most_blocks != 0) blocks = std::min(blocks, static_cast<int>(args.most_blocks));
  QueryArgs with_mailboxes = args;
  with_mailboxes.mailbox_bits =
      static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint32_t>(blocks) * kGiftsPerBlock - 1));
  return launch_after({static_cast<unsigned>(blocks), 32 * kWarpsPerBlock, bytes, stream}, kernel,
                      with_mailboxes);
}

}  // namespace
}  // namespace tandem::gpu
