#include "tandem/runtime/upload.h"

#include <utility>

#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

// The same place of the same file, in the device's copy.
template <typename Element>
const Element* relocate(const Element* element, const void* host, const void* device) {
  const auto offset = reinterpret_cast<const char*>(element) - static_cast<const char*>(host);
  return reinterpret_cast<const Element*>(static_cast<const char*>(device) + offset);
}

}  // namespace

DeviceAsset& DeviceAsset::operator=(DeviceAsset&& other) noexcept {
  data_ = std::move(other.data_);
  std::swap(level_count_, other.level_count_);
  std::swap(levels_, other.levels_);
  std::swap(error_, other.error_);
  return *this;
}

Status DeviceAsset::upload(const AssetView& asset, cudaStream_t stream) {
  free();
  const void* const file = asset.header;
  error_ = data_.upload({static_cast<const unsigned char*>(file), asset.header->file_bytes}, stream);
  if (error_ != cudaSuccess) {
    data_.free();
    return status_of(error_);
  }
  level_count_ = static_cast<std::uint32_t>(asset.levels.size());
  for (std::uint32_t i = 0; i < level_count_; ++i) {
    levels_[i] = asset.level(i);
    levels_[i].blocks = relocate(levels_[i].blocks, file, data_.data());
    levels_[i].triangles = relocate(levels_[i].triangles, file, data_.data());
  }
  return Status::kOk;
}

void DeviceAsset::free() {
  data_.free();
  level_count_ = 0;
  error_ = cudaSuccess;
}

}  // namespace tandem
