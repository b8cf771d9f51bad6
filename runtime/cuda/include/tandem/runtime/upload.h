#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "tandem/formats/check.h"
#include "tandem/formats/gpu_memory.h"

namespace tandem {

/// What of an asset goes into GPU memory.
enum class Contents : std::uint8_t {
  all,            ///< the file as it is
  exact_queries,  ///< triangles and oriented blocks: what queries of mode exact take, a third less
};

/// Owns a copy of an asset in GPU memory: one allocation, one copy of the file's bytes as they are. Movable,
/// not copyable. Throws nothing.
class DeviceAsset {
 public:
  DeviceAsset() = default;
  DeviceAsset(DeviceAsset&& other) noexcept { *this = static_cast<DeviceAsset&&>(other); }
  DeviceAsset& operator=(DeviceAsset&& other) noexcept;
  ~DeviceAsset() = default;

  /// Allocates on the current device and queues the copy on `stream`; what was uploaded before is freed. Of
  /// Contents::exact_queries the copy reaches from the first section that is wanted to the last; files by
  /// bvhbuild have nothing else between them.
  /// Result: kOk, kOutOfGpuMemory, or another that status_of() of gpu_status.h names: kNoGpu, kDriverTooOld,
  /// kGpuNotSupported, kCudaFailed; then nothing is held, and cuda_error() tells more.
  /// Condition: the bytes of `asset`, a checked one, stay until the copy is done. They may be pageable (a
  /// mapped file); CUDA then stages them and returns when it has read them.
  Status upload(const AssetView& asset, cudaStream_t stream, Contents contents = Contents::all);

  void free();

  /// Level `i` with pointers into GPU memory; null of what the file lacks or `contents` left out. Condition:
  /// upload() returned kOk, i < level_count().
  LevelView level(std::uint32_t i = 0) const { return levels_[i]; }
  std::uint32_t level_count() const { return level_count_; }
  std::size_t bytes() const { return data_.bytes(); }
  cudaError_t cuda_error() const { return error_; }

 private:
  GpuArray<unsigned char> data_;
  std::uint32_t level_count_ = 0;
  LevelView levels_[kMaxLevels];
  cudaError_t error_ = cudaSuccess;
};

}  // namespace tandem
