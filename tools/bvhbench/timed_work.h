#pragma once
#include <cfenv>
#include <ctime>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bvhbench/engines/engine.h"

namespace tandem::bench {

/// Libraries change rounding and denormal modes; what follows them must not notice.
class SavedFloatingPoint {
 public:
  SavedFloatingPoint() { std::fegetenv(&saved_); }
  SavedFloatingPoint(const SavedFloatingPoint&) = delete;
  SavedFloatingPoint& operator=(const SavedFloatingPoint&) = delete;
  ~SavedFloatingPoint() { std::fesetenv(&saved_); }

 private:
  std::fenv_t saved_;
};

/// Returns the seconds that the calling thread has computed.
inline double thread_seconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Returns the seconds that this thread computed in a call of a library, so that other work on the machine
/// counts little.
template <class Work>
double seconds_of(const Work& work) {
  const SavedFloatingPoint saved;
  const double start = thread_seconds();
  work();
  return thread_seconds() - start;
}

/// The times that every comparison tells of a peer.
struct PeerTimes {
  std::string name, settings;
  double build_seconds = 0;   ///< once
  double update_seconds = 0;  ///< each frame
  Seconds query_seconds;      ///< each repeat; a single one for peers that run once
};

using Peers = std::span<const std::unique_ptr<Engine>>;

/// Gives the peers shapes and bodies. Result: for each its name and settings, and what that took.
template <class Result>
std::vector<Result> prepared(Peers peers, std::span<const AssetView> shapes,
                             std::span<const Instance> bodies) {
  std::vector<Result> results;
  for (const std::unique_ptr<Engine>& peer : peers) {
    Result& result = results.emplace_back();
    result.name = peer->label();
    result.settings = peer->settings();
    result.build_seconds = seconds_of([&] { peer->set_shapes(shapes); });
    result.update_seconds = seconds_of([&] { peer->update(bodies); });
  }
  return results;
}

/// Asks the peers in turn, so that a drifting machine drifts for all: calls ask(peer) `repeats` times, once
/// for one that runs once and has no time yet, and adds what it took to the peer's result. Calls judge(peer,
/// result) when the result has its first time.
template <class Result, class Ask, class Judge>
void race(Peers peers, unsigned repeats, std::vector<Result>& results, const Ask& ask, const Judge& judge) {
  for (unsigned repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t i = 0; i < peers.size(); ++i) {
      Seconds& seconds = results[i].query_seconds;
      if (peers[i]->runs_once() && !seconds.empty()) continue;
      seconds.push_back(seconds_of([&] { ask(*peers[i]); }));
      if (seconds.size() == 1) judge(*peers[i], results[i]);
    }
  }
}

}  // namespace tandem::bench
