#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>

#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/gpu_question.h"

namespace tandem {

struct GpuDistanceOptions {
  DistanceTolerance tolerance = {};
  /// Pairs that are surely farther apart than this have no nearest points: lower >= reach, upper is infinite.
  double reach = std::numeric_limits<double>::infinity();
  /// One for each pair instead, in GPU memory, or null. A pair whose reach is negative or NaN is an error of
  /// the report: kBadReach.
  const double* reach_of_pair = nullptr;
  /// The distance of each pair a step ago, in GPU memory, or null; distances() of this query will do. The
  /// walk of a pair begins with the triangles that were nearest, or with none where they are kNoIndex.
  /// Results are as certified as without. Triangles that do not exist are passed over.
  const ObjectDistance* former = nullptr;
};

/// The number of each that a query has room for, or needs room for.
struct GpuDistanceCapacity {
  std::uint32_t pairs = 0;           ///< object pairs
  std::uint32_t block_pairs = 0;     ///< that one round of the walk has
  std::uint32_t triangle_pairs = 0;  ///< that boxes and the direction of the nearest leave
  std::uint32_t settled = 0;         ///< of these, besides the first of each object pair: bounded by float64
  /// 32-bit words of a coordinate in exact arithmetic. What float64 leaves too wide needs 2 or 3, as a rule,
  /// and at most kMaxWords. Up to kFewWords, CUDA keeps 4.5 KB of stack for each thread that the GPU holds,
  /// and 24 KB beyond.
  std::uint32_t words = 0;
};

inline constexpr std::uint32_t kFewWords = 8;

/// GPU memory that a query of so many assets with room for so much holds at most: the bound of
/// GpuDistanceQuery::bytes(), where it was never given more of them.
constexpr std::size_t most_distance_bytes(const GpuDistanceCapacity& capacity, std::size_t assets) {
  constexpr std::size_t kFixed = 4096;
  return kFixed + sizeof(GpuAsset) * assets + 788 * std::size_t{capacity.pairs} +
         32 * std::size_t{capacity.block_pairs} + 20 * std::size_t{capacity.triangle_pairs} +
         76 * std::size_t{capacity.settled};
}

/// The outcome of a query.
struct GpuDistanceReport {
  Status status;               ///< kOk, or what a scene or DistanceQuery names; then no distances
  std::uint32_t complete;      ///< 0 where something did not fit, see `needed`; then distances mean nothing
  std::uint64_t where;         ///< the instance or pair that caused an error
  GpuDistanceCapacity needed;  ///< a lower bound; exact for what follows from things that did fit
  std::uint64_t world_pairs;   ///< object pairs beyond float32, which are walked by world boxes, slowly
  std::uint32_t rounds;        ///< of the walk, that had anything to do
  DistanceCounters counters;
};

extern template class GpuQuestion<GpuDistanceCapacity, GpuDistanceReport>;
extern template class GpuAssetQuestion<GpuDistanceCapacity, GpuDistanceReport>;

/// Finds how near the surfaces of posed instances are, of many pairs or of few huge ones, on the GPU: the
/// distances of DistanceQuery, as certified, 0, 0 for the same pairs; not the same bytes, but the same bytes
/// on every run of one kind of GPU. See GpuQuestion. Assets need axis-aligned blocks. bytes() is at most
/// most_distance_bytes().
class GpuDistanceQuery : public GpuAssetQuestion<GpuDistanceCapacity, GpuDistanceReport> {
 public:
  /// Queues a query behind what `stream` holds. Pairs may be in either order of a and b; an instance is at
  /// distance 0 from itself. Result: also kBadTolerance or kBadReach, where it is negative or NaN.
  /// Condition: set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuDistanceOptions& options,
                 cudaStream_t stream);

  /// Finds all distances, and waits for them.
  Status find_distances(const GpuInstances& instances, const GpuPairs& pairs,
                        const GpuDistanceOptions& options, cudaStream_t stream);

  const ObjectDistance* distances() const;  ///< one for each pair
};

}  // namespace tandem
