#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/impact_query.h"

namespace tandem {

struct GpuImpactOptions {
  /// How near triangles come before they stop a pair: a part of the diagonal of the smaller body's bounds.
  double tolerance = 1e-6;
  /// Pairs that the query finds are sorted by a, then b; without it their order may differ from run to run.
  bool sorted = false;
  /// Where the query finds the pairs: those that it looks at. Its arrays lie in GPU memory.
  PairFilter filter = {};
  /// As of GpuContactOptions, for the walks that look for contacts.
  std::uint32_t most_blocks = 0;
};

/// How many of each a query has room for, or needs room for.
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
  return (std::size_t{9} << 20) + sizeof(GpuAsset) * assets + 264 * std::size_t{capacity.instances} +
         240 * std::size_t{capacity.pairs} + 168 * samples + 656 * std::size_t{capacity.parts} +
         48 * std::size_t{capacity.block_pairs} + 56 * std::size_t{capacity.triangle_pairs} +
         most_query_bytes({capacity.pairs, capacity.contacts, capacity.undecided}, {}, assets) +
         most_broad_phase_bytes({capacity.instances, capacity.pairs}, sorted);
}

/// The outcome of a query. It lies in GPU memory, and in CPU memory once the stream has come to the query's
/// end.
struct GpuImpactReport {
  Status status;             ///< kOk, or what ImpactQuery::find() names; then there are no impacts
  std::uint32_t complete;    ///< 0 where something did not fit; then there are no impacts, see `needed`
  std::uint64_t where;       ///< the instance or pair that caused an error
  GpuImpactCapacity needed;  ///< a lower bound; exact for what follows from things that did fit
  std::uint32_t impacts;     ///< one for each object pair
  std::uint32_t rounds;      ///< of block pairs that had some
  ImpactCounters counters;   ///< walks: pieces of pairs. Not those of the CPU, but the same on every run
};

/// Finds until when moving instances surely do not meet, on the GPU: an Impact for each object pair with the
/// guarantee of ImpactQuery, but not its bytes; the same bytes on every run on one kind of GPU. enqueue()
/// neither waits for the GPU nor allocates. Throws nothing. Movable, not copyable. An object runs one query
/// at a time: enqueue the next on the same stream, or when the last has ended.
///
/// A contact at the start is that of the least triangle of a, then of b. `gap` is an upper bound, above the
/// gap by 2^-45 of where the triangles lie relative to each other at most.
class GpuImpactQuery {
 public:
  GpuImpactQuery();
  GpuImpactQuery(GpuImpactQuery&&) noexcept;
  GpuImpactQuery& operator=(GpuImpactQuery&&) noexcept;
  ~GpuImpactQuery();  ///< waits for the device

  /// Names the assets that instances refer to, on the current device, after what `stream` holds: copies the
  /// list, and returns when that is done. What the trees point to must outlive the queries. Result: as of
  /// GpuContactQuery::set_assets(); kNoOrientedBlocks or kNoAxisAlignedBlocks, where an asset lacks one of
  /// both.
  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream);

  /// Makes room for at least so much, waiting for the device where it grows. `options`: those of the calls to
  /// come. Result: as of GpuContactQuery::reserve() and GpuBroadPhase::reserve(); kOutOfRange also for 2^25
  /// parts or more. Condition: set_assets().
  Status reserve(const GpuImpactCapacity& capacity, const GpuImpactOptions& options = {});

  /// Queues a query behind what `stream` holds; it may be captured into a graph. Finds the object pairs whose
  /// boxes, swept by their motions of a step of `duration` seconds, meet, and when each of them does.
  /// motion: of each instance, in GPU memory. The arrays must stay until it is done. Result: kOk;
  /// kOutOfRange, where the duration or the tolerance is negative or not finite, or there are more instances
  /// than reserved for; kUnknownInstance, kCudaFailed, kOutOfGpuMemory, as of GpuBroadPhase::enqueue(); what
  /// the GPU finds wrong is in the report. Condition: set_assets() and reserve() with these options.
  Status enqueue(const GpuInstances& instances, const RigidMotion* motion, double duration,
                 const GpuImpactOptions& options, cudaStream_t stream);

  /// The same of given object pairs, in either order of a and b; the filter is not asked. An instance and
  /// itself do not move relative to each other.
  Status enqueue(const GpuInstances& instances, const RigidMotion* motion, double duration,
                 const GpuPairs& pairs, const GpuImpactOptions& options, cudaStream_t stream);

  /// Enqueues a query and waits for it; where room was too small, makes room and starts again until the query
  /// is complete: in a steady state once. Result: that of the report, or of a call that failed; kOutOfRange
  /// where pairs.capacity itself was too small.
  Status find(const GpuInstances& instances, const RigidMotion* motion, double duration,
              const GpuImpactOptions& options, cudaStream_t stream);
  Status find(const GpuInstances& instances, const RigidMotion* motion, double duration,
              const GpuPairs& pairs, const GpuImpactOptions& options, cudaStream_t stream);

  /// The object pairs that the query found, in GPU memory. Valid until reserve().
  GpuPairs pairs() const;

  /// When each of them, or of the given ones, meets, in GPU memory: report().impacts of them.
  const Impact* impacts() const;

  const GpuImpactReport* device_report() const;

  /// In CPU memory. Condition: the stream has come to the end of the query.
  const GpuImpactReport& report() const;

  GpuImpactCapacity capacity() const;
  std::size_t bytes() const;  ///< GPU memory held, at most most_impact_bytes()
  cudaError_t cuda_error() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
