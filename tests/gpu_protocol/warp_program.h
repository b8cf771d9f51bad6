#pragma once
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "model_warp.h"

namespace tandem::test {

/// Where a warp's code stands: a round, and the answers it has got in it. Code that was run once is
/// remembered.
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

  /// Where the warp comes with that answer.
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
