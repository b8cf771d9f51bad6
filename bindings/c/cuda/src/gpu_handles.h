#pragma once
#include <cuda_runtime_api.h>

#include <atomic>
#include <bit>
#include <functional>
#include <optional>

#include "entry.h"
#include "rows.h"
#include "tandem/dynamics/gpu_world.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_containment_query.h"
#include "tandem/kernels/gpu_deformer.h"
#include "tandem/kernels/gpu_distance_query.h"
#include "tandem/kernels/gpu_excluded_pairs.h"
#include "tandem/kernels/gpu_impact_query.h"
#include "tandem/kernels/gpu_manifold_query.h"
#include "tandem/kernels/gpu_probe_query.h"
#include "tandem/kernels/gpu_scene.h"
#include "tandem/kernels/gpu_tolerance_query.h"
#include "tandem/runtime/upload.h"
#include "tandem/tandem_cuda.h"

struct tandem_gpu_assets : tandem::Allocated {
  std::atomic<size_t> references = 1;
  tandem::DeviceAssets files;
  tandem::Buffer<tandem::GpuAsset> assets;  ///< the first level that each shows
  tandem::Buffer<tandem::GpuAsset> levels;  ///< all that they show, asset by asset; none where some deform
  tandem::GpuAssetList list;
  tandem::Allocator allocator;

  tandem_gpu_assets* at_rest = nullptr;  ///< those that have the files, where some deform
  std::optional<tandem::GpuDeformer> deformer;

  ~tandem_gpu_assets() { tandem_gpu_assets_release(at_rest); }
  tandem::GpuAssetBounds bounds_of_all() const { return list.records().bounds_of_all(); }
};

struct tandem_gpu_excluded_pairs : tandem::Allocated {
  tandem::GpuExcludedPairs table;
  tandem::Allocator allocator;
};

namespace tandem::c {

#include "gpu_layouts.h"

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

/// The base of every handle of a query.
template <typename Query>
struct GpuHandle : GivenAssets {
  GpuArray<uint32_t> given_count;  ///< of pairs whose number the caller has in CPU memory
  Query query;

  /// A handle that remembers what its last call found hides these: forget() when a call begins, note() when
  /// it has ended.
  void forget() {}
  template <typename Options>
  void note(const Options&, Status) {}
};

/// Makes a handle, which takes no GPU memory yet.
template <typename Of>
tandem_status create_gpu(const tandem_allocator* allocator, Of** handle) noexcept {
  return create(allocator, handle, [](Of&) { return tandem_status{TANDEM_OK}; });
}

/// Gives a handle the assets by `name`, and room for nothing, so that its arrays are there. After an error
/// there are no assets.
template <typename Of, typename Name>
tandem_status take_assets(Of* handle, tandem_gpu_assets* given, const Name& name) noexcept {
  return guarded(handle, [&](Of& self) -> tandem_status {
    self.forget();
    if (given == nullptr) return TANDEM_NULL_ARGUMENT;
    tandem_gpu_assets_retain(given);
    tandem_gpu_assets* const before = self.assets;
    self.assets = nullptr;
    Status status = name(self.query);
    if constexpr (requires { self.query.follow(given->list.records()); }) {
      if (status == Status::kOk && given->deformer.has_value())
        status = self.query.follow(given->list.records());
    }
    if (status == Status::kOk) status = self.query.reserve({});
    tandem_status result = told(status, self.query);
    if (result == TANDEM_OK) {
      const cudaError_t error = self.given_count.reserve(1);
      result = told(status_of(error), error);
    }
    tandem_gpu_assets_release(before);
    if (result == TANDEM_OK) {
      self.assets = given;
    } else {
      tandem_gpu_assets_release(given);
    }
    return result;
  });
}

/// Runs the body of a function that needs assets.
template <typename Of, typename Body>
tandem_status with_assets(Of* handle, const Body& body) noexcept {
  return guarded(handle, [&](Of& self) -> tandem_status {
    return self.assets != nullptr ? body(self) : tandem_status{TANDEM_ASSETS_MISSING};
  });
}

/// Makes room for what a capacity says, by the query's reserve() with what `options` gives for it.
template <typename Of, typename Capacity, typename Body>
tandem_status reserve(Of* handle, const Capacity* capacity, const Body& body) noexcept {
  return with_assets(handle, [&](Of& self) -> tandem_status {
    if (capacity == nullptr) return TANDEM_NULL_ARGUMENT;
    if constexpr (requires { capacity->reserved; }) {
      if (capacity->reserved != 0) return TANDEM_BAD_OPTION;
    }
    return body(self);
  });
}

/// Reserves room where a query has no options that reserve() needs to know. Room: the query's capacity.
template <typename Room, typename Of, typename Capacity>
tandem_status reserve(Of* handle, const Capacity* capacity) noexcept {
  return reserve(handle, capacity, [&](Of& self) {
    return told(self.query.reserve(std::bit_cast<Room>(*capacity)), self.query);
  });
}

/// Returns what a handle's query has, or `none` before it has assets.
template <typename Of, typename Result, typename Get>
Result of_query(const Of* handle, Result none, const Get& get) {
  return handle != nullptr && handle->assets != nullptr ? std::invoke(get, handle->query) : none;
}

/// Rows in GPU memory that a query has.
template <typename Row, typename Of, typename Get>
const Row* rows_of(const Of* handle, const Get& get) {
  const auto rows = [&](const auto& query) { return reinterpret_cast<const Row*>(std::invoke(get, query)); };
  return of_query(handle, static_cast<const Row*>(nullptr), rows);
}

/// Fills the caller's report, where there is one, with what the GPU found.
template <typename Of, typename Report>
tandem_status get_report(const Of* handle, Report* report) {
  if (report != nullptr) *report = {};
  if (handle == nullptr) return TANDEM_NULL_ARGUMENT;
  if (handle->assets == nullptr) return TANDEM_ASSETS_MISSING;
  if (report != nullptr) *report = reinterpret_cast<const Report&>(handle->query.report());
  return told(handle->query.report().status, cudaSuccess);
}

/// Defines the functions that all handles have in the same form.
#define TANDEM_GPU_HANDLE(handle, report_row)                                                \
  tandem_status handle##_create(const tandem_allocator* allocator, handle** made) {          \
    return create_gpu(allocator, made);                                                      \
  }                                                                                          \
  void handle##_destroy(handle* of) {                                                        \
    delete of;                                                                               \
  }                                                                                          \
  const report_row* handle##_device_report(const handle* of) {                               \
    return rows_of<report_row>(of, [](const auto& query) { return query.device_report(); }); \
  }                                                                                          \
  tandem_status handle##_get_report(const handle* of, report_row* report) {                  \
    return get_report(of, report);                                                           \
  }                                                                                          \
  size_t handle##_bytes(const handle* of) {                                                  \
    return of != nullptr ? of->query.bytes() + of->given_count.bytes() : 0;                  \
  }

/// The caller's instances. Result: TANDEM_OK, TANDEM_NULL_ARGUMENT or TANDEM_BAD_OPTION.
tandem_status read_instances(const tandem_gpu_instances* given, GpuInstances& instances);

/// The caller's pairs. Where their number is in CPU memory it is queued on `stream` that `room` holds it.
/// Result: TANDEM_OK, TANDEM_NULL_ARGUMENT, TANDEM_BAD_OPTION, or what CUDA says.
tandem_status read_pairs(const tandem_gpu_pairs* given, uint32_t* room, GpuPairs& pairs, cudaStream_t stream);

/// The filter of a call; null: none.
tandem_status read_gpu_filter(const tandem_gpu_pair_filter* given, PairFilter& filter);

/// Pairs of a library as the caller reads them.
inline tandem_gpu_pairs pairs_to_c(const GpuPairs& pairs) {
  return {reinterpret_cast<const tandem_object_pair*>(pairs.pairs), pairs.count, pairs.capacity, 0};
}

}  // namespace tandem::c
