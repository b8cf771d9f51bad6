#pragma once
#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/transform_iterator.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>
#include <span>
#include <vector>

#include "dynamics/cuda/block_team.cuh"
#include "dynamics/parallel/worker.h"
#include "kernels/common/cub_code.cuh"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"

namespace tandem::dynamics {

template <typename Visit>
__global__ void __launch_bounds__(128)
    visit_each(const __grid_constant__ Visit visit, const std::uint32_t* count, std::uint32_t most) {
  const std::uint32_t below = count != nullptr && *count < most ? *count : most;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < below; i += gridDim.x * blockDim.x)
    visit(i);
}

/// Visits as if there were one thing.
template <typename Visit>
struct VisitOnce {
  Visit visit;
  __device__ void operator()(std::uint32_t) const { visit(); }
};

/// Returns whether a number is below the count and is listed.
template <typename IsIn>
struct IsListed {
  IsIn is_in;
  const std::uint32_t* count;
  __device__ bool operator()(std::uint32_t i) const { return (count == nullptr || i < *count) && is_in(i); }
};

/// Makes keys behind the last one the largest.
struct FillBehind {
  std::uint32_t* keys;
  const std::uint32_t* count;
  __device__ void operator()(std::uint32_t i) const {
    if (i >= *count) keys[i] = 0xFFFFFFFFu;
  }
};
template <typename Visit>
__global__ void __launch_bounds__(128) visit_together(const __grid_constant__ Visit visit) {
  // The first teams are in different blocks, so that few teams have a processor each.
  visit(Worker{threadIdx.x / 32 * gridDim.x + blockIdx.x, blockDim.x / 32 * gridDim.x, threadIdx.x % 32, 32});
}

/// Large things are visited by blocks, then the others by warps, each by whoever is free. Shared: has nothing
/// to be constructed or destroyed. taken: by blocks, by warps; 0 before.
template <typename Shared, typename Visit>
__global__ void __launch_bounds__(BlockTeam::kSize)
    visit_by_teams(const __grid_constant__ Visit visit, const std::uint32_t* count, std::uint32_t most,
                   std::uint32_t* taken) {
  __shared__ BlockTeam::Shared of_team;
  __shared__ std::uint32_t of_block;
  alignas(16) __shared__ unsigned char bytes[BlockTeam::kWarps][sizeof(Shared)];
  const auto shared = [&](std::uint32_t warp) -> Shared& { return *reinterpret_cast<Shared*>(bytes[warp]); };
  const BlockTeam block(of_team);
  const std::uint32_t below = *count < most ? *count : most;
  for (;;) {
    if (block.rank() == 0) of_block = atomicAdd(taken, 1u);
    __syncthreads();
    const std::uint32_t i = of_block;
    __syncthreads();
    if (i >= below) break;
    if (visit.is_large(i)) visit(block, i, shared(0));
  }
  const WarpTeam team;
  for (;;) {
    std::uint32_t i = team.rank() == 0 ? atomicAdd(taken + 1, 1u) : 0;
    i = __shfl_sync(0xFFFFFFFFu, i, 0);
    if (i >= below) break;
    if (!visit.is_large(i)) visit(team, i, shared(threadIdx.x / WarpTeam::kSize));
    __syncwarp();
  }
}

template <typename Visit>
__global__ void __launch_bounds__(128)
    visit_in_cluster(const __grid_constant__ Visit visit, std::uint32_t bytes) {
  extern __shared__ __align__(128) char own_of_block[];
  visit(ClusterWorker{blockIdx.x, gridDim.x, threadIdx.x / 32, blockDim.x / 32, threadIdx.x % 32, 32,
                      own_of_block, bytes});
}

/// Returns the values of an array, and 0 behind the last of them.
struct ValueOrZero {
  const std::uint32_t *values, *count;
  std::uint32_t most;
  __host__ __device__ std::uint32_t operator()(std::uint32_t i) const {
    return i < most && (count == nullptr || i < *count) ? values[i] : 0;
  }
};

/// Queues the parts of a parallel step on a stream of a GPU; see HostExecutor. It neither waits nor
/// allocates, but for arrays and where the room for sums and sorting is made. After an error it does nothing
/// more.
class CudaExecutor {
  struct Later {
    void* to;
    std::size_t bytes;
  };

 public:
  template <typename T>
  class Array {
   public:
    Status reserve(std::uint64_t count) { return status_of(array_.grow(count)); }
    Status grow(std::uint64_t count, std::uint64_t kept) { return status_of(array_.grow(count, kept)); }
    T* data() const { return array_.data(); }
    std::uint64_t room() const { return array_.room(); }
    std::size_t bytes() const { return array_.bytes(); }

   private:
    GpuArray<T> array_;
  };

  static constexpr bool kHasManyWorkers = true;

  /// Calls that are queued as one graph when they come for the third time.
  class Sequence {
   public:
    Sequence() = default;
    Sequence(const Sequence&) = delete;
    Sequence& operator=(const Sequence&) = delete;
    ~Sequence() { forget(); }

   private:
    friend CudaExecutor;
    void forget() {
      if (graph_ != nullptr) static_cast<void>(cudaGraphExecDestroy(graph_));
      graph_ = nullptr;
      times_ = 0;
    }

    std::uint64_t key_ = 0;
    std::uint32_t times_ = 0;  // that they were queued one by one
    cudaGraphExec_t graph_ = nullptr;
    std::vector<Later> later_;
  };

  explicit CudaExecutor(cudaStream_t stream = nullptr) : stream_(stream) {}

  /// See HostExecutor. Condition: no copies are waited for; the stream is one that can be captured.
  template <typename Enqueue>
  void again(Sequence& sequence, std::uint64_t key, const Enqueue& enqueue) {
    constexpr std::uint32_t kTimesBefore =
        2;  // what is queued but once needs no graph; and kernels are loaded
    if (sequence.key_ != key) sequence.forget();
    sequence.key_ = key;
    if (sequence.graph_ == nullptr) {
      if (sequence.times_++ < kTimesBefore) return enqueue();
      cudaGraph_t graph = nullptr;
      if (error_ == cudaSuccess) take(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeThreadLocal));
      if (error_ != cudaSuccess) return;
      enqueue();
      take(cudaStreamEndCapture(stream_, &graph));
      if (error_ == cudaSuccess) take(cudaGraphInstantiate(&sequence.graph_, graph, 0));
      if (graph != nullptr) static_cast<void>(cudaGraphDestroy(graph));
      sequence.later_ = std::move(later_);
    }
    later_ = sequence.later_;
    if (error_ == cudaSuccess) take(cudaGraphLaunch(sequence.graph_, stream_));
  }

  /// GPU memory held, but for arrays.
  std::size_t bytes() const { return scratch_.bytes() + other_keys_.bytes() + other_values_.bytes(); }

  cudaStream_t stream() const { return stream_; }
  void set_stream(cudaStream_t stream) { stream_ = stream; }

  /// Makes room for sums and sorting of so many. Waits for the GPU where memory grows.
  Status reserve(std::uint32_t most) {
    if (most <= room_) return Status::kOk;
    std::size_t of_sums = 0, of_sort = 0, of_lists = 0;
    cudaError_t error = gpu::load_cub_code();
    if (error == cudaSuccess) error = sum(nullptr, of_sums, nullptr, nullptr, most, nullptr);
    cub::DoubleBuffer<std::uint32_t> keys(nullptr, nullptr), values(nullptr, nullptr);
    if (error == cudaSuccess)
      error = cub::DeviceRadixSort::SortPairs(nullptr, of_sort, keys, values, most, 0, 32, stream_);
    const auto is_in = IsListed<ValueOrZero>{};
    if (error == cudaSuccess)
      error = cub::DeviceSelect::If(nullptr, of_lists, thrust::counting_iterator<std::uint32_t>(0),
                                    static_cast<std::uint32_t*>(nullptr),
                                    static_cast<std::uint32_t*>(nullptr), most, is_in, stream_);
    // The room for a list does not depend on what is listed, but for its alignment.
    if (error == cudaSuccess) error = scratch_.grow(std::max({of_sums, of_sort, 2 * of_lists + 4096}));
    if (error == cudaSuccess) error = other_keys_.grow(most);
    if (error == cudaSuccess) error = other_values_.grow(most);
    if (error == cudaSuccess) room_ = most;
    return status_of(error);
  }

  template <typename Visit>
  void for_each(const std::uint32_t* count, std::uint32_t most, const Visit& visit) {
    constexpr std::uint32_t kThreads = 128, kMostBlocks = 1 << 16;
    if (most == 0 || error_ != cudaSuccess) return;
    const std::uint32_t blocks = std::min((most - 1) / kThreads + 1, kMostBlocks);
    visit_each<<<blocks, kThreads, 0, stream_>>>(visit, count, most);
    take(cudaGetLastError());
  }

  template <typename Visit>
  void together(std::uint32_t most_teams, const Visit& visit) {
    constexpr int kThreads = 128;
    const std::uint32_t blocks = std::min(most_teams, blocks_at_once(visit_together<Visit>, kThreads));
    if (blocks == 0) return;
    // A cooperative launch fails unless all blocks fit at once.
    cudaLaunchAttribute cooperative = {};
    cooperative.id = cudaLaunchAttributeCooperative;
    cooperative.val.cooperative = 1;
    cudaLaunchConfig_t launch = {};
    launch.gridDim = dim3(blocks);
    launch.blockDim = dim3(kThreads);
    launch.stream = stream_;
    launch.attrs = &cooperative, launch.numAttrs = 1;
    take(cudaLaunchKernelEx(&launch, visit_together<Visit>, visit));
  }

  /// Condition: reserve(), for two at least.
  template <typename Shared, typename Visit>
  void by_teams(const std::uint32_t* count, std::uint32_t most, const Visit& visit) {
    const std::uint32_t blocks =
        std::min(most, blocks_at_once(visit_by_teams<Shared, Visit>, BlockTeam::kSize));
    if (blocks == 0) return;
    std::uint32_t* const taken = other_keys_.data();
    take(cudaMemsetAsync(taken, 0, 2 * sizeof *taken, stream_));
    visit_by_teams<Shared><<<blocks, BlockTeam::kSize, 0, stream_>>>(visit, count, most, taken);
    take(cudaGetLastError());
  }

  /// See HostExecutor. There can be none on GPUs before compute capability 9.
  template <typename Visit>
  void in_cluster(const Visit& visit) {
    constexpr unsigned kThreads = 128, kMostBlocks = 16;
    if (error_ != cudaSuccess) return;
    int device = 0, capability = 0, bytes = 0;
    take(cudaGetDevice(&device));
    take(cudaDeviceGetAttribute(&capability, cudaDevAttrComputeCapabilityMajor, device));
    take(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
    if (error_ != cudaSuccess || capability < 9) return;
    const auto kernel = visit_in_cluster<Visit>;
    take(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes));
    take(cudaFuncSetAttribute(kernel, cudaFuncAttributeNonPortableClusterSizeAllowed, 1));
    cudaLaunchAttribute cluster = {};
    cluster.id = cudaLaunchAttributeClusterDimension;
    cudaLaunchConfig_t launch = {};
    launch.blockDim = dim3(kThreads);
    launch.dynamicSmemBytes = static_cast<std::size_t>(bytes);
    launch.stream = stream_;
    launch.attrs = &cluster, launch.numAttrs = 1;
    // Some GPUs have no place for so many blocks side by side.
    for (unsigned blocks = kMostBlocks; blocks > 0 && error_ == cudaSuccess; blocks /= 2) {
      int clusters = 0;
      cluster.val.clusterDim.x = blocks, cluster.val.clusterDim.y = cluster.val.clusterDim.z = 1;
      launch.gridDim = dim3(blocks);
      take(cudaOccupancyMaxActiveClusters(&clusters, kernel, &launch));
      if (clusters == 0) continue;
      take(cudaLaunchKernelEx(&launch, kernel, visit, static_cast<std::uint32_t>(bytes)));
      return;
    }
  }

  template <typename Visit>
  void once(const Visit& visit) {
    for_each(nullptr, 1, VisitOnce<Visit>{visit});
  }

  template <typename IsIn>
  void select(const IsIn& is_in, const std::uint32_t* count, std::uint32_t most, std::uint32_t* list,
              std::uint32_t* listed) {
    if (error_ != cudaSuccess) return;
    std::size_t bytes = scratch_.room();
    take(cub::DeviceSelect::If(scratch_.data(), bytes, thrust::counting_iterator<std::uint32_t>(0), list,
                               listed, most, IsListed<IsIn>{is_in, count}, stream_));
  }

  template <typename T>
  Status copy(std::span<const T> from, T* to) {
    take(cudaMemcpyAsync(to, from.data(), from.size_bytes(), cudaMemcpyHostToDevice, stream_));
    return wait();
  }
  template <typename T>
  Status copy(const T* from, std::span<T> to) {
    take(cudaMemcpyAsync(to.data(), from, to.size_bytes(), cudaMemcpyDeviceToHost, stream_));
    return wait();
  }

  template <typename T>
  void copy_within(const T* from, std::uint64_t count, T* to) {
    if (error_ == cudaSuccess && count > 0)
      take(cudaMemcpyAsync(to, from, count * sizeof(T), cudaMemcpyDeviceToDevice, stream_));
  }

  template <typename T>
  void copy_later(const T* from, T& to) {
    static_assert(sizeof(T) <= kMostBytesOfValue);
    if (error_ == cudaSuccess) take(values_.reserve(kMostValues * kMostBytesOfValue));
    if (error_ == cudaSuccess && later_.size() == kMostValues) static_cast<void>(wait());
    if (error_ != cudaSuccess) return;
    char* const place = values_.data() + later_.size() * kMostBytesOfValue;
    take(cudaMemcpyAsync(place, from, sizeof(T), cudaMemcpyDeviceToHost, stream_));
    later_.push_back({&to, sizeof(T)});
  }

  /// Waits until all that is queued is done.
  Status wait() {
    if (error_ == cudaSuccess) take(cudaStreamSynchronize(stream_));
    for (std::size_t i = 0; i < later_.size() && error_ == cudaSuccess; ++i)
      std::memcpy(later_[i].to, values_.data() + i * kMostBytesOfValue, later_[i].bytes);
    later_.clear();
    return status();
  }

  void sum_before(const std::uint32_t* values, const std::uint32_t* count, std::uint32_t most,
                  std::uint32_t* sums) {
    std::size_t bytes = scratch_.room();
    if (error_ == cudaSuccess) take(sum(scratch_.data(), bytes, values, count, most, sums));
  }

  void sort_by_key(std::uint32_t* keys, std::uint32_t* values, const std::uint32_t* count, std::uint32_t most,
                   int bits) {
    if (most == 0) return;
    if (count != nullptr) for_each(nullptr, most, FillBehind{keys, count});
    if (error_ != cudaSuccess) return;
    std::size_t bytes = scratch_.room();
    cub::DoubleBuffer<std::uint32_t> of_keys(keys, other_keys_.data()),
        of_values(values, other_values_.data());
    take(cub::DeviceRadixSort::SortPairs(scratch_.data(), bytes, of_keys, of_values, most, 0, bits, stream_));
    const auto copy_back = [&](const std::uint32_t* from, std::uint32_t* to) {
      if (from != to) take(cudaMemcpyAsync(to, from, most * sizeof *to, cudaMemcpyDeviceToDevice, stream_));
    };
    copy_back(of_keys.Current(), keys), copy_back(of_values.Current(), values);
  }

  /// Keeps the first error of a call of CUDA.
  void take(cudaError_t error) {
    if (error_ == cudaSuccess) error_ = error;
  }
  Status status() const { return status_of(error_); }
  cudaError_t error() const { return error_; }
  void forget_error() { error_ = cudaSuccess; }

 private:
  cudaError_t sum(void* scratch, std::size_t& bytes, const std::uint32_t* values, const std::uint32_t* count,
                  std::uint32_t most, std::uint32_t* sums) const {
    const auto in = thrust::make_transform_iterator(thrust::counting_iterator<std::uint32_t>(0),
                                                    ValueOrZero{values, count, most});
    return cub::DeviceScan::ExclusiveSum(scratch, bytes, in, sums, most + 1, stream_);
  }

  // Returns how many blocks of a kernel the GPU runs at once; 0 after an error.
  template <typename Kernel>
  std::uint32_t blocks_at_once(const Kernel& kernel, std::uint32_t threads) {
    int device = 0, processors = 0, of_processor = 0;
    if (error_ == cudaSuccess) take(cudaGetDevice(&device));
    if (error_ == cudaSuccess)
      take(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device));
    if (error_ == cudaSuccess)
      take(
          cudaOccupancyMaxActiveBlocksPerMultiprocessor(&of_processor, kernel, static_cast<int>(threads), 0));
    return error_ == cudaSuccess ? static_cast<std::uint32_t>(processors * of_processor) : 0;
  }

  static constexpr std::size_t kMostValues = 8, kMostBytesOfValue = 256;

  std::vector<Later> later_;
  PinnedArray<char> values_;
  cudaStream_t stream_;
  cudaError_t error_ = cudaSuccess;
  std::uint32_t room_ = 0;
  GpuArray<char> scratch_;
  GpuArray<std::uint32_t> other_keys_, other_values_;
};

}  // namespace tandem::dynamics
