#pragma once
#include <atomic>

#include "arrays.h"

namespace tandem::python {

/// GPU memory of the package's own.
class Buffer {
 public:
  explicit Buffer(std::size_t bytes) : bytes_(bytes) {
    check_cuda(cudaMalloc(&data_, bytes == 0 ? 1 : bytes));
  }
  ~Buffer() { static_cast<void>(cudaFree(data_)); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  void* data() const { return data_; }
  std::size_t bytes() const { return bytes_; }

 private:
  void* data_ = nullptr;
  std::size_t bytes_;
};

class Positions;

constexpr const char* kBusy = "the query is at work for another thread";

/// Copies of assets in the memory of one GPU, of which some may deform.
class Assets {
 public:
  /// deforming: ascending. takes_float64: positions may be in float64 too.
  Assets(nb::list assets, int device, std::uint32_t contents, std::vector<std::uint32_t> deforming,
         bool takes_float64, const Stream& stream);
  ~Assets() { tandem_gpu_assets_release(assets_); }
  Assets(const Assets&) = delete;
  Assets& operator=(const Assets&) = delete;
  tandem_gpu_assets* get() const { return assets_; }
  int device() const { return device_; }
  std::size_t bytes() const { return tandem_gpu_assets_bytes(assets_); }

  /// Returns so many zeros in GPU memory, the numbers of instances that are all of asset 0. Allocates, and
  /// waits for the device, where there were never as many.
  std::shared_ptr<Buffer> zeros(std::size_t count) const;

  /// Returns the numbers of the assets that deform.
  const std::vector<std::uint32_t>& deforming() const { return deforming_; }
  bool takes_float64() const { return takes_float64_; }
  std::uint64_t source_vertices(std::uint32_t asset) const { return source_vertices_[asset]; }

  /// Deforms assets: waits, or queues that alone.
  void deform(const Positions& positions, const Stream& stream) const;
  void enqueue_deform(const Positions& positions, const Stream& stream) const;
  /// Throws what was wrong with the positions of the last call, if calls were queued. Condition: the stream
  /// has passed it.
  void check_queued() const;

 private:
  void upload(nb::list assets, std::uint32_t contents, const Stream& stream);
  void check_report(tandem_status status) const;

  tandem_gpu_assets* assets_ = nullptr;
  int device_;
  bool takes_float64_;
  std::vector<std::uint32_t> deforming_;
  std::vector<std::uint64_t> source_vertices_;  // of each asset
  mutable bool is_queued_ = false;              // some call that deforms was queued, or captured
  mutable std::atomic<bool> busy_ = false;
  mutable std::shared_ptr<Buffer> zeros_;
};

/// Positions of assets that deform: somebody's arrays, which are read where they are in every call.
class Positions {
 public:
  /// positions: an array, or None, for each asset that deforms. Waits for the stream.
  Positions(const Assets& assets, nb::list positions, const Stream& stream);
  Positions(const Positions&) = delete;
  Positions& operator=(const Positions&) = delete;
  const float* const* in_float32() const { return static_cast<const float* const*>(places_->data()); }
  /// Returns null where all arrays are in float32.
  const double* const* in_float64() const {
    return has_float64_ ? static_cast<const double* const*>(places_->data()) + count_ : nullptr;
  }
  /// Throws ValueError where they were made for other assets.
  void require_assets(const Assets& assets) const;

 private:
  const Assets* assets_;
  std::vector<GivenArray> arrays_;
  std::size_t count_ = 0;
  bool has_float64_ = false;
  std::shared_ptr<Buffer> places_;  // of the arrays
};

/// Bodies: somebody's arrays of assets and poses, which are read where they are in every call.
class Instances {
 public:
  Instances(const Assets& assets, nb::handle asset, nb::handle pose, const Stream& stream);
  const tandem_gpu_instances& get() const { return instances_; }
  std::size_t count() const { return instances_.count; }
  int device() const { return device_; }

 private:
  GivenArray asset_, pose_;
  std::shared_ptr<Buffer> zeros_;
  tandem_gpu_instances instances_ = {};
  int device_;
};

/// Throws ValueError where they lie on another GPU.
const Instances& bodies_of(nb::handle instances, int device);

/// Object pairs: somebody's array, or rows that a query found.
class Pairs {
 public:
  Pairs(nb::handle pairs, const Stream& stream, int device);
  const tandem_gpu_pairs& get() const { return pairs_; }
  std::size_t count() const { return pairs_.capacity; }

 private:
  GivenArray given_;
  tandem_gpu_pairs pairs_ = {};
};

/// Says which pairs a query looks at. Its arrays are read where they are.
class GpuFilter {
 public:
  GpuFilter(nb::handle motion, nb::handle group, nb::handle mask, nb::handle world, nb::handle excluded,
            const Stream& stream, int device);
  ~GpuFilter() { tandem_gpu_excluded_pairs_destroy(excluded_); }
  GpuFilter(const GpuFilter&) = delete;
  GpuFilter& operator=(const GpuFilter&) = delete;
  /// Returns the filter of C, null for none. Throws ValueError where it is of another number of instances, or
  /// lies on another GPU.
  static const tandem_gpu_pair_filter* of(const GpuFilter* filter, const Instances& bodies);

 private:
  GivenArray motion_, group_, mask_, world_;
  tandem_gpu_excluded_pairs* excluded_ = nullptr;
  tandem_gpu_pair_filter filter_ = {};
  std::int64_t count_ = -1;  // any
  int device_;
};

}  // namespace tandem::python
