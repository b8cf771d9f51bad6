#include "process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>

#include "exit_code.h"

namespace tandem {
namespace {

char g_file_is_gone[128] = "";

// A page of a mapped file cannot be read. What is called here may be called in a signal handler.
[[noreturn]] void tell_that_a_file_is_gone(int) {
  const ssize_t written = ::write(STDERR_FILENO, g_file_is_gone, std::strlen(g_file_is_gone));
  ::_exit(written < 0 ? kInternal : kUnreadableInput);
}

// A file opened while a standard descriptor is closed would take its number, and messages would be written
// into it.
void occupy_standard_descriptors() {
  int descriptor = 0;
  do {
    descriptor = ::open("/dev/null", O_RDWR);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor > STDERR_FILENO) ::close(descriptor);
}

}  // namespace

void prepare_process(const char* tool) {
  occupy_standard_descriptors();
  std::snprintf(g_file_is_gone, sizeof g_file_is_gone,
                "%s: a file was cut short, or its disk failed, while it was read\n", tool);
  std::signal(SIGBUS, tell_that_a_file_is_gone);
}

std::uint64_t peak_memory_bytes() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
#if defined(__APPLE__)
  constexpr std::uint64_t kUnit = 1;
#else
  constexpr std::uint64_t kUnit = 1024;
#endif
  return static_cast<std::uint64_t>(usage.ru_maxrss) * kUnit;
}

bool has_terminal() {
  return ::isatty(STDERR_FILENO) == 1;
}

}  // namespace tandem
