#pragma once
#include <cuda_runtime_api.h>

#include <atomic>
#include <new>

#include "entry.h"
#include "status.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/gpu_excluded_pairs.h"
#include "tandem/kernels/gpu_scene.h"
#include "tandem/runtime/upload.h"
#include "tandem/tandem_cuda.h"

struct tandem_gpu_assets : tandem::Allocated {
  std::atomic<size_t> references = 1;
  tandem::DeviceAssets files;
  tandem::Buffer<tandem::GpuAsset> assets;  ///< the first level that each shows
  tandem::Buffer<tandem::GpuAsset> levels;  ///< all that they show, asset by asset
  tandem::GpuArray<tandem::AssetBounds> bounds;
  tandem::Allocator allocator;

  tandem::GpuAssetBounds bounds_of_all() const { return {bounds.data(), uint32_t(assets.size())}; }
};

struct tandem_gpu_excluded_pairs : tandem::Allocated {
  tandem::GpuExcludedPairs table;
  tandem::Allocator allocator;
};

namespace tandem::c {

/// The interface's number of what a call returned; keeps the error of CUDA's behind it for
/// tandem_cuda_error().
tandem_status told(Status status, cudaError_t error);

template <typename Query>
tandem_status told(Status status, const Query& query) {
  return told(status, query.cuda_error());
}

/// The assets that a handle was given; they outlive what it derives from this.
struct GivenAssets : Allocated {
  Allocator allocator;
  tandem_gpu_assets* assets = nullptr;

  GivenAssets() = default;
  GivenAssets(const GivenAssets&) = delete;
  GivenAssets& operator=(const GivenAssets&) = delete;
  ~GivenAssets() { tandem_gpu_assets_release(assets); }
};

/// What every handle of a query has.
template <typename Query>
struct GpuHandle : GivenAssets {
  GpuArray<uint32_t> given_count;  ///< of pairs whose number the caller has in CPU memory
  Query query;

  /// Gives it the assets by `name`, and room for nothing by `prepare`, so that its arrays are there. After an
  /// error there are no assets.
  template <typename Name, typename Prepare>
  tandem_status take(tandem_gpu_assets* given, const Name& name, const Prepare& prepare) {
    if (given == nullptr) return TANDEM_NULL_ARGUMENT;
    tandem_gpu_assets_retain(given);
    tandem_gpu_assets* const before = assets;
    assets = nullptr;
    Status status = name();
    if (status == Status::kOk) status = prepare();
    tandem_status result = told(status, query);
    if (result == TANDEM_OK) {
      const cudaError_t error = given_count.reserve(1);
      result = told(status_of(error), error);
    }
    tandem_gpu_assets_release(before);
    if (result == TANDEM_OK) {
      assets = given;
    } else {
      tandem_gpu_assets_release(given);
    }
    return result;
  }
};

/// Runs the body of a function that needs assets.
template <typename Of, typename Body>
tandem_status with_assets(Of* handle, const Body& body) noexcept {
  return guarded(handle, [&](Of& self) -> tandem_status {
    return self.assets != nullptr ? body(self) : tandem_status{TANDEM_ASSETS_MISSING};
  });
}

/// Makes a handle. The objects inside take no GPU memory yet.
template <typename Of>
tandem_status create_gpu(const tandem_allocator* given, Of** handle) noexcept {
  if (handle == nullptr) return TANDEM_NULL_ARGUMENT;
  *handle = nullptr;
  Allocator allocator;
  if (const tandem_status status = read_allocator(given, allocator); status != TANDEM_OK) return status;
  const AllocatorScope scope(allocator);
  Of* const made = new (std::nothrow) Of;
  if (made == nullptr) return TANDEM_OUT_OF_MEMORY;
  made->allocator = allocator;
  *handle = made;
  return TANDEM_OK;
}

/// What a handle's query has, or `none` before it has assets.
template <typename Of, typename Result, typename Get>
Result of_query(const Of* handle, Result none, const Get& get) {
  return handle != nullptr && handle->assets != nullptr ? get(handle->query) : none;
}

/// What the GPU found: fills the caller's report, where there is one.
template <typename Of, typename Report>
tandem_status get_report(const Of* handle, Report* report) {
  if (report != nullptr) *report = {};
  if (handle == nullptr) return TANDEM_NULL_ARGUMENT;
  if (handle->assets == nullptr) return TANDEM_ASSETS_MISSING;
  if (report != nullptr) *report = reinterpret_cast<const Report&>(handle->query.report());
  return told(handle->query.report().status, cudaSuccess);
}

template <typename Of>
size_t bytes_of(const Of* handle) {
  return handle != nullptr ? handle->query.bytes() + handle->given_count.bytes() : 0;
}

/// The caller's instances. Result: TANDEM_OK, TANDEM_NULL_ARGUMENT or TANDEM_BAD_OPTION.
tandem_status read_instances(const tandem_gpu_instances* given, GpuInstances& instances);

/// The caller's pairs. Where their number is in CPU memory it is queued on `stream` that `room` holds it.
/// Result: TANDEM_OK, TANDEM_NULL_ARGUMENT, TANDEM_BAD_OPTION, or what CUDA says.
tandem_status read_pairs(const tandem_gpu_pairs* given, uint32_t* room, GpuPairs& pairs, cudaStream_t stream);

/// The filter of a call; null: none.
tandem_status read_gpu_filter(const tandem_gpu_pair_filter* given, PairFilter& filter);

}  // namespace tandem::c
