#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/tolerance_query.h"

namespace tandem {

/// The number of each that a query has room for, or needs room for.
struct GpuToleranceCapacity {
  std::uint32_t instances = 0;
  std::uint32_t pairs = 0;
  std::uint64_t undecided = 0;  ///< candidates that are not decided quickly
};

/// The options with which it asks a contact query.
inline constexpr GpuContactOptions kToleranceOptions = {.first_contact_only = true, .add_error_bounds = true};

/// GPU memory that a query of so many levels of assets, all together, with room for so much holds at most:
/// the bound of GpuToleranceQuery::bytes(), where it was never given more of them.
constexpr std::size_t most_tolerance_bytes(const GpuToleranceCapacity& capacity, std::size_t levels) {
  constexpr std::size_t kFixed = 4096;
  return kFixed +
         most_query_bytes({capacity.pairs, capacity.pairs, capacity.undecided}, kToleranceOptions, levels) +
         (sizeof(GpuAsset) + 8) * levels + 8 * std::size_t{capacity.instances} +
         3 * std::size_t{capacity.pairs};
}

/// The outcome of a query.
struct GpuToleranceReport {
  Status status;                ///< kOk, or what decide() of ToleranceQuery names; then no verdicts
  std::uint32_t complete;       ///< 0 where something did not fit, see `needed`; then verdicts mean nothing
  std::uint64_t where;          ///< the instance or pair that caused an error
  GpuToleranceCapacity needed;  ///< a lower bound; exact for what follows from things that did fit
  std::uint64_t world_pairs;    ///< object pairs beyond float32, which are walked by world boxes, slowly
  ToleranceCounters counters;
};

extern template class GpuQuestion<GpuToleranceCapacity, GpuToleranceReport>;
extern template class GpuAssetQuestion<GpuToleranceCapacity, GpuToleranceReport>;

/// Tells of pairs of bodies with levels of detail whether they surely do not meet, surely meet, or are within
/// a tolerance, on the GPU: the verdicts of ToleranceQuery, at the same levels, which the GPU chooses. See
/// GpuQuestion.
///
/// set_assets() takes the levels of the assets, asset by asset, from the finest level on. A level whose
/// tree.number is 0 begins an asset; instances name assets by their order. Levels need oriented blocks. It
/// also returns kNoFinestLevel (a level is not the one behind the level before it, or the first is no finest
/// one) and kOutOfRange (an asset of more than kMaxLevels). bytes() is at most most_tolerance_bytes().
class GpuToleranceQuery : public GpuAssetQuestion<GpuToleranceCapacity, GpuToleranceReport> {
 public:
  /// Queues a query behind what `stream` holds. Pairs may be in either order of a and b; an instance touches
  /// itself. tolerance: as of ToleranceOptions. Result: also kBadTolerance, or kOutOfRange (more instances
  /// than reserved for). Condition: set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, double tolerance, cudaStream_t stream);

  /// Comes to all verdicts, and waits for them.
  Status decide(const GpuInstances& instances, const GpuPairs& pairs, double tolerance, cudaStream_t stream);

  const PairVerdict* verdicts() const;  ///< one for each pair
};

}  // namespace tandem
