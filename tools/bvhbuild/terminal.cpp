#include "terminal.h"

#include <csignal>
#include <cstdio>
#include <utility>

#include "common/process.h"

namespace tandem::build {

Progress::Progress(bool wanted, std::string what)
    : shown_(wanted && has_terminal()), what_(std::move(what)) {}

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
  if (flag == nullptr) return;
  flag_to_set = flag;
  before_ = std::signal(SIGINT, [](int) {
    std::signal(SIGINT, SIG_DFL);
    flag_to_set->store(true);
  });
  if (before_ == SIG_IGN) std::signal(SIGINT, SIG_IGN);  // as for a job in the background of a shell
  installed_ = before_ != SIG_ERR;
}

StopOnInterrupt::~StopOnInterrupt() {
  if (installed_) std::signal(SIGINT, before_);
}

}  // namespace tandem::build
