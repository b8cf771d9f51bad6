#pragma once
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

/// Copies of assets in the memory of one GPU.
class Assets {
 public:
  Assets(nb::list assets, int device, std::uint32_t contents, const Stream& stream);
  ~Assets() { tandem_gpu_assets_release(assets_); }
  Assets(const Assets&) = delete;
  Assets& operator=(const Assets&) = delete;
  tandem_gpu_assets* get() const { return assets_; }
  int device() const { return device_; }
  std::size_t bytes() const { return tandem_gpu_assets_bytes(assets_); }

  /// Returns so many zeros in GPU memory, the numbers of instances that are all of asset 0. Allocates, and
  /// waits for the device, where there were never as many.
  std::shared_ptr<Buffer> zeros(std::size_t count) const;

 private:
  tandem_gpu_assets* assets_ = nullptr;
  int device_;
  mutable std::shared_ptr<Buffer> zeros_;
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
