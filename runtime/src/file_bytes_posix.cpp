#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <limits>

#include "file_bytes.h"
#include "tandem/formats/allocator.h"

namespace tandem {
namespace {

Status status_of_open_error() {
  if (errno == ENOENT || errno == ENOTDIR) return Status::kFileNotFound;
  return errno == EISDIR ? Status::kNotARegularFile : Status::kCannotOpen;
}

// The size of an open file, -1 if it has none (a pipe, a folder).
long size_of(std::FILE* file) {
  if (std::fseek(file, 0, SEEK_END) != 0) return -1;
  const long size = std::ftell(file);
  return std::fseek(file, 0, SEEK_SET) == 0 && size < std::numeric_limits<long>::max() ? size : -1;
}

FileBytes read_all(std::FILE* file) {
  const long size = size_of(file);
  if (size < 0) return {Status::kNotARegularFile};
  const auto bytes = static_cast<std::size_t>(size);
  void* data = allocate(bytes + 1);  // + 1: an empty file has an address too
  if (data == nullptr) return {Status::kOutOfMemory};
  if (std::fread(data, 1, bytes, file) == bytes) return {Status::kOk, data, bytes};
  deallocate(data);
  return {Status::kCannotRead};
}

// Opens without blocking, because a pipe must be refused, not waited for.
int open_descriptor(const char* path) {
  return ::open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
}

std::FILE* open_stream(const char* path) {
  const int file = open_descriptor(path);
  std::FILE* stream = file >= 0 ? ::fdopen(file, "rb") : nullptr;
  if (file >= 0 && stream == nullptr) ::close(file);
  return stream;
}

}  // namespace

FileBytes read_file(const char* path) {
  std::FILE* file = open_stream(path);
  if (file == nullptr) return {status_of_open_error()};
  const FileBytes bytes = read_all(file);
  std::fclose(file);
  return bytes;
}

FileBytes map_file(const char* path) {
  const int file = open_descriptor(path);
  if (file < 0) return {status_of_open_error()};
  struct stat info {};
  FileBytes bytes;
  if (::fstat(file, &info) != 0 || !S_ISREG(info.st_mode)) {
    bytes.status = Status::kNotARegularFile;
  } else {
    bytes.size = static_cast<std::size_t>(info.st_size);
    bytes.data = ::mmap(nullptr, bytes.size, PROT_READ, MAP_PRIVATE, file, 0);
    if (bytes.data == MAP_FAILED) bytes = {Status::kCannotRead};
  }
  ::close(file);
  return bytes;
}

void unmap(void* data, std::size_t size) {
  ::munmap(data, size);
}

void give_back_pages(void* data, std::size_t size) {
  (void)::madvise(data, size, MADV_DONTNEED);
}

}  // namespace tandem
