#include "tandem/runtime/upload.h"

#include <algorithm>
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
  if (this == &other) return *this;
  free();
  data_ = std::exchange(other.data_, nullptr);
  bytes_ = std::exchange(other.bytes_, 0);
  level_count_ = std::exchange(other.level_count_, 0);
  std::copy(other.levels_, other.levels_ + kMaxLevels, levels_);
  error_ = other.error_;
  return *this;
}

Status DeviceAsset::upload(const AssetView& asset, cudaStream_t stream) {
  free();
  const std::size_t bytes = asset.header->file_bytes;
  error_ = cudaMalloc(&data_, bytes);
  if (error_ != cudaSuccess) {
    data_ = nullptr;
    static_cast<void>(
        cudaGetLastError());  // an allocation that failed is not sticky; later calls must not report it again
    return status_of(error_);
  }
  error_ = cudaMemcpyAsync(data_, asset.header, bytes, cudaMemcpyHostToDevice, stream);
  if (error_ != cudaSuccess) {
    const cudaError_t error = error_;
    free();
    error_ = error;
    return status_of(error);
  }
  bytes_ = bytes;
  level_count_ = static_cast<std::uint32_t>(asset.levels.size());
  for (std::uint32_t i = 0; i < level_count_; ++i) {
    levels_[i] = asset.level(i);
    levels_[i].blocks = relocate(levels_[i].blocks, asset.header, data_);
    levels_[i].triangles = relocate(levels_[i].triangles, asset.header, data_);
  }
  return Status::kOk;
}

void DeviceAsset::free() {
  if (data_ != nullptr) static_cast<void>(cudaFree(data_));
  data_ = nullptr;
  bytes_ = 0;
  level_count_ = 0;
  error_ = cudaSuccess;
}

}  // namespace tandem
