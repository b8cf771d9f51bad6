#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>

#include "file_writing.h"

namespace tandem {
namespace {

namespace fs = std::filesystem;

std::string reason_of(int error) {
  return std::system_category().message(error);
}

// The temporary file that a signal must remove; empty when there is none. Plain memory, because a signal
// handler reads it.
std::array<char, 4096> g_temporary{};

void remove_temporary_and_die(int signal) {
  if (g_temporary[0] != '\0') ::unlink(g_temporary.data());
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

// While it lives, a deadly signal removes the temporary file first; the signal of a file that outgrows its
// limit is ignored, so that write() fails instead.
class SignalGuard {
 public:
  explicit SignalGuard(const std::string& temporary) {
    std::strncpy(g_temporary.data(), temporary.c_str(), g_temporary.size() - 1);
    struct sigaction action {};
    action.sa_handler = remove_temporary_and_die;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      if (kSignals[i] == SIGXFSZ) action.sa_handler = SIG_IGN;
      ::sigaction(kSignals[i], nullptr, &previous_[i]);
      if (previous_[i].sa_handler != SIG_IGN) ::sigaction(kSignals[i], &action, nullptr);
    }
  }
  ~SignalGuard() {
    for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &previous_[i], nullptr);
    g_temporary[0] = '\0';
  }
  SignalGuard(const SignalGuard&) = delete;
  SignalGuard& operator=(const SignalGuard&) = delete;

 private:
  static constexpr std::array<int, 6> kSignals = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU, SIGXFSZ};
  std::array<struct sigaction, kSignals.size()> previous_{};
};

// Writes everything; 0 or an error number. macOS refuses to write 2 GiB at once.
int write_all(int file, std::span<const std::byte> bytes) {
  constexpr std::size_t kMostAtOnce = std::size_t{1} << 30;
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), std::min(bytes.size(), kMostAtOnce));
    if (written < 0 && errno != EINTR) return errno;
    if (written > 0) bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return 0;
}

// Brings what was written to the disk; 0 or an error number. On macOS fsync() stops at the disk's own memory.
int flush_to_disk(int file) {
#if defined(F_FULLFSYNC)
  if (::fcntl(file, F_FULLFSYNC) == 0) return 0;  // else a file system that has only fsync()
#endif
  return ::fsync(file) == 0 ? 0 : errno;
}

// A file beside the target that no other process writes to. File systems take names of 255 bytes.
std::string temporary_beside(const fs::path& target) {
  constexpr std::size_t kLongestStem = 230;
  const std::string stem = target.filename().string().substr(0, kLongestStem);
  return (target.parent_path() / (stem + ".tmp" + std::to_string(::getpid()))).string();
}

// A file that is replaced keeps its permissions.
int copy_permissions(const fs::path& from, int to) {
  struct stat info {};
  return ::stat(from.c_str(), &info) != 0 || ::fchmod(to, info.st_mode & 07777) == 0 ? 0 : errno;
}

}  // namespace

std::string write_in_place(const fs::path& path, std::span<const std::byte> bytes) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) return reason_of(errno);
  int error = write_all(file, bytes);
  if (::close(file) != 0 && error == 0) error = errno;
  return error == 0 ? std::string() : reason_of(error);
}

std::string why_not_writable(const fs::path& path) {
  return ::access(path.c_str(), W_OK) == 0 ? std::string() : reason_of(errno);
}

std::string write_and_rename(const fs::path& target, std::span<const std::byte> bytes, bool replace) {
  const std::string temporary = temporary_beside(target);
  if (temporary.size() >= g_temporary.size()) return reason_of(ENAMETOOLONG);
  ::unlink(temporary.c_str());  // left behind by a killed process that had our number
  const SignalGuard guard(temporary);
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) return reason_of(errno);
  int error = copy_permissions(target, file);
  if (error == 0) error = write_all(file, bytes);
  if (error == 0 && replace) error = flush_to_disk(file);
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 && replace && ::rename(temporary.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0 || !replace) ::unlink(temporary.c_str());
  return error == 0 ? std::string() : reason_of(error);
}

}  // namespace tandem
