#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/tolerance_query.h"

namespace tandem {

/// How many of each a query has room for, or needs room for.
struct GpuToleranceCapacity {
  std::uint32_t instances = 0;
  std::uint32_t pairs = 0;
  std::uint64_t undecided = 0;  ///< candidates that are not decided quickly
};

/// What it asks of a contact query.
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

/// The outcome of a query. It lies in GPU memory, and in CPU memory once the stream has come to the query's
/// end.
struct GpuToleranceReport {
  Status status;                ///< kOk, or what decide() of ToleranceQuery names; then no verdicts
  std::uint32_t complete;       ///< 0 where something did not fit, see `needed`; then verdicts mean nothing
  std::uint64_t where;          ///< the instance or pair that caused an error
  GpuToleranceCapacity needed;  ///< a lower bound; exact for what follows from things that did fit
  std::uint64_t world_pairs;    ///< object pairs beyond float32, which are walked by world boxes, slowly
  ToleranceCounters counters;
};

/// Tells of pairs of bodies with levels of detail whether they surely do not meet, surely meet, or are within
/// a tolerance, on the GPU: the verdicts of ToleranceQuery, at the same levels. enqueue() neither waits for
/// the GPU nor allocates: the GPU chooses the levels. Throws nothing. Movable, not copyable. An object runs
/// one query at a time: enqueue the next on the same stream, or when the last has ended. Several objects can
/// run side by side.
class GpuToleranceQuery {
 public:
  GpuToleranceQuery();
  GpuToleranceQuery(GpuToleranceQuery&&) noexcept;
  GpuToleranceQuery& operator=(GpuToleranceQuery&&) noexcept;
  ~GpuToleranceQuery();  ///< waits for the device

  /// Names the levels of the assets that instances refer to, on the current device, after what `stream`
  /// holds, and waits for it: asset by asset, from the finest level on. A level whose tree.number is 0 begins
  /// an asset; instances name assets by their order. What the trees point to must outlive the queries.
  /// Result: kOk; kNoFinestLevel (a level is not the one behind the level before it, or the first is no
  /// finest one); kNoOrientedBlocks (a level lacks them); kOutOfRange (an asset of more than kMaxLevels); or
  /// as of set_assets() of GpuContactQuery.
  Status set_levels(std::span<const GpuAsset> levels, cudaStream_t stream);

  /// Makes room for at least so much, waiting for the device where it grows. Result: kOk, kOutOfGpuMemory,
  /// kCudaFailed; after an error there is the room that there was, or none. Condition: set_levels().
  Status reserve(const GpuToleranceCapacity& capacity);

  /// Queues a query behind what `stream` holds; it may be captured into a graph. The arrays must stay until
  /// it is done. instances.asset: by order of the assets. Pairs may be in either order of a and b; an
  /// instance touches itself. tolerance: as of ToleranceOptions. Result: kOk, kOutOfRange (more instances
  /// than reserved for, a tolerance that is none), kCudaFailed, or, where CUDA loads a kernel at its first
  /// launch and the GPU is full, kOutOfGpuMemory; what the GPU finds wrong is in the report. Condition:
  /// set_levels() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, double tolerance, cudaStream_t stream);

  /// Enqueues a query and waits for it; where room was too small, makes room and starts again until the query
  /// is complete: in a steady state once. Result: that of the report, or of a call that failed; kOutOfRange
  /// where pairs.capacity itself was too small.
  Status decide(const GpuInstances& instances, const GpuPairs& pairs, double tolerance, cudaStream_t stream);

  /// In GPU memory: one for each pair. Valid until the next reserve().
  const PairVerdict* verdicts() const;
  const GpuToleranceReport* device_report() const;

  /// In CPU memory. Condition: the stream has come to the end of the query.
  const GpuToleranceReport& report() const;

  GpuToleranceCapacity capacity() const;
  std::size_t bytes() const;  ///< GPU memory held, at most most_tolerance_bytes()
  cudaError_t cuda_error() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
