#include "tandem/runtime/map.h"

#include <utility>

#include "file_bytes.h"
#include "tandem/formats/allocator.h"

namespace tandem {

static_assert(kMemoryAlignment % alignof(Block) == 0);

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
  FileBytes bytes;
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
