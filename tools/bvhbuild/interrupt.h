#pragma once
#include <signal.h>

#include <atomic>

namespace tandem::build {

/// While it lives, the first SIGINT (Ctrl-C) sets a flag instead of ending the process; the next one ends it.
/// Without a flag it does nothing. One at a time.
class StopOnInterrupt {
 public:
  explicit StopOnInterrupt(std::atomic<bool>* flag);
  ~StopOnInterrupt();
  StopOnInterrupt(const StopOnInterrupt&) = delete;
  StopOnInterrupt& operator=(const StopOnInterrupt&) = delete;

 private:
  struct sigaction before_ {};
  bool installed_ = false;
};

}  // namespace tandem::build
