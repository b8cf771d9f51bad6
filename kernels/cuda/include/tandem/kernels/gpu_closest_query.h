#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>

#include "tandem/kernels/closest_query.h"
#include "tandem/kernels/gpu_question.h"

namespace tandem {

struct GpuClosestOptions {
  const double* points = nullptr;  ///< in GPU memory: x, y and z of each
  std::uint32_t point_count = 0;
  DistanceTolerance tolerance = {};
  double reach = std::numeric_limits<double>::infinity();  ///< as of ClosestOptions
  bool sides = false;                                      ///< as of ClosestOptions
  /// In GPU memory, for each instance: 0 where it is passed over, whatever its asset and pose. Null: all are
  /// looked at.
  const std::uint8_t* looked_at = nullptr;
};

/// The number of each that a query has room for, or needs room for.
struct GpuClosestCapacity {
  std::uint32_t instances = 0, points = 0;
  /// 32-bit words of a coordinate in exact arithmetic, which decides what float64 leaves. 8 are always there;
  /// more (kMaxWords at most) need 24 KB of stack for each thread that the GPU holds.
  std::uint32_t words = 0;
};

/// The outcome of a query.
struct GpuClosestReport {
  Status status;           ///< kOk, or what a scene or ClosestQuery names; then no rows
  std::uint32_t complete;  ///< 0 where something did not fit, see `needed`; then rows mean nothing
  std::uint64_t where;     ///< the instance, point or asset that caused an error
  GpuClosestCapacity needed;
  std::uint32_t exact;       ///< points that float64 did not decide
  ClosestCounters counters;  ///< of the GPU's own walk
};

extern template class GpuQuestion<GpuClosestCapacity, GpuClosestReport>;
extern template class GpuAssetQuestion<GpuClosestCapacity, GpuClosestReport>;

/// Finds the closest points of the surfaces of posed instances on the GPU: the rows of ClosestQuery, as
/// certified, 0, 0 for the same points, and the same sides; but not the same bytes, and of triangles that the
/// tolerance does not tell apart maybe another. The same bytes on every run of one kind of GPU. See
/// GpuQuestion. Assets need axis-aligned blocks.
class GpuClosestQuery : public GpuAssetQuestion<GpuClosestCapacity, GpuClosestReport> {
 public:
  /// Queues a query behind what `stream` holds. Result: also kBadTolerance or kBadReach, where it is negative
  /// or NaN; kNoTopology, where sides are asked for and some asset has none; kOutOfRange, where there are
  /// more instances or points than room. Condition: set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuClosestOptions& options, cudaStream_t stream);

  /// Finds all closest points, and waits for them.
  Status find(const GpuInstances& instances, const GpuClosestOptions& options, cudaStream_t stream);

  const ClosestPoint* rows() const;  ///< one for each point
};

}  // namespace tandem
