#pragma once
#include <cuda_runtime_api.h>

#include <utility>

namespace tandem {

/// Owns a handle of CUDA's that `destroy` gives back. Movable, not copyable; throws nothing.
template <typename Handle, cudaError_t (*destroy)(Handle)>
class CudaHandle {
 public:
  CudaHandle() = default;
  CudaHandle(CudaHandle&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  CudaHandle& operator=(CudaHandle&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~CudaHandle() {
    if (handle_ != nullptr) static_cast<void>(destroy(handle_));
  }

  Handle get() const { return handle_; }  ///< null before it is created

 protected:
  Handle handle_ = nullptr;
};

inline cudaError_t destroy_stream(cudaStream_t stream) {
  return cudaStreamDestroy(stream);
}
inline cudaError_t destroy_event(cudaEvent_t event) {
  return cudaEventDestroy(event);
}
inline cudaError_t destroy_graph(cudaGraphExec_t graph) {
  return cudaGraphExecDestroy(graph);
}

/// A stream of the current device that does not wait for the default stream.
class GpuStream : public CudaHandle<cudaStream_t, destroy_stream> {
 public:
  /// Does nothing where it was created before.
  cudaError_t create() {
    return handle_ != nullptr ? cudaSuccess : cudaStreamCreateWithFlags(&handle_, cudaStreamNonBlocking);
  }
  cudaError_t wait() const { return cudaStreamSynchronize(handle_); }
};

/// A moment of a stream.
class GpuEvent : public CudaHandle<cudaEvent_t, destroy_event> {
 public:
  /// Does nothing where it was created before.
  cudaError_t create() { return handle_ != nullptr ? cudaSuccess : cudaEventCreate(&handle_); }

  /// `flags`: cudaEventRecordExternal where a captured graph is to record it.
  cudaError_t record(cudaStream_t stream, unsigned flags = cudaEventRecordDefault) const {
    return cudaEventRecordWithFlags(handle_, stream, flags);
  }

  /// Returns when the moment that was recorded last has passed, at once where there is none.
  cudaError_t wait() const { return cudaEventSynchronize(handle_); }
};

/// The time between two events of one stream. Condition: both have passed.
inline cudaError_t milliseconds_between(const GpuEvent& begin, const GpuEvent& end, float& milliseconds) {
  return cudaEventElapsedTime(&milliseconds, begin.get(), end.get());
}

/// Work that was queued once and is launched again and again.
class GpuGraph : public CudaHandle<cudaGraphExec_t, destroy_graph> {
 public:
  /// Captures what `enqueue()` queues on `stream`, which is not the default stream, instead of running it.
  /// Where `enqueue` throws, `stream` stays in capture and can only be destroyed. Condition: called once.
  template <typename Enqueue>
  cudaError_t capture(cudaStream_t stream, const Enqueue& enqueue) {
    cudaError_t error = cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal);
    if (error != cudaSuccess) return error;
    enqueue();
    cudaGraph_t graph = nullptr;
    error = cudaStreamEndCapture(stream, &graph);
    if (error != cudaSuccess) return error;
    error = cudaGraphInstantiate(&handle_, graph, 0);
    static_cast<void>(cudaGraphDestroy(graph));
    return error;
  }
  cudaError_t launch(cudaStream_t stream) const { return cudaGraphLaunch(handle_, stream); }
};

}  // namespace tandem
