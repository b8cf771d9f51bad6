#pragma once
#include <cfenv>

#include "common/stopwatch.h"

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

/// Of a call of a library.
template <class Work>
double seconds_of(const Work& work) {
  const SavedFloatingPoint saved;
  Stopwatch watch;
  work();
  return watch.lap();
}

}  // namespace tandem::bench
