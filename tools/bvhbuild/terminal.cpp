#include "terminal.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

namespace tandem::build {

Progress::Progress(bool wanted, std::string what)
    : shown_(wanted && ::isatty(STDERR_FILENO) == 1), what_(std::move(what)) {}

void Progress::step(const char* name) {
  ++step_;
  name_ = name;
  percent_ = 0;
  if (!shown_) return;
  std::fprintf(stderr, "\r\x1b[K[%d/4] %s %s ...", step_, name, what_.c_str());
  std::fflush(stderr);
}

void Progress::share(double done) {
  const int percent = static_cast<int>(100 * done);
  if (!shown_ || percent == percent_) return;
  percent_ = percent;
  std::fprintf(stderr, "\r\x1b[K[%d/4] %s %s ... %d %%", step_, name_, what_.c_str(), percent);
  std::fflush(stderr);
}

void Progress::clear() {
  if (shown_ && step_ > 0) std::fputs("\r\x1b[K", stderr);
}

namespace {

std::atomic<bool>* flag_to_set = nullptr;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may touch nothing else");

}  // namespace

StopOnInterrupt::StopOnInterrupt(std::atomic<bool>* flag) {
  if (flag == nullptr || ::sigaction(SIGINT, nullptr, &before_) != 0) return;
  if (before_.sa_handler == SIG_IGN) return;  // as for a job in the background of a shell
  flag_to_set = flag;
  struct sigaction stop {};
  stop.sa_handler = [](int) { flag_to_set->store(true); };
  stop.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  installed_ = ::sigaction(SIGINT, &stop, nullptr) == 0;
}

StopOnInterrupt::~StopOnInterrupt() {
  if (installed_) ::sigaction(SIGINT, &before_, nullptr);
}

}  // namespace tandem::build
