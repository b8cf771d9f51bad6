#include "input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>

namespace tandem::build {
namespace {

std::string reason(int error) {
  switch (error) {
    case ENOENT:
      return "no such file";
    case ENOTDIR:
      return "no such file (a part of its path is not a folder)";
    case EACCES:
      return "permission denied";
    case EISDIR:
      return "is a folder";
    default:
      return std::strerror(error);
  }
}

/// Reads until `count` bytes or the end; the number of bytes, or -1 with errno set.
ssize_t read_fully(int descriptor, char* to, std::size_t count, off_t offset) {
  std::size_t got = 0;
  while (got < count) {
    constexpr std::size_t kMostAtOnce = std::size_t{1} << 30;
    const ssize_t n =
        pread(descriptor, to + got, std::min(count - got, kMostAtOnce), offset + static_cast<off_t>(got));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return -1;
    if (n == 0) break;
    got += static_cast<std::size_t>(n);
  }
  return static_cast<ssize_t>(got);
}

}  // namespace

std::string why_not_beside(const std::filesystem::path& folder, const std::filesystem::path& path) {
  std::error_code error;
  const auto top = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, error);
  if (error) return reason(error.value());
  const auto place = std::filesystem::weakly_canonical(path, error);
  if (error) return reason(error.value());
  if (std::mismatch(top.begin(), top.end(), place.begin(), place.end()).first == top.end()) return {};
  return "lies outside the folder of the file that names it (--allow-outside-files)";
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

std::string InputFile::open(const std::filesystem::path& path) {
  // Without O_NONBLOCK, opening a named pipe would wait for a writer.
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor_ < 0) return reason(errno);
  struct stat status {};
  if (fstat(descriptor_, &status) != 0) return reason(errno);
  if (S_ISDIR(status.st_mode)) return "is a folder";
  if (!S_ISREG(status.st_mode)) return "is not a regular file";
  if (status.st_size == 0) return "the file is empty";
  size_ = static_cast<std::uint64_t>(status.st_size);
  identity_ = {status.st_dev, status.st_ino};
  return {};
}

std::string InputFile::head() const {
  std::string bytes(64, '\0');
  const ssize_t got = read_fully(descriptor_, bytes.data(), bytes.size(), 0);
  bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return bytes;
}

std::string InputFile::read_all() {
  bytes_.reset(new (std::nothrow) char[size_]);
  if (!bytes_) return "not enough memory to read it";
  const ssize_t got = read_fully(descriptor_, bytes_.get(), size_, 0);
  if (got < 0) return reason(errno);
  bytes_read_ = static_cast<std::size_t>(got);
  return {};
}

}  // namespace tandem::build
