#pragma once
#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kernels/contact/work_sharing.h"

namespace tandem::test {

/// A step of the protocol that a test leaves out, to see that the model notices.
enum class LeftOut {
  nothing,
  exchange,                // entries are loaded, and cleared by a store
  clearing,                // entries are not cleared
  giving_back,             // a mailbox is never given back
  giving_back_first,       // a warp that waits for a mailbox keeps its own
  release_of_giving_back,  // a mailbox is given back by a relaxed store
  waiting_for_mailbox,     // a giver takes a mailbox for free at once
  acquire_of_mailbox,      // a giver sees that a mailbox is free by a relaxed load
  turns,                   // mailboxes do not tell their turn
  later_turns,             // an owner does not take a later turn for having been sent home
  counting_gifts,          // gifts on their way do not count as active
  ticket_with_idle,        // a warp goes idle first and takes its ticket then
  release_of_idle,         // going idle is relaxed
  sending_home,            // nobody sends anybody home
  acquire_of_home,         // sending home is relaxed
  comparing_at_home,       // sending home changes `counts` whatever became of them since the look
  counting_home,           // tickets that go home do not count as given
  maximum_of_home,         // kHome is stored, whatever is there
  own_change_in_look,      // a look may be older than the warp's own last change
};

struct Scenario {
  std::vector<std::vector<int>> units;         // that each warp begins with
  std::vector<std::vector<int>> left_by = {};  // units that a unit leaves to do
  std::uint32_t mailbox_bits = 2, most_gifts = 1, lanes = 1, tickets_end = 1000;
  std::uint32_t most_tickets = 1u << 31;  // more are a fault
  LeftOut left_out = LeftOut::nothing;
};

/// One operation of a warp.
struct Operation {
  enum Kind { add, compare_and_swap, load, store, raise, exchange, look, work } kind;
  std::size_t word = 0;
  int order = 0;  // 0 relaxed, 1 acquire, 2 release
  std::uint64_t a = 0, b = 0;
  auto operator<=>(const Operation&) const = default;
};

/// Holds what a warp has between rounds of its walk.
struct Local {
  std::vector<int> units;
  std::uint32_t kept_ticket = ~0u;
  bool begun = false, home = false;
  auto operator<=>(const Local&) const = default;
};

struct Fault {
  std::string what;
};

/// Has what WorkSharing asks of a warp. Operations get the recorded answers; the first without one is thrown.
template <int kWordsOfEntry>
class ModelWarp {
 public:
  static constexpr std::uint32_t kLanes = 2, kNoTicket = ~0u;
  static constexpr int kEntryWords = kWordsOfEntry;

  struct Run {
    const Scenario& scenario;
    const std::vector<std::uint64_t>& answers;
    Local& local;
    std::size_t next = 0;
    std::optional<Operation> last = {};
    bool repeats = false;  // since the last operation
    bool giving = false;
    std::uint64_t seen = 0;
    std::uint32_t ticket = 0;
  };
  struct Pending {
    Operation operation;
    bool repeats_last;  // a poll that failed
  };

  explicit ModelWarp(Run& run) : run_(&run) {}

  bool is_first() const { return true; }
  void sync() const {}
  void sleep() const { run_->repeats = true; }
  void spin() const { run_->repeats = true; }
  template <class Value>
  Value broadcast(Value value) const {
    return value;
  }
  template <class Of>
  void each_lane(std::uint32_t count, Of of) const {
    for (std::uint32_t lane = 0; lane < std::min(count, kLanes); ++lane) of(lane);
  }
  std::uint32_t tickets_end() const { return run_->scenario.tickets_end; }
  std::uint32_t mailbox_bits() const { return leaves_out(LeftOut::turns) ? 31 : run_->scenario.mailbox_bits; }
  std::uint32_t kept_ticket() const {
    return run_->giving && leaves_out(LeftOut::giving_back_first) ? kNoTicket : run_->local.kept_ticket;
  }
  void keep_ticket(std::uint32_t ticket) const { run_->local.kept_ticket = ticket; }

  void look() const { run_->seen = ask({Operation::look}); }
  std::uint64_t seen() const { return run_->seen; }
  void work(int unit) const { ask({Operation::work, 0, 0, static_cast<std::uint64_t>(unit)}); }

  std::uint64_t add(std::uint64_t amount) const {
    const gpu::Counts change = gpu::counts_of(amount);
    if (change.given != 0 && leaves_out(LeftOut::counting_gifts))
      amount = gpu::word_of(0, change.waiting, change.given);
    return ask({Operation::add, 0, 0, amount});
  }
  std::uint64_t add_release(std::uint64_t amount) const {
    const int order = leaves_out(LeftOut::release_of_idle) ? 0 : 2;
    gpu::Counts before;
    if (leaves_out(LeftOut::ticket_with_idle)) {
      before = gpu::counts_of(ask({Operation::add, 0, order, gpu::word_of(-1, 0, 0)}));
      const gpu::Counts later = gpu::counts_of(ask({Operation::add, 0, order, gpu::word_of(0, 1, 0)}));
      before.waiting = later.waiting, before.given = later.given;
    } else {
      before = gpu::counts_of(ask({Operation::add, 0, order, amount}));
    }
    run_->ticket = before.given + static_cast<std::uint32_t>(before.waiting);
    if (leaves_out(LeftOut::sending_home)) before.active += 100;
    return gpu::word_of(before.active, before.waiting, before.given);
  }
  std::uint64_t compare_and_swap(std::uint64_t expected, std::uint64_t desired) const {
    if (leaves_out(LeftOut::counting_home)) desired = expected;
    return ask(
        {Operation::compare_and_swap, 0, leaves_out(LeftOut::acquire_of_home) ? 0 : 1, expected, desired});
  }

  std::uint32_t load_mailbox(std::uint32_t place) const {
    const auto word = static_cast<std::uint32_t>(ask({Operation::load, mailbox(place)}));
    if (run_->giving && leaves_out(LeftOut::waiting_for_mailbox)) return free_word();
    const bool later = !run_->giving && word >> 8 > run_->ticket >> mailbox_bits();
    return later && leaves_out(LeftOut::later_turns) ? 0 : word;
  }
  std::uint32_t acquire_mailbox(std::uint32_t place) const {
    const int order = leaves_out(LeftOut::acquire_of_mailbox) ? 0 : 1;
    const auto word = static_cast<std::uint32_t>(ask({Operation::load, mailbox(place), order}));
    return leaves_out(LeftOut::waiting_for_mailbox) ? free_word() : word;
  }
  void store_mailbox(std::uint32_t place, std::uint32_t word) const {
    ask({Operation::store, mailbox(place), 0, word});
  }
  void release_mailbox(std::uint32_t place, std::uint32_t word) const {
    if (leaves_out(LeftOut::giving_back)) return;
    ask({Operation::store, mailbox(place), leaves_out(LeftOut::release_of_giving_back) ? 0 : 2, word});
  }
  void raise_mailbox(std::uint32_t place, std::uint32_t word) const {
    ask({leaves_out(LeftOut::maximum_of_home) ? Operation::store : Operation::raise, mailbox(place), 0,
         word});
  }

  void store_entry(std::uint32_t place, std::uint32_t lane, const std::uint64_t (&words)[kEntryWords]) const {
    for (int i = 0; i < kEntryWords; ++i) ask({Operation::store, entry(place, lane, i), 0, words[i]});
  }
  std::uint64_t exchange_entry_word(std::uint32_t place, std::uint32_t lane, int word) const {
    const bool loads = leaves_out(LeftOut::exchange), keeps = leaves_out(LeftOut::clearing);
    if (!loads && !keeps) return ask({Operation::exchange, entry(place, lane, word)});
    const std::uint64_t value = ask({Operation::load, entry(place, lane, word)});
    if (loads && value != 0) ask({Operation::store, entry(place, lane, word), 0, 0});
    return value;
  }

  void set_giving(bool giving) const { run_->giving = giving; }
  void set_ticket(std::uint32_t ticket) const { run_->ticket = ticket; }

 private:
  bool leaves_out(LeftOut step) const { return run_->scenario.left_out == step; }
  std::uint32_t mailboxes() const { return 1u << run_->scenario.mailbox_bits; }
  std::size_t mailbox(std::uint32_t place) const { return 1 + place % mailboxes(); }
  std::size_t entry(std::uint32_t place, std::uint32_t lane, int word) const {
    return 1 + mailboxes() + (place % mailboxes() * run_->scenario.lanes + lane) * kEntryWords +
           static_cast<std::size_t>(word);
  }
  /// Returns what a mailbox would hold if it were free for the ticket that is given.
  std::uint32_t free_word() const {
    return gpu::mailbox_word((run_->ticket >> mailbox_bits()) - 1, gpu::kGivenBack);
  }

  std::uint64_t ask(const Operation& operation) const {
    const bool repeats = run_->repeats && run_->last == operation;
    run_->repeats = false;
    if (run_->next == run_->answers.size()) throw Pending{operation, repeats};
    run_->last = operation;
    return run_->answers[run_->next++];
  }

  Run* run_;
};

/// A round of a warp, as Walk of walk.cuh has it: a unit and then a share of what is left for those who wait,
/// or what another warp gives.
template <class Warp>
void run_round(const Scenario& scenario, Local& local, const Warp& warp) {
  const gpu::WorkSharing<Warp> sharing(warp);
  if (!local.begun) {
    sharing.begin();
    local.begun = true;
    return;
  }
  if (local.units.empty()) {
    const std::uint32_t count =
        sharing.receive([&](std::uint32_t, const std::uint64_t(&words)[Warp::kEntryWords]) {
          for (const std::uint64_t word : words) {
            if (word != words[0]) throw Fault{"words of two gifts in one entry"};
          }
          local.units.push_back(static_cast<int>(words[0]) - 1);
        });
    local.home = count == 0;
    return;
  }
  warp.look();
  const int unit = local.units.back();
  local.units.pop_back();
  warp.work(unit);
  if (static_cast<std::size_t>(unit) < scenario.left_by.size()) {
    for (const int below : scenario.left_by[unit]) local.units.push_back(below);
  }
  const auto height = static_cast<std::uint32_t>(local.units.size());
  if (height < 2) return;
  const std::uint32_t gifts = sharing.gifts_wanted(std::min(scenario.most_gifts, height - 1));
  if (gifts == 0) return;
  const std::uint32_t first = sharing.announce(gifts), count = std::min(height / (gifts + 1), scenario.lanes);
  warp.set_giving(true);
  for (std::uint32_t i = 0; i < gifts; ++i) {
    warp.set_ticket(first + i);
    sharing.give(first + i, count, [&](std::uint32_t, std::uint64_t(&words)[Warp::kEntryWords]) {
      for (std::uint64_t& word : words) word = static_cast<std::uint64_t>(local.units.front()) + 1;
      local.units.erase(local.units.begin());
    });
  }
}

/// Knows the places where a warp's code may stand: a round, and the answers it has got in it. Code that was
/// run once is remembered.
template <int kWordsOfEntry>
class Program {
 public:
  struct Place {
    Local local;
    std::vector<std::uint64_t> answers;
    Operation next;
    std::map<std::uint64_t, int> after;  // by answer; kNowhere: as before
  };
  static constexpr int kNowhere = -1;

  explicit Program(const Scenario& scenario) : scenario_(scenario) {}

  int begin(const Local& local) {
    const auto [at, is_new] = rounds_.try_emplace(local, static_cast<int>(places_.size()));
    if (is_new) {
      places_.push_back({local, {}, {}, {}});
      if (!local.home) run(at->second);
    }
    return at->second;
  }
  const Place& operator[](int place) const { return places_[place]; }

  /// Returns where the warp gets to with that answer.
  int after(int place, std::uint64_t answer) {
    const auto found = places_[place].after.find(answer);
    if (found != places_[place].after.end()) return found->second;
    std::vector<std::uint64_t> answers = places_[place].answers;
    answers.push_back(answer);
    const int next = place_of(places_[place].local, std::move(answers));
    return places_[place].after[answer] = next;
  }

 private:
  using Warp = ModelWarp<kWordsOfEntry>;

  int place_of(const Local& start, std::vector<std::uint64_t> answers) {
    Local local = start;
    typename Warp::Run state = {scenario_, answers, local};
    try {
      run_round(scenario_, local, Warp(state));
    } catch (const typename Warp::Pending& pending) {
      if (pending.repeats_last) return kNowhere;
      if (answers.size() > 100) throw Fault{"a round without an end"};
      places_.push_back({start, answers, pending.operation, {}});
      return static_cast<int>(places_.size()) - 1;
    }
    return begin(local);
  }

  void run(int place) {
    Local local = places_[place].local;
    const std::vector<std::uint64_t> none;
    typename Warp::Run state = {scenario_, none, local};
    try {
      run_round(scenario_, local, Warp(state));
    } catch (const typename Warp::Pending& pending) {
      places_[place].next = pending.operation;
    }
  }

  const Scenario& scenario_;
  std::deque<Place> places_;
  std::map<Local, int> rounds_;
};

}  // namespace tandem::test
