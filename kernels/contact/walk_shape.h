#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>

#include "kernels/common/device_limits.h"
#include "kernels/contact/work_sharing.h"
#include "tandem/formats/block.h"
#include "tandem/formats/platform.h"

// The shape of a walk says how it is launched on a GPU: how many warps there are, and the room of a warp's
// stack.
namespace tandem::gpu {

// Shared memory in words of 32 bits: of a thread block beside its warps, of a warp beside its stack, and of
// an entry of the stack.
inline constexpr std::uint32_t kBlockWords = 256, kWarpWords = 328, kEntryWords = 4;

/// Warps of a thread block, at most. They take all registers of a multiprocessor: each holds one block.
inline constexpr std::uint32_t kMostWarpsPerBlock = 16;

inline constexpr std::uint32_t kMostMailboxes = 1u << 14;

/// Room that no warp's stack goes without, see block_pairs_to_take(): one entry for each level of two trees,
/// and 32.
constexpr std::uint32_t stack_reserve(std::uint32_t depth) {
  return 2 * depth + 32;
}

/// Entries of a stack beyond its reserve. The fewest let a warp begin: when it takes object pairs, less than
/// 32 block pairs and less than 32 candidates wait, so 31 + 31 entries lie there at most and 16 come on; when
/// it gets a gift, 31 lie there and 32 come on. With more entries, more lanes have work when room is short.
inline constexpr std::uint32_t kEntries = 208, kFewestEntries = 80;

/// Returns how many block pairs a warp's next step takes off its stack, of those that wait. room: entries
/// that are free.
///
/// A step puts on one entry at most for each block pair that it takes off, so it takes no more than there is
/// room for beyond the reserve: it leaves the reserve free. Where no more than the reserve is free, a step
/// takes one, from the newest entry. The first of these steps finds all of the reserve, since the step before
/// it left that, or since object pairs or a gift came, for which there are kFewestEntries. From there on
/// until the first entry below is reached again, each entry of the stack comes from a block pair of the entry
/// below it, whose level, that of its blocks added up, is higher: there are at most as many as the two trees
/// have levels. Pairs of leaf blocks have a candidate each, and a step begins with less than 32 of these: at
/// most 32 come on. So the stack never overflows.
TANDEM_HD constexpr std::uint32_t block_pairs_to_take(std::uint32_t waiting, std::uint32_t room,
                                                      std::uint32_t reserve) {
  const std::uint32_t count = waiting < 32 ? waiting : 32;
  if (room >= count + reserve) return count;
  return room > reserve ? room - reserve : 1;
}

/// Room beyond the reserve that lets a step take the oldest block pairs instead of the newest. Theirs are the
/// longest ways that are left, so a walk that takes them first ends sooner; but more entries come on before
/// the first of them is done. With less room steps take the newest, so the proof above holds.
inline constexpr std::uint32_t kRoomForOldest = 112;

TANDEM_HD constexpr bool has_room_for_oldest(std::uint32_t room, std::uint32_t reserve) {
  return room >= reserve + kRoomForOldest;
}

struct WalkShape {
  std::uint32_t warps;         ///< of a thread block
  std::uint32_t blocks;        ///< thread blocks
  std::uint32_t stack_size;    ///< entries of a warp's stack
  std::uint32_t reserve;       ///< of them, stack_reserve()
  std::uint32_t mailbox_bits;  ///< they number the mailboxes in use, see work_sharing.h
  bool shares;                 ///< whether warps give work to each other

  TANDEM_HD constexpr std::uint32_t mailboxes() const { return 1u << mailbox_bits; }
  constexpr std::uint32_t shared_bytes() const {
    return 4 * (kBlockWords + warps * (kWarpWords + kEntryWords * stack_size));
  }
};

/// Returns how many entries the stack of each warp can have.
constexpr std::uint32_t entries_that_fit(std::uint32_t shared_bytes, std::uint32_t warps) {
  const std::uint32_t words = (shared_bytes / 4 - kBlockWords) / warps;
  return words < kWarpWords ? 0 : (words - kWarpWords) / kEntryWords;
}

/// A power of two, as many as work_sharing.h asks for.
constexpr std::uint32_t mailbox_bits_of(std::uint32_t warps) {
  return std::max(kFewestMailboxBits, static_cast<std::uint32_t>(std::bit_width(kMostGifts * warps - 1)));
}

/// Trees of so many levels have too little work in an object pair, 17 block pairs at most, for warps to share
/// it.
inline constexpr std::uint32_t kDepthWithoutSharing = 2;

/// The shape of a walk of trees that are so deep at most. Where shared memory is short, stacks have fewer
/// entries, and at the fewest, thread blocks have fewer warps. most_blocks: thread blocks that the caller
/// allows; 0: as many as the GPU holds. Condition: shared memory of 8 KiB, for one warp with the deepest
/// trees.
constexpr WalkShape walk_shape(const DeviceLimits& limits, std::uint32_t depth, std::uint32_t most_blocks) {
  WalkShape shape = {kMostWarpsPerBlock, 0, 0, stack_reserve(depth), 0, depth > kDepthWithoutSharing};
  while (entries_that_fit(limits.shared_bytes, shape.warps) < shape.reserve + kFewestEntries) --shape.warps;
  shape.stack_size = std::min(shape.reserve + kEntries, entries_that_fit(limits.shared_bytes, shape.warps));
  shape.blocks = std::min(limits.processors, kMostMailboxes / (kMostGifts * shape.warps));
  if (most_blocks != 0) shape.blocks = std::min(shape.blocks, most_blocks);
  shape.mailbox_bits = mailbox_bits_of(shape.warps * shape.blocks);
  return shape;
}

/// Returns the most mailboxes that any walk on this GPU has: none has more warps than with one block for each
/// multiprocessor and no shortage of shared memory.
constexpr std::uint32_t most_mailboxes(const DeviceLimits& limits) {
  return std::min(kMostMailboxes, 1u << mailbox_bits_of(kMostWarpsPerBlock * limits.processors));
}

/// Returns at least the shared memory of any walk on this GPU.
constexpr std::uint32_t most_shared_bytes(const DeviceLimits& limits) {
  const WalkShape largest = {kMostWarpsPerBlock, 0, stack_reserve(kMaxDepth) + kEntries, 0, 0, true};
  return std::min(limits.shared_bytes, largest.shared_bytes());
}

static_assert(kMostMailboxes / kMostGifts <= kMostWarps && kMostMailboxes >= 1u << kFewestMailboxBits);

}  // namespace tandem::gpu
