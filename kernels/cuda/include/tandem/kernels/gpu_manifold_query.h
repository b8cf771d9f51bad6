#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/gpu_scene.h"
#include "tandem/kernels/manifold_query.h"

namespace tandem {

struct GpuManifoldOptions {
  /// As in ManifoldOptions.
  bool match_previous = true;
  std::uint32_t most_points = kMostManifoldPoints;
};

/// How many of each there is room for, or how many there have to be.
struct GpuManifoldCapacity {
  std::uint32_t pairs = 0;      ///< object pairs of the query
  std::uint64_t contacts = 0;   ///< of the query
  std::uint32_t manifolds = 0;  ///< and holes in them
  std::uint32_t points = 0;
};

/// GPU memory that an object with room for so much, of so many assets, holds at most.
constexpr std::size_t most_manifold_bytes(const GpuManifoldCapacity& capacity, std::size_t assets) {
  constexpr std::size_t kFixed = std::size_t{1} << 20;
  return kFixed + 128 * assets + 200 * std::size_t{capacity.pairs} + 180 * capacity.contacts +
         3076 * std::size_t{capacity.manifolds} + 208 * std::size_t{capacity.points};
}

/// The outcome of a call.
struct GpuManifoldReport {
  Status status;           ///< that of the query, kOk or an error; or kOutOfRange: a pair of 2^27 contacts
  std::uint32_t complete;  ///< 0 where something did not fit, or the query was not complete: then there are
                           ///< no manifolds
  GpuManifoldCapacity
      needed;  ///< where the query is complete; more points than needed, if manifolds did not fit
  std::uint32_t manifolds, points;
  ManifoldCounters counters;
};

/// Makes contact manifolds of the contacts that a GpuContactQuery found, on the GPU: the same bytes as
/// ManifoldQuery makes of them. enqueue() neither waits for the GPU nor allocates. Throws nothing.
/// Movable, not copyable. An object runs one call at a time.
class GpuManifoldQuery {
 public:
  GpuManifoldQuery();
  GpuManifoldQuery(GpuManifoldQuery&&) noexcept;
  GpuManifoldQuery& operator=(GpuManifoldQuery&&) noexcept;
  ~GpuManifoldQuery();  ///< waits for the device

  /// Names the assets that instances refer to, the list given to the query, on the current device, after what
  /// `stream` holds. Result: kOk; kNoTopology, where an asset was uploaded without; or kOutOfGpuMemory,
  /// kOutOfMemory, kNoGpu, kDriverTooOld, kGpuNotSupported, kCudaFailed. Forgets the last call.
  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream);

  /// Makes room for at least so much, waiting for the device where it grows. What the last call found is kept
  /// for the next one to match. Result: kOk, kOutOfGpuMemory, kOutOfRange (contacts or points: 2^31 or more),
  /// kCudaFailed. Condition: set_assets().
  Status reserve(const GpuManifoldCapacity& capacity);

  /// Queues the making of manifolds behind what `stream` holds, the query among it; it may be captured into a
  /// graph. The arrays must stay until it is done. instances, pairs: those of the query. query: one whose
  /// contacts are grouped. Result: kOk, kCudaFailed, or kOutOfGpuMemory, where CUDA loads a kernel at its
  /// first launch; what the GPU finds is in the report. Condition: set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
                 const GpuManifoldOptions& options, cudaStream_t stream);

  /// Makes manifolds of a query that has ended and is complete, and waits for them; where room was too small,
  /// makes room and starts again. Result: that of the report, or of a call that failed.
  Status make(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
              const GpuManifoldOptions& options, cudaStream_t stream);

  /// In GPU memory, in the order of ManifoldQuery where the pairs are in its order; report().manifolds and
  /// report().points of them.
  const Manifold* manifolds() const;
  const ManifoldPoint* points() const;
  const GpuManifoldReport* device_report() const;

  /// In CPU memory. Condition: the stream has come to the end of the call.
  const GpuManifoldReport& report() const;

  /// Queues that the next call finds no points before it.
  Status forget_points(cudaStream_t stream);

  GpuManifoldCapacity capacity() const;
  std::size_t bytes() const;  ///< GPU memory held, at most most_manifold_bytes()
  cudaError_t cuda_error() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
