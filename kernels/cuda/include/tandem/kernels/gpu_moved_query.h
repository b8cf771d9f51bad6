#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/kernels/gpu_question.h"
#include "tandem/kernels/moved_query.h"

namespace tandem {

struct AssetBox;

struct GpuMovedOptions {
  double tolerance = 0;  ///< see MovedOptions
  /// One for each pair instead, in GPU memory, or null. A pair whose tolerance is negative or NaN has moved.
  const double* tolerance_of_pair = nullptr;
};

/// The number of each that there is room for, or that needs room.
struct GpuMovedCapacity {
  std::uint32_t pairs = 0;
};

/// GPU memory that an object with room for so much, of so many assets, holds at most.
constexpr std::size_t most_moved_bytes(const GpuMovedCapacity& capacity, std::size_t assets) {
  constexpr std::size_t kFixed = 4096;
  return kFixed + 128 * assets + 500 * std::size_t{capacity.pairs};
}

/// The number of a call, as MovedQuery has it.
struct GpuMovedCall {
  std::uint64_t call, call_before;
  std::uint32_t kept;  ///< pairs
};

/// The outcome of a call.
struct GpuMovedReport {
  Status status;
  std::uint32_t complete;  ///< 0 where there was no room for all pairs; then none is kept, nor counted
  GpuMovedCapacity needed;
  MovedCounters counters;
};

/// What was found, in GPU memory. Owns nothing; it is valid until the next reserve().
struct GpuMoved {
  GpuPairs pairs;  ///< that the call was about
  GpuPairs moved;  ///< that have moved, in the same order; *moved.count is more than there is room for where
                   ///< the call is not complete
  const std::uint32_t* kept_rows;     ///< as of MovedQuery
  const std::uint32_t* moved_rows;    ///< of each pair that has moved: its row of `moved`
  const std::uint32_t* row_of_moved;  ///< of each row of `moved`: its row of `pairs`
  const PosedBodies* posed;           ///< as of MovedQuery
  const AssetBox* boxes;              ///< of the assets
  const GpuMovedCall* call;
};

extern template class GpuQuestion<GpuMovedCapacity, GpuMovedReport>;
extern template class GpuAssetQuestion<GpuMovedCapacity, GpuMovedReport>;

/// Finds the object pairs that have moved, on the GPU: what MovedQuery finds. See GpuQuestion.
///
/// Assets are the list that instances refer to; set_assets() forgets the last call, reserve() does not.
/// bytes() is at most most_moved_bytes().
class GpuMovedQuery : public GpuAssetQuestion<GpuMovedCapacity, GpuMovedReport> {
 public:
  /// Queues the search behind what `stream` holds. Result: also kBadTolerance. Condition: set_assets() and
  /// reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuMovedOptions& options,
                 cudaStream_t stream);

  /// Searches, and waits for it. Result: also kOutOfRange where the pairs had no room in their array.
  Status find(const GpuInstances& instances, const GpuPairs& pairs, const GpuMovedOptions& options,
              cudaStream_t stream);

  /// Returns what the last call finds, for questions queued behind it.
  GpuMoved moved() const;

  /// Queues that the next call keeps nothing.
  Status forget_poses(cudaStream_t stream);
};

}  // namespace tandem
