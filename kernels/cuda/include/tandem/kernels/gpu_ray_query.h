#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>

#include "tandem/kernels/gpu_question.h"
#include "tandem/kernels/ray_query.h"

namespace tandem {

struct GpuRayOptions {
  const double* origins = nullptr;     ///< in GPU memory: x, y and z of each
  const double* directions = nullptr;  ///< likewise
  std::uint32_t ray_count = 0;
  double reach = std::numeric_limits<double>::infinity();  ///< the greatest parameter that counts
  RayHits hits = RayHits::first;
  /// In GPU memory, for each instance: 0 where it is passed over, whatever its asset and pose. Null: all are
  /// looked at.
  const std::uint8_t* looked_at = nullptr;
};

/// The number of each that a query has room for, or needs room for.
struct GpuRayCapacity {
  std::uint32_t instances = 0, rays = 0;
  std::uint32_t hits = 0;   ///< where all are asked for: rows, and those that float64 gives up again
  std::uint32_t words = 0;  ///< as of GpuClosestCapacity
};

/// The outcome of a query.
struct GpuRayReport {
  Status status;           ///< kOk, or what a scene or RayQuery names; then no rows
  std::uint32_t complete;  ///< 0 where something did not fit, see `needed`; then rows mean nothing
  std::uint64_t where;     ///< the instance or ray that caused an error
  GpuRayCapacity needed;   ///< a lower bound; exact for what follows from things that did fit
  std::uint32_t rows;
  std::uint32_t exact;   ///< rays that float64 did not decide
  RayCounters counters;  ///< of the GPU's own walk
};

extern template class GpuQuestion<GpuRayCapacity, GpuRayReport>;
extern template class GpuAssetQuestion<GpuRayCapacity, GpuRayReport>;

/// Finds where rays meet posed instances on the GPU: the rows of RayQuery, byte for byte, but that of any hit
/// another may be named. The same bytes on every run. See GpuQuestion. Assets need axis-aligned blocks.
class GpuRayQuery : public GpuAssetQuestion<GpuRayCapacity, GpuRayReport> {
 public:
  /// Queues a query behind what `stream` holds. Result: also kBadReach, where it is negative or NaN;
  /// kBadOption, where `hits` names no choice; kOutOfRange, where there are more instances or rays than room.
  /// Condition: set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuRayOptions& options, cudaStream_t stream);

  /// Finds all rows, and waits for them. Result: also kTooManyPairs, where there are 2^32 - 1 hits or more.
  Status find(const GpuInstances& instances, const GpuRayOptions& options, cudaStream_t stream);

  const RayHit* rows() const;  ///< one for each ray, or where all hits are asked for report().rows
};

}  // namespace tandem
