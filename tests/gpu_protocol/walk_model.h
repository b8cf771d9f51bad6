#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <unordered_set>
#include <vector>

#include "model_warp.h"
#include "weak_memory.h"

/// Warps of a walk that share work by gpu::WorkSharing, the code that the GPU runs, in all orders that
/// WeakMemory allows. A warp's code runs against recorded answers of memory up to its next operation, which
/// is where warps take turns. The work consists of numbered units; a unit may leave others to do.
namespace tandem::test {

struct Finding {
  std::string fault;  // empty: there is none
  std::size_t states = 0, most_tickets = 0;
  bool all_seen = true;  // false: stopped at a limit
};

/// All warps, and memory.
template <int kWordsOfEntry, std::size_t kWords, std::size_t kWarps>
class WalkModel {
 public:
  explicit WalkModel(const Scenario& scenario)
      : scenario_(scenario), program_(scenario_), units_(count_of_units()) {}

  /// All states that can be reached, up to a limit.
  Finding explore(std::size_t most_states) {
    Finding finding;
    std::unordered_set<std::uint64_t> known;
    std::vector<State> open;
    try {
      open.push_back(first());
      known.insert(key_of(open.back()));
      std::vector<State> next;
      while (!open.empty()) {
        if (known.size() > most_states) {
          finding.all_seen = false;
          break;
        }
        const State state = std::move(open.back());
        open.pop_back();
        next.clear();
        bool moves = false;
        for (std::size_t warp = 0; warp < kWarps; ++warp) moves = add_steps(state, warp, next) || moves;
        if (!moves) expect_end(state);
        for (State& each : next) {
          finding.most_tickets = std::max<std::size_t>(finding.most_tickets, tickets_of(each));
          if (known.insert(key_of(each)).second) open.push_back(std::move(each));
        }
      }
    } catch (const Fault& fault) {
      finding.fault = fault.what;
    }
    finding.states = known.size();
    return finding;
  }

  /// One order, drawn by chance. Some warps begin only when no other can go on.
  Finding run_once(std::mt19937& random) {
    Finding finding;
    try {
      State state = first();
      std::array<bool, kWarps> late;
      for (bool& each : late) each = random() % 3 == 0;
      std::vector<State> next;
      for (;; ++finding.states) {
        next.clear();
        const std::size_t from = random() % kWarps;
        for (const bool with_late : {false, true}) {
          for (std::size_t i = 0; i < kWarps && next.empty(); ++i) {
            const std::size_t warp = (from + i) % kWarps;
            if (with_late || !late[warp] || program_[state.place[warp]].local.begun)
              add_steps(state, warp, next);
          }
        }
        if (next.empty()) break;
        state = std::move(next[random() % next.size()]);
        finding.most_tickets = std::max<std::size_t>(finding.most_tickets, tickets_of(state));
      }
      expect_end(state);
    } catch (const Fault& fault) {
      finding.fault = fault.what;
    }
    return finding;
  }

 private:
  using Memory = WeakMemory<kWords, kWarps + 1>;  // one thread that only looks
  using Order = typename Memory::Order;

  struct State {
    Memory memory;
    std::array<int, kWarps> place = {};
    std::uint64_t done[2] = {};  // a bit for each unit
  };

  int count_of_units() const {
    int count = 0;
    for (const auto& units : scenario_.units) {
      for (const int unit : units) count = std::max(count, unit + 1);
    }
    for (const auto& units : scenario_.left_by) {
      for (const int unit : units) count = std::max(count, unit + 1);
    }
    return count;
  }

  State first() {
    const std::size_t mailboxes = std::size_t{1} << scenario_.mailbox_bits;
    const std::size_t words = 1 + mailboxes + mailboxes * scenario_.lanes * kWordsOfEntry;
    if (words > kWords) throw Fault{"too many words for the model"};
    State state = {Memory(words)};
    if (scenario_.left_out != LeftOut::own_change_in_look) state.memory.leave(kWarps);
    for (std::size_t warp = 0; warp < kWarps; ++warp)
      state.place[warp] = program_.begin({scenario_.units[warp]});
    return state;
  }

  static std::uint32_t tickets_of(const State& state) {
    const gpu::Counts counts = gpu::counts_of(state.memory.newest(0));
    return counts.given + static_cast<std::uint32_t>(std::max(counts.waiting, 0));
  }

  void expect_end(const State& state) const {
    for (const int place : state.place) {
      if (!program_[place].local.home) throw Fault{"a warp waits for ever"};
    }
    for (int unit = 0; unit < units_; ++unit) {
      if ((state.done[unit / 64] >> unit % 64 & 1u) == 0) throw Fault{"a unit was never done"};
    }
    const gpu::Counts counts = gpu::counts_of(state.memory.newest(0));
    if (counts.active != 0 || counts.waiting != 0) throw Fault{"counts that do not end at 0"};
  }

  /// Adds the states that a warp's next operation leads to. Result: whether it can do it.
  bool add_steps(const State& state, std::size_t warp, std::vector<State>& out) {
    const auto& at = program_[state.place[warp]];
    if (at.local.home) return false;
    const Operation operation = at.next;
    const std::size_t before = out.size();
    if (operation.kind == Operation::look) {
      add_looks(state, warp, out);
    } else {
      for (std::size_t choice = 0; choice < choices(state, warp, operation); ++choice) {
        add_step(state, warp, operation, choice, out);
      }
    }
    return out.size() > before;
  }

  std::size_t choices(const State& state, std::size_t warp, const Operation& operation) const {
    switch (operation.kind) {
      case Operation::load:
        return state.memory.loads(warp, operation.word);
      case Operation::store:
      case Operation::raise:
      case Operation::exchange:
        return state.memory.changes(warp, operation.word);
      default:
        return 1;
    }
  }

  void add_step(const State& state, std::size_t warp, const Operation& operation, std::size_t choice,
                std::vector<State>& out) {
    if (operation.kind == Operation::load || operation.kind == Operation::exchange) {
      const bool load = operation.kind == Operation::load;
      const std::uint64_t value = load ? state.memory.peek(warp, operation.word, choice)
                                       : state.memory.peek_atomic(operation.word, choice);
      if (program_.after(state.place[warp], value) == program_.kNowhere)
        return add_failed_poll(state, warp, operation, choice, out);
    }
    State next = state;
    const std::uint64_t answer = perform(next, warp, operation, choice);
    next.place[warp] = program_.after(next.place[warp], answer);
    finish(next, warp, out);
  }

  /// A poll that failed leaves the warp where it was, and what it has read.
  void add_failed_poll(const State& state, std::size_t warp, const Operation& operation, std::size_t choice,
                       std::vector<State>& out) {
    const bool load = operation.kind == Operation::load;
    if (!(load ? state.memory.is_news(choice) : state.memory.is_news_to_atomic(warp, operation.word, choice)))
      return;
    State next = state;
    if (load)
      next.memory.load(warp, operation.word, Order::relaxed, choice);
    else
      next.memory.see_by_atomic(warp, operation.word, choice);
    finish(next, warp, out);
  }

  std::uint64_t perform(State& state, std::size_t warp, const Operation& operation, std::size_t choice) {
    const Order order = operation.order == 2   ? Order::release
                        : operation.order == 1 ? Order::acquire
                                               : Order::relaxed;
    switch (operation.kind) {
      case Operation::add:
        return state.memory.change(warp, 0, order, 0,
                                   [&](std::uint64_t word) { return sound(word + operation.a); });
      case Operation::compare_and_swap:
        return compare_and_swap(state, warp, operation, order);
      case Operation::load:
        return state.memory.load(warp, operation.word, order, choice);
      case Operation::store:
        expect_nothing_is_lost(state, operation);
        state.memory.store(warp, operation.word, order, operation.a, choice);
        return 0;
      case Operation::raise:
        state.memory.change(warp, operation.word, order, choice,
                            [&](std::uint64_t word) { return std::max(word, operation.a); });
        return 0;
      case Operation::exchange:
        return state.memory.change(warp, operation.word, order, choice,
                                   [](std::uint64_t) { return std::uint64_t{0}; });
      default:
        return 0;
    }
  }

  std::uint64_t compare_and_swap(State& state, std::size_t warp, const Operation& operation,
                                 Order order) const {
    std::uint64_t expected = operation.a, desired = operation.b;
    const std::uint64_t now = state.memory.newest(0);
    if (scenario_.left_out == LeftOut::comparing_at_home) {
      desired += now - expected;
      expected = now;
    }
    if (now != expected) return now;  // of one that fails no order is asked
    state.memory.change(warp, 0, order, 0, [&](std::uint64_t) { return desired; });
    return operation.a;
  }

  /// A gift that nobody took.
  void expect_nothing_is_lost(const State& state, const Operation& operation) const {
    if (operation.a == 0 || operation.word <= std::size_t{1} << scenario_.mailbox_bits) return;
    if (scenario_.left_out != LeftOut::clearing && state.memory.newest(operation.word) != 0)
      throw Fault{"a gift over a gift that nobody took"};
  }

  std::uint64_t sound(std::uint64_t word) const {
    const gpu::Counts counts = gpu::counts_of(word);
    if (counts.active > 0x8000u) throw Fault{"fewer than no warp is active"};
    if (counts.given > scenario_.most_tickets) throw Fault{"more tickets than there are numbers"};
    return word;
  }

  /// Adds a state for each word that a look may see, where words from which the same follows are one.
  void add_looks(const State& state, std::size_t warp, std::vector<State>& out) {
    std::vector<std::uint64_t> seen;
    const bool any = scenario_.left_out == LeftOut::own_change_in_look;
    for (std::size_t choice = 0; choice < state.memory.loads(any ? kWarps : warp, 0); ++choice) {
      const gpu::Counts counts = gpu::counts_of(state.memory.peek(any ? kWarps : warp, 0, choice));
      const int waiting = std::clamp(counts.waiting, 0, static_cast<int>(scenario_.most_gifts));
      const std::uint64_t word =
          gpu::word_of(0, waiting, counts.given >= scenario_.tickets_end ? scenario_.tickets_end : 0);
      if (std::find(seen.begin(), seen.end(), word) != seen.end()) continue;
      seen.push_back(word);
      State next = state;
      next.place[warp] = program_.after(next.place[warp], word);
      finish(next, warp, out);
    }
  }

  /// Does what the warp does next, where nobody else sees when it is done.
  void finish(State& state, std::size_t warp, std::vector<State>& out) {
    for (;;) {
      const auto& at = program_[state.place[warp]];
      if (at.local.home) {
        state.memory.leave(warp);
        break;
      }
      if (at.next.kind != Operation::work) break;
      std::uint64_t& done = state.done[at.next.a / 64];
      const std::uint64_t bit = std::uint64_t{1} << at.next.a % 64;
      if ((done & bit) != 0) throw Fault{"a unit was done twice"};
      done |= bit;
      state.place[warp] = program_.after(state.place[warp], 0);
    }
    state.memory.forget();
    out.push_back(std::move(state));
  }

  /// Returns a key that is the same for states that differ by the order of the warps alone.
  static std::uint64_t key_of(const State& state) {
    const auto mix = [](std::uint64_t& hash, std::uint64_t value) {
      hash = (hash ^ value) * 0x9E3779B97F4A7C15u;
      hash ^= hash >> 29;
    };
    std::array<std::uint64_t, kWarps> warps = {};
    for (std::size_t warp = 0; warp < kWarps; ++warp) {
      mix(warps[warp], static_cast<std::uint64_t>(state.place[warp]));
      state.memory.describe_thread(warp, [&](std::uint64_t value) { mix(warps[warp], value); });
    }
    std::sort(warps.begin(), warps.end());
    std::uint64_t hash = state.done[0] * 31 + state.done[1];
    for (const std::uint64_t warp : warps) mix(hash, warp);
    state.memory.describe([&](std::uint64_t value) { mix(hash, value); });
    return hash;
  }

  Scenario scenario_;
  Program<kWordsOfEntry> program_;
  int units_;
};

}  // namespace tandem::test
