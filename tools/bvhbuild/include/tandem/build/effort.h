#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>

namespace tandem::build {

/// How much time goes into making a tree cheap to query.
enum class Effort : std::uint8_t {
  fast,      ///< greedy splits only
  standard,  ///< then one pass of exchanges: at most twice as long again
  best,      ///< then simulated annealing: minutes for 10^5 triangles
};

/// Lets somebody look on while a tree is optimised, and end it.
class OptimisationWatch {
 public:
  /// Called now and then, by one thread at a time, with the share that is done. What it throws ends the
  /// build.
  std::function<void(double share)> progress = [](double) {};
  /// Once set, optimisation ends within a second or so, with the best tree so far.
  std::atomic<bool> stop = false;

  /// For the optimiser: how many units of work there are, and that some more are done.
  void expect(std::uint64_t units) { expected_ = units; }
  void count(std::uint64_t units);
  /// For the builder: between two of its steps.
  void look() { count(0); }

 private:
  std::uint64_t expected_ = 1;
  std::mutex mutex_;
  std::uint64_t done_ = 0;
};

}  // namespace tandem::build
