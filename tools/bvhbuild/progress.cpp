#include "progress.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

namespace tandem::build {

Progress::Progress(bool wanted, std::string what)
    : shown_(wanted && ::isatty(STDERR_FILENO) == 1), what_(std::move(what)) {}

void Progress::step(const char* name) {
  ++step_;
  if (!shown_) return;
  std::fprintf(stderr, "\r\x1b[K[%d/4] %s %s ...", step_, name, what_.c_str());
  std::fflush(stderr);
}

void Progress::clear() {
  if (shown_ && step_ > 0) std::fputs("\r\x1b[K", stderr);
}

}  // namespace tandem::build
