#pragma once
#include <cfenv>
#include <ctime>

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

/// That the calling thread has computed.
inline double thread_seconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Of a call of a library: seconds that this thread computed, so that other work on the machine counts
/// little.
template <class Work>
double seconds_of(const Work& work) {
  const SavedFloatingPoint saved;
  const double start = thread_seconds();
  work();
  return thread_seconds() - start;
}

}  // namespace tandem::bench
