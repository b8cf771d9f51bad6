#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/formats/check.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/runtime/contents.h"

namespace tandem {

/// Owns copies of assets in GPU memory: one allocation for all, bytes of files as they are, from multiples of
/// 256 bytes on. Movable, not copyable. Throws nothing. Objects share nothing, so several
/// threads may upload, each with its own.
class DeviceAssets {
 public:
  DeviceAssets() = default;
  DeviceAssets(DeviceAssets&& other) noexcept { *this = static_cast<DeviceAssets&&>(other); }
  DeviceAssets& operator=(DeviceAssets&& other) noexcept;
  ~DeviceAssets() = default;

  /// Allocates on the current device, copies on `stream`, and returns when all is there and `stream` is done
  /// with what it held; what was uploaded before is freed. From 128 MiB on it copies by up to eight threads
  /// of its own, which pin 4 MiB of CPU memory each meanwhile. It copies those sections of a file that are
  /// wanted of the levels that its view shows (AssetView::levels_from()); Contents::all of all levels is the
  /// whole file. Result: kOk, kOutOfGpuMemory, kOutOfMemory, or another that status_of() of gpu_status.h
  /// names: kNoGpu, kDriverTooOld, kGpuNotSupported, kCudaFailed; then nothing is held, and cuda_error()
  /// tells more. Condition: the assets are checked ones. Their bytes may be pageable (mapped files), and need
  /// not stay.
  Status upload(std::span<const AssetView> assets, Contents contents, cudaStream_t stream);

  void free();

  /// Level `i` of an asset's view, by its place in the list, with pointers into GPU memory; null of what the
  /// file lacks or `contents` left out. Condition: asset < count(), i < levels of the view.
  LevelView level(std::size_t asset, std::uint32_t i = 0) const { return levels_[first_level_[asset] + i]; }
  std::size_t count() const { return count_; }  ///< assets; 0 after an error
  std::size_t bytes() const { return data_.bytes(); }
  cudaError_t cuda_error() const { return error_; }

 private:
  GpuArray<unsigned char> data_;
  std::size_t count_ = 0;
  std::unique_ptr<std::size_t[]> first_level_;  // of each asset
  std::unique_ptr<LevelView[]> levels_;         // of all assets, one asset's after the other's
  cudaError_t error_ = cudaSuccess;
};

}  // namespace tandem
