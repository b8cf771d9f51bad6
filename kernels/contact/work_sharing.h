#pragma once
#include <cstdint>

#include "tandem/formats/platform.h"

#ifdef __CUDACC__
#define TANDEM_WARP_CODE __device__
#else
#define TANDEM_WARP_CODE
#endif

// The warps of a walk share their work by this protocol. The GPU runs this code through SharingWarp
// (sharing_warp.cuh); tests/gpu_protocol runs the same code on the CPU, in all orders that weakly ordered
// memory allows.
//
// A warp without work takes a **ticket**, the next of 0, 1, 2, ..., and waits at a **mailbox**. A warp that
// has enough work gives some of it, a **gift**, to the lowest ticket that got none. The warp that goes idle
// when no other is active sends all that wait **home**. Ticket t has mailbox t mod M, M being the number of
// mailboxes, and is its owner of **turn** t div M.
//
// **Words that warps share**, all of them 0 at first:
//
//   counts       63           32 31        16 15         0    value: given 2^32 + waiting 2^16 + active
//               +---------------+------------+------------+   active:  warps that have work, and gifts on
//               |     given     |  waiting   |   active   |            their way to one that will
//               +---------------+------------+------------+   waiting: tickets taken less `given`, signed
//                                                             given:   tickets that got a gift or went home
//   mailbox[m]   31                      8 7          0
//               +-------------------------+------------+      state: entries of a gift (1 to 32), kHome or
//               |           turn          |   state    |      kGivenBack; words of a mailbox only grow
//               +-------------------------+------------+
//   gift[m]      entries, each of them words that are not 0; 0 where there is none
//
// **Who writes which word when.** `counts` changes by 64-bit atomic operations alone:
//
//   a warp begins           active + 1
//   a warp goes idle        active - 1, waiting + 1; release. Its ticket is given + waiting as they were.
//   k gifts are announced   active + k, waiting - k, given + k. They go to tickets from `given` as it was.
//   all are sent home       from active = 0 and waiting > 0: waiting = 0, given + waiting; acquire
//
// The mailbox of a ticket is written once by the warp that announced its gift, with a store, or by the warp
// that sent it home, with an atomic maximum. After a gift the ticket's owner writes kGivenBack, with release:
// when it goes idle, or before it waits for a mailbox itself. A giver writes entries and the mailbox only
// when it has seen, with acquire, that the ticket M before gave the mailbox back or went home; in turn 0
// there is none. A word of an entry is written by that giver, and by the ticket's owner, who takes it by an
// atomic exchange for 0.
//
// **With active = 0 nothing is under way.** A gift counts as active from its announcement, by a warp that is
// active, until its receiver goes idle, which has given the mailbox back before. Whoever sees active = 0 with
// acquire sees all of that done.
//
// **No work is lost, and none is done twice.** The number of a gift's entries reaches only the owner of its
// ticket, since a mailbox names the turn. An exchange takes a word of an entry: words that a giver wrote are
// not 0, and the exchange that follows one in the order of its address is the only one that gets it. So the
// mailbox and the entries need no order among themselves: an owner who sees its mailbox before an entry tries
// again, and what an earlier owner took is no longer there for it. The words of the next gift come behind
// that exchange in the order of the address, because their giver has seen, with acquire, that the mailbox was
// given back. Where tickets went home in between, it acquires the same: each kHome is an atomic operation on
// the mailbox, and the first of them comes behind kGivenBack, since its sender has seen active = 0.
//
// **Nobody waits for ever.**
// (1) A look at `counts` may be old, but not older than the warp's own last change. So a warp that gives has
//     seen tickets taken beyond its own last gift, and each warp has at most one announcement that reaches
//     beyond the tickets taken: given <= tickets taken + kMostGifts * warps at any time. With
//     M >= kMostGifts * warps, the ticket M before one that is given was taken, by a warp that runs.
// (2) Of all givers that wait for a mailbox, consider the one with the lowest ticket. The ticket M before it
//     was sent home, or its gift is delivered, since its giver does not wait. Its owner then gives the
//     mailbox back, because no warp waits for a mailbox while it keeps one.
// (3) A ticket below `given` gets what was announced. If only tickets from `given` on wait, some warp is
//     active, or the last that went idle saw active = 0 and sends them home, unless others began since, of
//     which the last does so.
// (4) A warp that begins when all have gone finds that none waits, gives nothing to those who have gone, and
//     is the last when it goes idle. No warp waits for one that has not begun.
// (5) Words of a mailbox only grow, so a kHome that comes late replaces nothing that a later ticket is told.
//     An owner who finds a later turn in its mailbox, without having received a gift, was sent home.
//
// **Sizes.** -kMostGifts * warps <= waiting <= warps by (1). A gift announced ahead of its ticket counts as
// active, so active <= (kMostGifts + 2) * warps. Both fit into 16 bits for kMostWarps warps. A warp that has
// seen given >= kEndOfTickets gives nothing more; at most (kMostGifts + 1) * warps tickets are numbered from
// then on. So all fit into 32 bits, no ticket comes twice, and turns fit into 24 bits, since there are at
// least 2^kFewestMailboxBits mailboxes. The walk ends without gifts then; so many gifts take a GPU minutes.
namespace tandem::gpu {

inline constexpr std::uint32_t kMostGifts = 3;          // at once
inline constexpr std::uint32_t kMostWarps = 8192;       // of a walk
inline constexpr std::uint32_t kFewestMailboxBits = 8;  // so that a turn has 24
inline constexpr std::uint32_t kEndOfTickets = 0u - (kMostGifts + 1) * kMostWarps;
static_assert(kMostGifts * kMostWarps <= 1u << 15 && (kMostGifts + 2) * kMostWarps < 1u << 16);

/// The fields of `counts`.
struct Counts {
  std::uint32_t active;
  std::int32_t waiting;
  std::uint32_t given;
};

TANDEM_HD constexpr Counts counts_of(std::uint64_t word) {
  return {static_cast<std::uint32_t>(word & 0xFFFFu), static_cast<std::int16_t>(word >> 16 & 0xFFFFu),
          static_cast<std::uint32_t>((word + (std::uint64_t{1} << 31)) >> 32)};
}

/// Returns the word of these fields, which is also what is added to `counts` where fields change by so much.
TANDEM_HD constexpr std::uint64_t word_of(std::int64_t active, std::int64_t waiting, std::int64_t given) {
  return static_cast<std::uint64_t>(active) + (static_cast<std::uint64_t>(waiting) << 16) +
         (static_cast<std::uint64_t>(given) << 32);
}

inline constexpr std::uint32_t kHome = 0xFEu, kGivenBack = 0xFFu;  // states of a mailbox

TANDEM_HD constexpr std::uint32_t mailbox_word(std::uint32_t turn, std::uint32_t state) {
  return turn << 8 | state;
}

/// Returns what the owner of a turn reads in its mailbox before it has received a gift: the number of entries
/// of one, kHome, or 0 as long as it has to wait.
TANDEM_HD constexpr std::uint32_t told(std::uint32_t mailbox, std::uint32_t turn) {
  if (mailbox >> 8 == turn) return mailbox & 0xFFu;
  return mailbox >> 8 > turn ? kHome : 0;
}

/// Returns whether the owner of a turn is done with its mailbox.
TANDEM_HD constexpr bool is_free_after(std::uint32_t mailbox, std::uint32_t turn) {
  return mailbox == mailbox_word(turn, kHome) || mailbox == mailbox_word(turn, kGivenBack);
}

/// The part of one warp in the protocol. Warp says how a warp reaches the words above; all lanes call each
/// function.
template <class Warp>
class WorkSharing {
 public:
  TANDEM_WARP_CODE explicit WorkSharing(const Warp& warp) : warp_(warp) {}

  /// Counts the warp as active. Condition: before it takes work.
  TANDEM_WARP_CODE void begin() const {
    if (warp_.is_first()) warp_.add(word_of(1, 0, 0));
  }

  /// Returns how many gifts, at most so many, there were tickets for at the last look.
  TANDEM_WARP_CODE std::uint32_t gifts_wanted(std::uint32_t most) const {
    const Counts seen = counts_of(warp_.seen());
    if (seen.waiting <= 0 || seen.given >= warp_.tickets_end()) return 0;
    return static_cast<std::uint32_t>(seen.waiting) < most ? static_cast<std::uint32_t>(seen.waiting) : most;
  }

  /// Announces gifts. Result: the first of their tickets. Condition: gifts_wanted(), and the warp has work.
  TANDEM_WARP_CODE std::uint32_t announce(std::uint32_t gifts) const {
    std::uint32_t first = 0;
    if (warp_.is_first()) first = counts_of(warp_.add(word_of(gifts, -std::int64_t{gifts}, gifts))).given;
    return warp_.broadcast(first);
  }

  /// Gives entries to a ticket. entry_of(lane, words) takes one off for each lane below `count`. Condition:
  /// the ticket was announced.
  template <class EntryOf>
  TANDEM_WARP_CODE void give(std::uint32_t ticket, std::uint32_t count, EntryOf entry_of) const {
    if (turn_of(ticket) != 0) wait_for_mailbox(ticket);
    warp_.each_lane(count, [&](std::uint32_t lane) {
      std::uint64_t words[Warp::kEntryWords];
      entry_of(lane, words);
      warp_.store_entry(place_of(ticket), lane, words);
    });
    if (warp_.is_first()) warp_.store_mailbox(place_of(ticket), mailbox_word(turn_of(ticket), count));
  }

  /// Takes a ticket and waits. put(lane, words) puts each entry of a gift on. Result: how many; 0: all work
  /// is done, and the warp leaves. Condition: the warp has no work.
  template <class Put>
  TANDEM_WARP_CODE std::uint32_t receive(Put put) const {
    const std::uint32_t ticket = go_idle();
    std::uint32_t count = 0;
    if (warp_.is_first()) {
      while ((count = told(warp_.load_mailbox(place_of(ticket)), turn_of(ticket))) == 0) warp_.sleep();
    }
    count = warp_.broadcast(count);
    if (count == kHome) return 0;
    warp_.each_lane(count, [&](std::uint32_t lane) {
      std::uint64_t words[Warp::kEntryWords];
      take_entry(place_of(ticket), lane, words);
      put(lane, words);
    });
    if (warp_.is_first()) warp_.keep_ticket(ticket);
    warp_.sync();  // all lanes have taken their entries before lane 0 gives the mailbox back
    return count;
  }

 private:
  TANDEM_WARP_CODE std::uint32_t place_of(std::uint32_t ticket) const {
    return ticket & ((1u << warp_.mailbox_bits()) - 1);
  }
  TANDEM_WARP_CODE std::uint32_t turn_of(std::uint32_t ticket) const {
    return ticket >> warp_.mailbox_bits();
  }

  /// Gives back the mailbox of the last gift received. By the first lane: not at once when the gift is
  /// received, because a release takes as long as a hundred instructions, but when the warp is idle again.
  TANDEM_WARP_CODE void give_back() const {
    const std::uint32_t ticket = warp_.kept_ticket();
    if (ticket == Warp::kNoTicket) return;
    warp_.release_mailbox(place_of(ticket), mailbox_word(turn_of(ticket), kGivenBack));
    warp_.keep_ticket(Warp::kNoTicket);
  }

  /// Waits until the mailbox is free. Gives back the warp's own before: then none waits for another in a
  /// circle.
  TANDEM_WARP_CODE void wait_for_mailbox(std::uint32_t ticket) const {
    const std::uint32_t place = place_of(ticket), turn_before = turn_of(ticket) - 1;
    if (warp_.is_first()) {
      give_back();
      // Relaxed at first: an acquire empties the L1 cache.
      while (!is_free_after(warp_.load_mailbox(place), turn_before) ||
             !is_free_after(warp_.acquire_mailbox(place), turn_before)) {
        warp_.spin();
      }
    }
    warp_.sync();
  }

  /// Result: the warp's ticket.
  TANDEM_WARP_CODE std::uint32_t go_idle() const {
    constexpr std::uint64_t kIdle = word_of(-1, 1, 0);
    std::uint32_t ticket = 0;
    std::uint64_t counts = 0;
    if (warp_.is_first()) {
      give_back();
      counts = warp_.add_release(kIdle);
      const Counts before = counts_of(counts);
      ticket = before.given + static_cast<std::uint32_t>(before.waiting);
      counts = before.active == 1 ? counts + kIdle : 0;
    }
    if (warp_.broadcast(counts != 0)) send_home(counts);
    return warp_.broadcast(ticket);
  }

  /// Sends all that wait home, this warp among them, if still none is active. counts: as this warp left them.
  /// The look at `active` and what counts as given are one step, so a warp that begins later gives nothing to
  /// those who have gone.
  TANDEM_WARP_CODE void send_home(std::uint64_t counts) const {
    std::uint32_t first = 0, end = 0;
    if (warp_.is_first()) {
      for (;;) {
        const Counts now = counts_of(counts);
        if (now.active != 0 || now.waiting <= 0) break;
        const std::uint64_t before = warp_.compare_and_swap(counts, word_of(0, 0, now.given + now.waiting));
        if (before == counts) {
          first = now.given, end = first + static_cast<std::uint32_t>(now.waiting);
          break;
        }
        counts = before;
      }
    }
    first = warp_.broadcast(first);
    end = warp_.broadcast(end);
    if (first == end) return;
    warp_.sync();
    for (; first < end; first += Warp::kLanes) {
      warp_.each_lane(end - first, [&](std::uint32_t lane) {
        const std::uint32_t ticket = first + lane;
        warp_.raise_mailbox(place_of(ticket), mailbox_word(turn_of(ticket), kHome));
      });
    }
  }

  TANDEM_WARP_CODE void take_entry(std::uint32_t place, std::uint32_t lane,
                                   std::uint64_t (&words)[Warp::kEntryWords]) const {
    for (int i = 0; i < Warp::kEntryWords; ++i) words[i] = warp_.exchange_entry_word(place, lane, i);
    for (int i = 0; i < Warp::kEntryWords; ++i) {
      while (words[i] == 0) {
        warp_.spin();
        words[i] = warp_.exchange_entry_word(place, lane, i);
      }
    }
  }

  Warp warp_;
};

}  // namespace tandem::gpu
