#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/gpu_scene.h"

namespace tandem {

/// How many of each there is room for, or how many there have to be.
struct GpuContainmentCapacity {
  std::uint32_t pairs = 0;      ///< object pairs of the query
  std::uint32_t contained = 0;  ///< components that lie within the other body
};

/// GPU memory that an object with room for so much holds at most. triangles: of all assets that have more
/// than one component, together.
constexpr std::size_t most_containment_bytes(const GpuContainmentCapacity& capacity, std::size_t assets,
                                             std::size_t triangles) {
  constexpr std::size_t kFixed = 4096;
  return kFixed + 128 * assets + 4 * triangles + 5 * std::size_t{capacity.pairs} +
         36 * std::size_t{capacity.contained};
}

/// The outcome of a call.
struct GpuContainmentReport {
  Status status;           ///< that of the contact query
  std::uint32_t complete;  ///< 0 where something did not fit, or the contact query was not complete; then
                           ///< nothing is contained
  GpuContainmentCapacity needed;  ///< `contained` is exact where there was room for all pairs
  std::uint32_t contained;
};

/// Finds what lies within another body of an object pair without touching it, on the GPU: what
/// ContainmentQuery finds, in its order. enqueue() neither waits for the GPU nor allocates. Throws nothing.
/// Movable, not copyable. An object runs one call at a time.
class GpuContainmentQuery {
 public:
  GpuContainmentQuery();
  GpuContainmentQuery(GpuContainmentQuery&&) noexcept;
  GpuContainmentQuery& operator=(GpuContainmentQuery&&) noexcept;
  ~GpuContainmentQuery();  ///< waits for the device

  /// Names the assets that instances refer to, the list given to the contact query, on the current device,
  /// after what `stream` holds, and waits for it. Of assets with more than one component it takes the
  /// topology back to the CPU once. Result: kOk; kNoTopology, where an asset was uploaded without; or
  /// kOutOfGpuMemory, kOutOfMemory, kNoGpu, kDriverTooOld, kGpuNotSupported, kCudaFailed.
  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream);

  /// Makes room for at least so much, waiting for the device where it grows. Result: kOk, kOutOfGpuMemory,
  /// kCudaFailed. Condition: set_assets().
  Status reserve(const GpuContainmentCapacity& capacity);

  /// Queues the search behind what `stream` holds, the contact query among it; it may be captured into a
  /// graph. The arrays must stay until it is done. instances, pairs: those of the contact query, which groups
  /// its contacts, in mode exact; where no body has two components, the first contact of each pair will do.
  /// Result: kOk, kCudaFailed, or kOutOfGpuMemory, where CUDA loads a kernel at its first launch; what the
  /// GPU finds is in the report. Condition: set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
                 cudaStream_t stream);

  /// Searches behind a contact query that has ended and is complete, and waits for it; where room was too
  /// small, makes room and starts again. Result: that of the report, or of a call that failed; kOutOfRange
  /// where the contact query was not complete.
  Status find(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
              cudaStream_t stream);

  /// In GPU memory: report().contained of them.
  const Containment* contained() const;
  const GpuContainmentReport* device_report() const;

  /// In CPU memory. Condition: the stream has come to the end of the call.
  const GpuContainmentReport& report() const;

  GpuContainmentCapacity capacity() const;
  std::size_t bytes() const;  ///< GPU memory held, at most most_containment_bytes()
  cudaError_t cuda_error() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
