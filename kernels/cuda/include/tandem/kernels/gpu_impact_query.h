#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/impact_query.h"

namespace tandem {

struct GpuImpactOptions {
  /// Triangles that come this near stop a pair. It is a part of the diagonal of the smaller body's bounds.
  double tolerance = 1e-6;
  /// Pairs that the query finds are sorted by a, then b; without it their order may differ from run to run.
  bool sorted = false;
  /// If the query finds the pairs, the filter says which ones it looks at. Its arrays lie in GPU memory.
  PairFilter filter = {};
  /// The option of GpuContactOptions, for the walks that look for contacts.
  std::uint32_t most_blocks = 0;
};

/// The number of each that a query has room for, or needs room for.
struct GpuImpactCapacity {
  std::uint32_t instances = 0;
  std::uint32_t pairs = 0;
  std::uint64_t contacts = 0;        ///< at the start, all of them
  std::uint64_t undecided = 0;       ///< as of GpuContactCapacity
  std::uint32_t parts = 0;           ///< of the step, of all pairs: half radians of turn, and halves of them
  std::uint32_t block_pairs = 0;     ///< of a round
  std::uint32_t triangle_pairs = 0;  ///< whose boxes may meet
};

/// Poses of each object pair at which the GPU looks for contacts, to know where impacts need not be sought,
/// and the fewest of all pairs.
inline constexpr std::uint32_t kImpactSamplesPerPair = 2, kFewestImpactSamples = 1u << 14;

/// GPU memory that a query of so many assets with room for so much holds at most: the bound of
/// GpuImpactQuery::bytes(). sorted: whether any of its calls sorts pairs.
constexpr std::size_t most_impact_bytes(const GpuImpactCapacity& capacity, std::size_t assets, bool sorted) {
  const std::size_t samples = kImpactSamplesPerPair * std::size_t{capacity.pairs} + kFewestImpactSamples;
  return (std::size_t{9} << 20) + sizeof(GpuAsset) * assets + 272 * std::size_t{capacity.instances} +
         240 * std::size_t{capacity.pairs} + 168 * samples + 656 * std::size_t{capacity.parts} +
         48 * std::size_t{capacity.block_pairs} + 56 * std::size_t{capacity.triangle_pairs} +
         most_query_bytes({capacity.pairs, capacity.contacts, capacity.undecided}, {}, assets) +
         most_broad_phase_bytes({capacity.instances, capacity.pairs}, sorted);
}

/// The outcome of a query.
struct GpuImpactReport {
  Status status;             ///< kOk, or what a scene or ImpactQuery names; then no impacts
  std::uint32_t complete;    ///< 0 where something did not fit; then there are no impacts, see `needed`
  std::uint64_t where;       ///< the instance or pair that caused an error
  GpuImpactCapacity needed;  ///< a lower bound; exact for what follows from things that did fit
  std::uint32_t impacts;     ///< one for each object pair
  std::uint32_t rounds;      ///< of block pairs that had some
  ImpactCounters counters;   ///< walks: pieces of pairs. Not those of the CPU, but the same on every run
};

extern template class GpuQuestion<GpuImpactCapacity, GpuImpactReport, GpuImpactOptions>;
extern template class GpuAssetQuestion<GpuImpactCapacity, GpuImpactReport, GpuImpactOptions>;

/// Finds until when moving instances surely do not meet, on the GPU: an Impact for each object pair with the
/// guarantee of ImpactQuery, but not its bytes; the same bytes on every run on one kind of GPU. See
/// GpuQuestion.
///
/// A contact at the start is that of the least triangle of a, then of b. `gap` is an upper bound, above the
/// gap by 2^-45 of where the triangles lie relative to each other at most.
///
/// Assets need axis-aligned and oriented blocks. reserve() also returns kOutOfRange for 2^25 parts or more.
/// bytes() is at most most_impact_bytes().
class GpuImpactQuery : public GpuAssetQuestion<GpuImpactCapacity, GpuImpactReport, GpuImpactOptions> {
 public:
  /// Queues a query behind what `stream` holds. It finds the object pairs whose boxes, swept by their motions
  /// of a step of `duration` seconds, meet, and when each of them does. motion: of each instance, in GPU
  /// memory. Result: also kBadDuration or kBadTolerance, where it is negative or not finite; kOutOfRange
  /// where there are more instances than reserved for; kUnknownInstance as of GpuBroadPhase::enqueue().
  /// Condition: set_assets() and reserve() with these options.
  Status enqueue(const GpuInstances& instances, const RigidMotion* motion, double duration,
                 const GpuImpactOptions& options, cudaStream_t stream);

  /// Asks for given object pairs instead, in either order of a and b; the filter is not asked. An instance
  /// and itself do not move relative to each other.
  Status enqueue(const GpuInstances& instances, const RigidMotion* motion, double duration,
                 const GpuPairs& pairs, const GpuImpactOptions& options, cudaStream_t stream);

  /// Finds all impacts, of pairs that the query finds or of given ones, and waits for them.
  Status find(const GpuInstances& instances, const RigidMotion* motion, double duration,
              const GpuImpactOptions& options, cudaStream_t stream);
  Status find(const GpuInstances& instances, const RigidMotion* motion, double duration,
              const GpuPairs& pairs, const GpuImpactOptions& options, cudaStream_t stream);

  GpuPairs pairs() const;         ///< the object pairs that the query found
  const Impact* impacts() const;  ///< report().impacts of them: when each pair meets
};

}  // namespace tandem
