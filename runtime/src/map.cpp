#include "tandem/runtime/map.h"

#include <cerrno>
#include <cstdio>
#include <limits>
#include <utility>

#include "tandem/formats/allocator.h"

#if __has_include(<sys/mman.h>)
#define TANDEM_HAS_MMAP 1
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#else
#define TANDEM_HAS_MMAP 0
#endif

namespace tandem {
namespace {

struct Bytes {
  Status status = Status::kOk;
  void* data = nullptr;
  std::size_t size = 0;
};

static_assert(kMemoryAlignment % alignof(Block) == 0);

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

Bytes read_all(std::FILE* file) {
  const long size = size_of(file);
  if (size < 0) return {Status::kNotARegularFile};
  const auto bytes = static_cast<std::size_t>(size);
  void* data = allocate(bytes + 1);  // + 1: an empty file has an address too
  if (data == nullptr) return {Status::kOutOfMemory};
  if (std::fread(data, 1, bytes, file) == bytes) return {Status::kOk, data, bytes};
  deallocate(data);
  return {Status::kCannotRead};
}

#if TANDEM_HAS_MMAP
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
#else
std::FILE* open_stream(const char* path) {
  return std::fopen(path, "rb");
}
#endif

Bytes read_file(const char* path) {
  std::FILE* file = open_stream(path);
  if (file == nullptr) return {status_of_open_error()};
  const Bytes bytes = read_all(file);
  std::fclose(file);
  return bytes;
}

#if TANDEM_HAS_MMAP
Bytes map_file(const char* path) {
  const int file = open_descriptor(path);
  if (file < 0) return {status_of_open_error()};
  struct stat info {};
  Bytes bytes;
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

// If the system takes this advice, pages come back from the file's cache as they are touched.
void give_back_pages(void* data, std::size_t size) {
  (void)::madvise(data, size, MADV_DONTNEED);
}
#else
Bytes map_file(const char*) {
  return {Status::kCannotRead};
}
void unmap(void*, std::size_t) {}
void give_back_pages(void*, std::size_t) {}
#endif

}  // namespace

MappedAsset& MappedAsset::operator=(MappedAsset&& other) noexcept {
  if (this == &other) return *this;
  close();
  data_ = std::exchange(other.data_, nullptr);
  bytes_ = std::exchange(other.bytes_, 0);
  mapped_ = std::exchange(other.mapped_, false);
  where_ = std::exchange(other.where_, 0);
  asset_ = std::exchange(other.asset_, {});
  return *this;
}

Status MappedAsset::acquire(const char* path, Access access) {
  Bytes bytes;
  if (access == Access::map) {
    bytes = map_file(path);
    mapped_ = bytes.status == Status::kOk;
  }
  const bool try_reading = access == Access::read || bytes.status == Status::kCannotRead;
  if (try_reading) bytes = read_file(path);
  data_ = bytes.data;
  bytes_ = bytes.size;
  return bytes.status;
}

Status MappedAsset::open(const char* path, Access access, CheckDepth depth) {
  close();
  if (const Status status = acquire(path, access); status != Status::kOk) return status;
  const CheckResult result = check(data_, bytes_, depth);
  if (result.status != Status::kOk) close();
  if (mapped_ && result.asset.levels.size() > 1) give_back_pages(data_, bytes_);
  asset_ = result.asset;
  where_ = result.where;
  return result.status;
}

void MappedAsset::close() {
  if (mapped_) {
    unmap(data_, bytes_);
  } else {
    deallocate(data_);
  }
  data_ = nullptr;
  bytes_ = 0;
  mapped_ = false;
  where_ = 0;
  asset_ = {};
}

}  // namespace tandem
