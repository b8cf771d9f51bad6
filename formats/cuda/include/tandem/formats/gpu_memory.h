#pragma once
#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace tandem {

/// Memory of the current GPU.
struct GpuMemory {
  static cudaError_t allocate(void** memory, std::size_t bytes) { return cudaMalloc(memory, bytes); }
  static void free(void* memory) { static_cast<void>(cudaFree(memory)); }
};

/// CPU memory that is never paged out, so that a GPU reads and writes it while the CPU runs on.
struct PinnedMemory {
  static cudaError_t allocate(void** memory, std::size_t bytes) { return cudaMallocHost(memory, bytes); }
  static void free(void* memory) { static_cast<void>(cudaFreeHost(memory)); }
};

/// Owns an array of trivial elements, which are not initialised. The array grows and is never shrunk.
/// Movable, not copyable; throws nothing. Functions that allocate return what CUDA returned; an allocation
/// that failed is not reported again by cudaGetLastError().
template <typename Element, typename Memory>
class CudaArray {
 public:
  CudaArray() = default;
  CudaArray(CudaArray&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), room_(std::exchange(other.room_, 0)) {}
  CudaArray& operator=(CudaArray&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(room_, other.room_);
    return *this;
  }
  ~CudaArray() { free(); }

  Element* data() const { return data_; }        ///< null where there is no room
  Element& operator*() const { return *data_; }  ///< the first
  Element* operator->() const { return data_; }
  std::size_t room() const { return room_; }  ///< elements
  std::size_t bytes() const { return room_ * sizeof(Element); }

  /// Makes room for exactly `count` elements where there is less; the elements are lost then. Waits for the
  /// device where it grows. After an error the array is empty.
  cudaError_t reserve(std::size_t count) {
    if (count <= room_) return cudaSuccess;
    free();
    return allocate(count, data_, room_);
  }

  /// Makes room for `count` elements where there is less, and for half as many again as there were at least,
  /// so that repeated growth settles. The first `kept` elements stay, on the current device. Waits for the
  /// device where it grows. After an error the array is empty, or as it was where kept > 0.
  cudaError_t grow(std::size_t count, std::size_t kept = 0) {
    if (count <= room_) return cudaSuccess;
    const std::size_t wanted = std::max(count, room_ + room_ / 2);
    if (kept == 0) return reserve(wanted);
    CudaArray larger;
    cudaError_t error = larger.reserve(wanted);
    if (error == cudaSuccess)
      error = cudaMemcpy(larger.data_, data_, kept * sizeof(Element), cudaMemcpyDefault);
    if (error == cudaSuccess) *this = std::move(larger);
    return error;
  }

  /// Makes room for `elements` and queues their copy on `stream`. Condition: they stay until it is done.
  cudaError_t upload(std::span<const Element> elements, cudaStream_t stream) {
    const cudaError_t error = reserve(elements.size());
    if (error != cudaSuccess || elements.empty()) return error;
    return cudaMemcpyAsync(data_, elements.data(), elements.size_bytes(), cudaMemcpyDefault, stream);
  }

  void free() {
    if (data_ != nullptr) Memory::free(data_);
    data_ = nullptr;
    room_ = 0;
  }

 private:
  static cudaError_t allocate(std::size_t count, Element*& data, std::size_t& room) {
    if (count > SIZE_MAX / sizeof(Element)) return cudaErrorMemoryAllocation;
    void* memory = nullptr;
    const cudaError_t error = Memory::allocate(&memory, count * sizeof(Element));
    if (error != cudaSuccess) {
      static_cast<void>(cudaGetLastError());
      return error;
    }
    data = static_cast<Element*>(memory);
    room = count;
    return cudaSuccess;
  }

  Element* data_ = nullptr;
  std::size_t room_ = 0;
};

template <typename Element>
using GpuArray = CudaArray<Element, GpuMemory>;

template <typename Element>
using PinnedArray = CudaArray<Element, PinnedMemory>;

/// Copies from GPU memory, behind what `stream` holds, and waits until that is done.
template <typename Element>
cudaError_t download(const Element* from, std::span<Element> to, cudaStream_t stream) {
  if (to.empty()) return cudaStreamSynchronize(stream);
  const cudaError_t error = cudaMemcpyAsync(to.data(), from, to.size_bytes(), cudaMemcpyDeviceToHost, stream);
  return error == cudaSuccess ? cudaStreamSynchronize(stream) : error;
}

}  // namespace tandem
