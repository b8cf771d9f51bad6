#include "limited_child.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>

namespace tandem {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLimitsMemory = false;
#elif defined(__has_feature)
constexpr bool kLimitsMemory = !__has_feature(address_sanitizer) && !__has_feature(thread_sanitizer);
#else
constexpr bool kLimitsMemory = true;
#endif

constexpr int kExitOutOfMemory = 3;
constexpr int kExitException = 4;

void limit(int resource, rlim_t value) {
  // The hard limit of whoever started us may be lower still; it stays.
  rlimit now{};
  getrlimit(static_cast<__rlimit_resource_t>(resource), &now);
  now.rlim_max = std::min(now.rlim_max, value);
  now.rlim_cur = std::min(now.rlim_max, value);
  setrlimit(static_cast<__rlimit_resource_t>(resource), &now);
}

/// Bytes of address space that this process has taken; 0 when the system does not say.
std::uint64_t address_space_taken() {
  char text[32] = {};
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  const ssize_t got = read(file, text, sizeof text - 1);
  close(file);
  if (got <= 0) return 0;
  return std::strtoull(text, nullptr, 10) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void limit_resources(const ChildLimits& limits) {
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);  // of files; a pipe has no size
  // This is only a second line of defence behind the parent's clock, for a parent that is stopped.
  limit(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(std::clamp(limits.seconds, 0.0, 1e9))) + 1);
  constexpr std::uint64_t kLeast = 1 << 20;  // less leaves no room for the stack to say so
  constexpr std::uint64_t kMost = INT64_MAX / 2;
  if (kLimitsMemory) limit(RLIMIT_AS, address_space_taken() + std::clamp(limits.memory_bytes, kLeast, kMost));
}

/// Signals back to their defaults: Ctrl-C ends the child too, and a crash is a crash, whatever handlers were
/// inherited.
void reset_signals() {
  for (int signal = 1; signal < NSIG; ++signal) std::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
}

void silence() {
  const int null = open("/dev/null", O_RDWR);
  if (null < 0) return;
  for (int stream = 0; stream < 3; ++stream) dup2(null, stream);
}

void write_all(int pipe, const void* bytes, std::size_t count) {
  const char* from = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t n = write(pipe, from, count);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) _exit(kExitException);
    from += n;
    count -= static_cast<std::size_t>(n);
  }
}

/// Ends with _exit: destructors and buffers belong to the parent, and freeing what a broken heap holds could
/// crash.
[[noreturn]] void run_child(int pipe, pid_t parent, const ChildLimits& limits,
                            const std::function<void(const LimitedChild::Sink&)>& work) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kExitException);  // the parent died before the request
  reset_signals();
  silence();
  limit_resources(limits);
  std::set_new_handler([] { _exit(kExitOutOfMemory); });
  try {
    work([pipe](const void* bytes, std::size_t count) { write_all(pipe, bytes, count); });
  } catch (const std::bad_alloc&) {
    _exit(kExitOutOfMemory);
  } catch (...) {
    _exit(kExitException);
  }
  _exit(0);
}

}  // namespace

bool limits_memory() {
  return kLimitsMemory;
}

LimitedChild::~LimitedChild() {
  if (pipe_ >= 0) close(pipe_);
  if (pid_ <= 0) return;
  kill(pid_, SIGKILL);
  int status = 0;
  reap(true, status);
}

std::string LimitedChild::start(const ChildLimits& limits, const std::function<void(const Sink&)>& work) {
  const double seconds = std::clamp(limits.seconds, 0.0, 1e9);
  deadline_ =
      std::chrono::steady_clock::now() +
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(seconds));
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return std::string("no pipe to a reader process: ") + std::strerror(errno);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    close(ends[0]);
    run_child(ends[1], parent, limits, work);
  }
  close(ends[1]);
  pipe_ = ends[0];
  if (pid_ < 0) return std::string("no reader process: ") + std::strerror(errno);
  return {};
}

int LimitedChild::milliseconds_left() const {
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(deadline_ - std::chrono::steady_clock::now()).count();
  return static_cast<int>(std::clamp<long long>(left, 0, 1'000'000));
}

bool LimitedChild::wait_readable() {
  while (const int left = milliseconds_left()) {
    pollfd request{pipe_, POLLIN, 0};
    const int ready = poll(&request, 1, left);
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
  return false;
}

bool LimitedChild::read(void* to, std::size_t count) {
  char* bytes = static_cast<char*>(to);
  while (count > 0) {
    if (!wait_readable()) return false;
    const ssize_t n = ::read(pipe_, bytes, count);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes += n;
    count -= static_cast<std::size_t>(n);
  }
  return true;
}

bool LimitedChild::reap(bool block, int& status) {
  pid_t reaped = 0;
  do {
    reaped = waitpid(pid_, &status, block ? 0 : WNOHANG);
  } while (reaped < 0 && errno == EINTR);
  if (reaped == 0) return false;
  if (reaped < 0) status = kExitException << 8;  // somebody else reaps our children
  pid_ = -1;
  return true;
}

ChildEnd LimitedChild::finish() {
  // A child that still writes must not wait for a reader that has given up.
  close(pipe_);
  pipe_ = -1;
  int status = 0;
  // The pipe closes a moment before the process can be reaped, so this rarely waits at all.
  while (!reap(false, status)) {
    if (milliseconds_left() == 0) return ChildEnd::out_of_time;
    poll(nullptr, 0, std::min(milliseconds_left(), 1));
  }
  if (WIFSIGNALED(status)) {
    signal_ = WTERMSIG(status);
    if (signal_ == SIGPIPE) return ChildEnd::lost;
    return signal_ == SIGXCPU ? ChildEnd::out_of_time : ChildEnd::crashed;
  }
  if (WEXITSTATUS(status) == kExitOutOfMemory) return ChildEnd::out_of_memory;
  return WEXITSTATUS(status) == 0 ? ChildEnd::finished : ChildEnd::lost;
}

}  // namespace tandem
