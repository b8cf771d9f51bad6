#include "interrupt.h"

namespace tandem::build {
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
