#pragma once
#include <bit>
#include <cstdint>

#include "dynamics/pair_colours.h"
#include "dynamics/parallel/atomics.h"
#include "dynamics/parallel/bytes_of.h"
#include "dynamics/parallel/contact_pair.h"
#include "dynamics/parallel/turns.h"
#include "dynamics/parallel/worker.h"

namespace tandem::dynamics {

/// Says when a pair has its turn at a body in a sweep over all pairs: `turn` others come before it, of
/// `turns`.
struct BodyTurn {
  std::uint32_t turn, turns;
};

/// The colours that a body's pairs have so far: bit i of word w of half h is colour 64 h + 32 w + i.
struct TakenColours {
  TurnWord half[2];
};

/// Numbers of a colouring, in the executor's memory.
struct ColouringNumbers {
  std::uint32_t own;  ///< pairs that have a colour of their own
  double most_mass;   ///< of a body that moves and has pairs
};

/// All that a colouring reads and writes.
struct ColouringView {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  ContactPairs pairs;
  ColouringNumbers* numbers;
  // Of each body:
  std::uint32_t *pairs_of, *first_of;  // how many pairs move it, and where these are in `list`
  std::uint32_t* own_of;               // how many of them have a colour of their own
  TakenColours* taken;
  // Of each pair, and of its two bodies:
  std::uint32_t* colour;
  std::uint32_t* order;
  BodyTurn* turn;       // `turns` is the pair's place among the body's in `list`, before there are colours
  std::uint32_t* list;  // pairs, body by body
  std::uint32_t* own;   // those that have a colour of their own

  /// Returns a number by which pairs have their colours.
  TANDEM_HD std::uint64_t rank(std::uint32_t pair) const { return std::uint64_t{order[pair]} << 32 | pair; }
  TANDEM_HD bool has(std::uint32_t pair, std::uint32_t body) const {
    return pairs.pairs[pair].a == body || pairs.pairs[pair].b == body;
  }
};

namespace pair_colouring_detail {

TANDEM_HD inline std::uint32_t ones(std::uint32_t bits) {
#ifdef __CUDA_ARCH__
  return static_cast<std::uint32_t>(__popc(static_cast<int>(bits)));
#else
  return static_cast<std::uint32_t>(std::popcount(bits));
#endif
}

/// Condition: bits is not 0.
TANDEM_HD inline std::uint32_t lowest(std::uint32_t bits) {
#ifdef __CUDA_ARCH__
  return static_cast<std::uint32_t>(__ffs(static_cast<int>(bits)) - 1);
#else
  return static_cast<std::uint32_t>(std::countr_zero(bits));
#endif
}

/// Returns how many of a body's shared colours are below this one.
TANDEM_HD inline std::uint32_t taken_below(const TakenColours& taken, std::uint32_t colour) {
  std::uint32_t count = 0;
  for (std::uint32_t word = 0; word < kSharedColours / 32; ++word) {
    const std::uint32_t bits = taken.half[word / 2].data[word % 2], begin = 32 * word;
    if (colour >= begin + 32)
      count += ones(bits);
    else if (colour > begin)
      count += ones(bits & ((1u << (colour - begin)) - 1));
  }
  return count;
}

/// Notes a pair at the bodies that it moves.
TANDEM_HD inline void note(const ColouringView& view, std::uint32_t i) {
  const ContactPair& pair = view.pairs.pairs[i];
  std::uint32_t moved[2];
  for (int side = 0; side < 2; ++side) {
    const std::uint32_t body = pair.body(side);
    moved[side] = view.pairs.is_moved(body) ? body : 0;
    if (!view.pairs.is_moved(body)) continue;
    const std::uint32_t before = atomic_add(view.pairs_of[body], 1);
    view.turn[2 * i + side] = {0, before};
    if (before == 0) atomic_most(view.numbers->most_mass, view.pairs.bodies[body].mass);
  }
  view.order[i] = colouring_order(moved[0], moved[1]);
  view.colour[i] = ColouringView::kNone;
}

TANDEM_HD inline void list_pair(const ColouringView& view, std::uint32_t i) {
  for (int side = 0; side < 2; ++side) {
    const std::uint32_t body = view.pairs.pairs[i].body(side);
    if (view.pairs.is_moved(body)) view.list[view.first_of[body] + view.turn[2 * i + side].turns] = i;
  }
}

/// Finds how many of each body's pairs come before this one.
TANDEM_HD inline void find_turns(const ColouringView& view, std::uint32_t i) {
  const std::uint64_t rank = view.rank(i);
  for (int side = 0; side < 2; ++side) {
    const std::uint32_t body = view.pairs.pairs[i].body(side);
    if (!view.pairs.is_moved(body)) continue;
    std::uint32_t before = 0;
    for (std::uint32_t k = view.first_of[body]; k < view.first_of[body + 1]; ++k)
      before += view.rank(view.list[k]) < rank ? 1 : 0;
    view.turn[2 * i + side].turn = before;
  }
}

/// Gives the pair a colour if all that come before it at its bodies have theirs. Else the result is false.
TANDEM_HD inline bool colour(const ColouringView& view, std::uint32_t i) {
  const ContactPair& pair = view.pairs.pairs[i];
  TakenColours taken[2] = {};
  std::uint32_t turns[2] = {};
  for (int side = 0; side < 2; ++side) {
    const std::uint32_t body = pair.body(side);
    if (!view.pairs.is_moved(body)) continue;
    turns[side] = view.turn[2 * i + side].turn;
    for (int half = 0; half < 2; ++half)
      taken[side].half[half] = look_for_turn(view.taken[body].half[half], turns[side]);
  }
  for (int side = 0; side < 2; ++side) {
    for (const TurnWord& half : taken[side].half) {
      if (half.turn != turns[side]) return false;
    }
  }
  std::uint32_t found = ColouringView::kNone;
  for (std::uint32_t word = 0; word < kSharedColours / 32 && found == ColouringView::kNone; ++word) {
    std::uint32_t &of_a = taken[0].half[word / 2].data[word % 2],
                  &of_b = taken[1].half[word / 2].data[word % 2];
    const std::uint32_t free = ~(of_a | of_b), first = free & (0u - free);
    if (free != 0) found = 32 * word + lowest(free);
    of_a |= first, of_b |= first;
  }
  if (found == ColouringView::kNone) {
    const std::uint32_t place = atomic_add(view.numbers->own, 1);
    view.own[place] = i;
    found = kSharedColours + place;
  }
  view.colour[i] = found;
  for (int side = 0; side < 2; ++side) {
    const std::uint32_t body = pair.body(side);
    if (!view.pairs.is_moved(body)) continue;
    if (found >= kSharedColours) atomic_add(view.own_of[body], 1);
    for (int half = 0; half < 2; ++half)
      give_turn(view.taken[body].half[half], turns[side] + 1, taken[side].half[half].data);
  }
  return true;
}

/// Gives the k-th pair that has a colour of its own the one that is due to it.
TANDEM_HD inline void number_own(const ColouringView& view, std::uint32_t k) {
  const std::uint32_t i = view.own[k];
  const std::uint64_t rank = view.rank(i);
  std::uint32_t before = 0, before_at[2] = {};
  for (std::uint32_t j = 0; j < view.numbers->own; ++j) {
    const std::uint32_t other = view.own[j];
    if (view.rank(other) >= rank) continue;
    ++before;
    for (int side = 0; side < 2; ++side)
      before_at[side] += view.has(other, view.pairs.pairs[i].body(side)) ? 1 : 0;
  }
  view.colour[i] = kSharedColours + before;
  for (int side = 0; side < 2; ++side) view.turn[2 * i + side].turn = before_at[side];
}

}  // namespace pair_colouring_detail

/// Returns when pair i has its turn at one of its bodies, colour by colour. Condition: contacts move it.
TANDEM_HD inline BodyTurn turn_in_sweep(const ColouringView& view, std::uint32_t i, int side) {
  using namespace pair_colouring_detail;
  const std::uint32_t body = view.pairs.pairs[i].body(side), colour = view.colour[i];
  const std::uint32_t shared = taken_below(view.taken[body], kSharedColours);
  return {
      colour < kSharedColours ? taken_below(view.taken[body], colour) : shared + view.turn[2 * i + side].turn,
      shared + view.own_of[body]};
}

/// Gives pairs the colours that find_colours() finds; see there. A pair has its colour when all that come
/// before it at one of its bodies have theirs. Executor: HostExecutor or CudaExecutor.
template <typename Executor>
class PairColouring {
 public:
  Status reserve(std::uint32_t bodies, std::uint32_t pairs) {
    Status status = Status::kOk;
    const auto take = [&](Status of) {
      if (status == Status::kOk) status = of;
    };
    bodies_ = bodies;
    take(numbers_.reserve(1)), take(taken_.reserve(bodies));
    take(of_bodies_.reserve(3 * std::uint64_t{bodies} + 1));
    take(turns_.reserve(2 * std::uint64_t{pairs})), take(of_pairs_.reserve(5 * std::uint64_t{pairs}));
    return status;
  }

  /// Condition: there is room for all bodies and for as many pairs as pairs.most.
  void find(Executor& executor, const ContactPairs& pairs, std::uint32_t bodies) {
    using namespace pair_colouring_detail;
    const ColouringView view = view_of(pairs);
    view_ = view;
    executor.for_each(nullptr, bodies, [=] TANDEM_HD(std::uint32_t i) {
      view.pairs_of[i] = 0, view.own_of[i] = 0, view.taken[i] = {};
      if (i == 0) *view.numbers = {};
    });
    if (bodies == 0) executor.once([=] TANDEM_HD() { *view.numbers = {}; });
    executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { note(view, i); });
    executor.sum_before(view.pairs_of, nullptr, bodies, view.first_of);
    executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { list_pair(view, i); });
    executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { find_turns(view, i); });
    executor.together((pairs.most + 31) / 32, [=] TANDEM_HD(const Worker& worker) {
      const std::uint32_t workers = worker.teams * worker.lanes, count = view.pairs.size();
      for (bool is_left = true; is_left; wait_for_turn()) {
        is_left = false;
        for (std::uint32_t i = worker.team * worker.lanes + worker.lane; i < count; i += workers) {
          if (view.colour[i] == ColouringView::kNone && !colour(view, i)) is_left = true;
        }
      }
    });
    executor.for_each(&view.numbers->own, pairs.most,
                      [=] TANDEM_HD(std::uint32_t k) { number_own(view, k); });
  }

  /// The result of the last find().
  const ColouringView& view() const { return view_; }
  std::size_t bytes() const { return bytes_of(numbers_, taken_, of_bodies_, of_pairs_, turns_); }

 private:
  ColouringView view_of(const ContactPairs& pairs) const {
    std::uint32_t *const of_bodies = of_bodies_.data(), *const of_pairs = of_pairs_.data();
    const std::uint64_t bodies = bodies_, most = of_pairs_.room() / 5;
    return {
        pairs,    numbers_.data(), of_bodies,     of_bodies + 2 * bodies, of_bodies + bodies, taken_.data(),
        of_pairs, of_pairs + most, turns_.data(), of_pairs + 2 * most,    of_pairs + 4 * most};
  }

  template <typename T>
  using Array = typename Executor::template Array<T>;

  std::uint32_t bodies_ = 0;
  ColouringView view_ = {};
  Array<ColouringNumbers> numbers_;
  Array<TakenColours> taken_;
  Array<std::uint32_t> of_bodies_, of_pairs_;
  Array<BodyTurn> turns_;
};

}  // namespace tandem::dynamics
