#pragma once
#include <algorithm>
#include <chrono>
#include <vector>

namespace tandem {

/// Measures wall-clock time.
class Stopwatch {
 public:
  /// Seconds since the last call, or since it was made.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Seconds of a step, one for each repeat.
using Seconds = std::vector<double>;

/// Condition: at least one.
inline double best_of(const Seconds& seconds) {
  return *std::min_element(seconds.begin(), seconds.end());
}

/// Condition: at least one.
inline double median_of(Seconds seconds) {
  std::sort(seconds.begin(), seconds.end());
  return (seconds[(seconds.size() - 1) / 2] + seconds[seconds.size() / 2]) / 2;
}

}  // namespace tandem
