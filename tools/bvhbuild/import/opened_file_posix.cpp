#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "opened_file.h"

namespace tandem::build {
namespace {

std::error_code last_error() {
  return {errno, std::system_category()};
}

int descriptor(const OpenedFile& file) {
  return static_cast<int>(file.handle);
}

FileKind kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return FileKind::folder;
  return S_ISREG(mode) ? FileKind::regular : FileKind::other;
}

}  // namespace

std::error_code open_to_read(const std::filesystem::path& path, OpenedFile& file) {
  // Without O_NONBLOCK, opening a named pipe would wait for a writer.
  file.handle = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  struct stat status {};
  if (file.handle < 0 || ::fstat(descriptor(file), &status) != 0) return last_error();
  file.kind = kind_of(status.st_mode);
  file.size = static_cast<std::uint64_t>(status.st_size);
  file.identity = {status.st_dev, status.st_ino};
  return {};
}

std::size_t read_at(const OpenedFile& file, char* to, std::size_t count, std::uint64_t offset,
                    std::error_code& error) {
  std::size_t got = 0;
  while (got < count) {
    constexpr std::size_t kMostAtOnce = std::size_t{1} << 30;
    const ssize_t n = ::pread(descriptor(file), to + got, std::min(count - got, kMostAtOnce),
                              static_cast<off_t>(offset + got));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) error = last_error();
    if (n <= 0) break;
    got += static_cast<std::size_t>(n);
  }
  return got;
}

void close_file(const OpenedFile& file) {
  if (file.handle != OpenedFile::kNone) ::close(descriptor(file));
}

}  // namespace tandem::build
