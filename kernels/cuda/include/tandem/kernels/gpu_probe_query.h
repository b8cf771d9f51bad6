#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>

#include "tandem/kernels/closest_query.h"
#include "tandem/kernels/gpu_question.h"
#include "tandem/kernels/ray_query.h"

namespace tandem {

/// Asks for the closest points of the bodies' surfaces.
struct GpuClosestOptions {
  using Row = ClosestPoint;
  const double* points = nullptr;  ///< in GPU memory: x, y and z of each
  std::uint32_t point_count = 0;
  DistanceTolerance tolerance = {};
  double reach = std::numeric_limits<double>::infinity();  ///< as of ClosestOptions
  bool sides = false;                                      ///< as of ClosestOptions
  /// In GPU memory, for each instance: 0 where it is passed over, whatever its asset and pose. Null: all are
  /// looked at.
  const std::uint8_t* looked_at = nullptr;
};

/// Asks where rays meet the bodies.
struct GpuRayOptions {
  using Row = RayHit;
  const double* origins = nullptr;     ///< in GPU memory: x, y and z of each
  const double* directions = nullptr;  ///< likewise
  std::uint32_t ray_count = 0;
  double reach = std::numeric_limits<double>::infinity();  ///< the greatest parameter that counts
  RayHits hits = RayHits::first;
  const std::uint8_t* looked_at = nullptr;  ///< as of GpuClosestOptions
};

/// The number of each that a query has room for, or needs room for.
struct GpuProbeCapacity {
  std::uint32_t instances = 0;
  std::uint32_t probes = 0;  ///< points or rays
  std::uint32_t hits = 0;    ///< where all hits are asked for: rows, and those that float64 gives up again
  /// 32-bit words of a coordinate in exact arithmetic, which decides what float64 leaves. 8 are always there;
  /// more (kMaxWords at most) need 24 KB of stack for each thread that the GPU holds.
  std::uint32_t words = 0;
};

/// Counts what the GPU's own walk did.
struct GpuProbeCounters {
  std::uint64_t probes, hits, blocks, by_float64;

  operator ClosestCounters() const { return {probes, blocks, by_float64}; }
  operator RayCounters() const { return {probes, hits, blocks, by_float64}; }
};

/// The outcome of a query.
struct GpuProbeReport {
  Status status;           ///< kOk, or what a scene, ClosestQuery or RayQuery names; then no rows
  std::uint32_t complete;  ///< 0 where something did not fit, see `needed`; then rows mean nothing
  std::uint64_t where;     ///< the instance, point or ray that caused an error
  GpuProbeCapacity needed;
  std::uint32_t rows;
  std::uint32_t exact;  ///< probes that float64 did not decide
  GpuProbeCounters counters;
};

extern template class GpuQuestion<GpuProbeCapacity, GpuProbeReport>;
extern template class GpuAssetQuestion<GpuProbeCapacity, GpuProbeReport>;

/// Asks posed instances about points and rays ("probes") on the GPU. See GpuQuestion. Assets need
/// axis-aligned blocks.
///
/// - Points: the rows of ClosestQuery, as certified, 0, 0 for the same points, and the same sides; but not
///   the same bytes, and of triangles that the tolerance does not tell apart maybe another. They have the
///   same bytes on every run of one kind of GPU.
/// - Rays: the rows of RayQuery, byte for byte, but that of any hit another may be named. They are the same
///   on every run.
class GpuProbeQuery : public GpuAssetQuestion<GpuProbeCapacity, GpuProbeReport> {
 public:
  /// Queues a question behind what `stream` holds. Result: also kBadTolerance or kBadReach, where it is
  /// negative or NaN; kNoTopology, where sides are asked for and some asset has none; kBadOption, where
  /// `hits` names no choice; kOutOfRange, where there are more instances or probes than room. Condition:
  /// set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuClosestOptions& options, cudaStream_t stream);
  Status enqueue(const GpuInstances& instances, const GpuRayOptions& options, cudaStream_t stream);

  /// Finds all rows, and waits for them. Result: also kTooManyPairs, where there are 2^32 - 1 hits or more.
  Status find(const GpuInstances& instances, const GpuClosestOptions& options, cudaStream_t stream);
  Status find(const GpuInstances& instances, const GpuRayOptions& options, cudaStream_t stream);

  /// The rows of the last call, report().rows of them: one for each point.
  const ClosestPoint* closest() const;
  /// The rows of the last call, report().rows of them: one for each ray, or all hits.
  const RayHit* hits() const;
};

}  // namespace tandem
