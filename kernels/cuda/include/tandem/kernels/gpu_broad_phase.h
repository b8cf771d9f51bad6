#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "tandem/kernels/gpu_question.h"
#include "tandem/kernels/pair_filter.h"
#include "tandem/kernels/world_box.h"

namespace tandem {

struct GpuBroadPhaseOptions {
  /// Pairs are sorted by a, then b, as those of BroadPhase. Without it their order may differ from run to
  /// run; of many boxes, pairs that are neighbours in space come close to each other.
  bool sorted = false;

  /// Says which pairs are looked at. Its arrays lie in GPU memory and must stay until the call is done.
  /// enqueue() alone looks at it.
  PairFilter filter = {};

  /// Pairs of boxes that are so far apart are found too, as BroadPhase finds those of grown() boxes: each is
  /// larger by half of it, or by all of it where the other one is kept. Infinity: all pairs.
  double within = 0;
};

/// The number of boxes and of pairs that there is room for.
struct GpuBroadPhaseCapacity {
  std::uint32_t boxes = 0;  ///< or instances
  std::uint32_t pairs = 0;
  std::uint32_t instances = 0;  ///< whose boxes are to be computed; with `within` at least as many as `boxes`
  std::uint32_t kept = 0;  ///< or boxes, of which fixed ones are kept: keep_fixed() alone makes this room
};

/// GPU memory that a broad phase with room for so much holds at most: the bound of GpuBroadPhase::bytes().
constexpr std::size_t most_broad_phase_bytes(const GpuBroadPhaseCapacity& capacity, bool sorted) {
  constexpr std::size_t kFixed = std::size_t{1} << 20;
  return kFixed + 52 * std::size_t{capacity.boxes} + 48 * std::size_t{capacity.instances} +
         38 * std::size_t{capacity.kept} + (sorted ? 17 : 8) * std::size_t{capacity.pairs};
}

/// The outcome of a broad phase.
struct GpuBroadPhaseReport {
  Status status;           ///< kOk, or kOutOfRange, kUnknownAsset, kPoseNotRigid; then there are no pairs
  std::uint32_t complete;  ///< 0: there was no room for all pairs; those stored are some of them
  std::uint32_t where;     ///< the box or instance that caused an error; of several, the first
  std::uint32_t count;     ///< like `found`; 2^32 - 1 where there are as many or more
  std::uint64_t found;     ///< how many pairs there are, stored or not
};

extern template class GpuQuestion<GpuBroadPhaseCapacity, GpuBroadPhaseReport, GpuBroadPhaseOptions>;

/// Finds all pairs of world boxes that meet, or those of them that a filter looks at, on the GPU: the same
/// set as BroadPhase. See GpuQuestion.
///
/// Few boxes are tested each against each, by one kernel that poses them too. Many are sorted by world where
/// there are several, by class of size, then along a space-filling curve, and grouped by 32 into a tree of
/// fan-out 32. One warp takes a group and walks the part of the tree that lies behind it, so a pair is found
/// once, by the smaller box: one huge box among many small ones costs each of them a test. O(n log n) for
/// boxes of bounded overlap. Boxes of fixed instances may be kept in a tree of their own, which a warp walks
/// for each of the others.
///
/// reserve() also returns kOutOfRange for 2^32 - 1 boxes, and what status_of() of gpu_status.h names: kNoGpu,
/// kDriverTooOld, kGpuNotSupported. Where it makes room for more instances, what was kept of them is lost,
/// and enqueue() returns kKeptMismatch until keep_fixed() is called again. bytes() is at most
/// most_broad_phase_bytes().
class GpuBroadPhase : public GpuQuestion<GpuBroadPhaseCapacity, GpuBroadPhaseReport, GpuBroadPhaseOptions> {
 public:
  /// Keeps the boxes, or instances, whose motion is fixed as they are: calls of enqueue() to come, which must
  /// be of as many, find no pair of two of them and take the time of the others. Given boxes must go on lying
  /// in the array that enqueue() gets; assets and poses of kept instances are not looked at again. Call it
  /// again when one of them has moved or others are fixed; nothing is kept where none is fixed. Makes room
  /// for all that and waits for the stream: it is no part of a step, and graphs that were captured before it
  /// must be captured anew. motion: of each, in CPU memory; world: of each, in GPU memory, or null where the
  /// filters have none. Where a filter of a call to come has motions or worlds, it says the same of what is
  /// kept. Result: as of reserve(); kMisaligned; kKeptMismatch where the sizes
  /// differ; or kOutOfRange, kUnknownAsset, kPoseNotRigid, where report().where is the fixed one to blame.
  /// After an error nothing is kept.
  Status keep_fixed(const WorldBox* boxes, std::span<const Motion> motion, const std::uint32_t* world,
                    cudaStream_t stream);
  Status keep_fixed(const GpuInstances& instances, const GpuAssetBounds& assets,
                    std::span<const Motion> motion, const std::uint32_t* world, cudaStream_t stream);

  /// Queues a broad phase of the boxes behind what `stream` holds. They lie in GPU memory at a multiple of 16
  /// bytes. Result: also kMisaligned, kOutOfRange (more than reserved for), kBadReach (`within` negative or
  /// NaN), kUnknownInstance (the filter excludes a pair of boxes that there are not), kKeptMismatch (fixed
  /// ones are kept of another number of boxes, or of instances). The report's status may be kOutOfRange: a
  /// coordinate that is NaN or beyond kLargestWorldCoordinate. Condition: reserve() with these options.
  Status enqueue(const WorldBox* boxes, std::uint32_t count, const GpuBroadPhaseOptions& options,
                 cudaStream_t stream);

  /// Computes the instances' world boxes first; they have the same bits as those of ContactQuery. The
  /// report's status may be kUnknownAsset or kPoseNotRigid too.
  Status enqueue(const GpuInstances& instances, const GpuAssetBounds& assets,
                 const GpuBroadPhaseOptions& options, cudaStream_t stream);

  /// Finds all pairs, and waits for them. Where there was too little room, it makes room for a quarter more
  /// than needed and starts again: at most twice. Result: also kTooManyPairs where there are 2^32 - 1 or
  /// more.
  Status find_pairs(const WorldBox* boxes, std::uint32_t count, const GpuBroadPhaseOptions& options,
                    cudaStream_t stream);
  Status find_pairs(const GpuInstances& instances, const GpuAssetBounds& assets,
                    const GpuBroadPhaseOptions& options, cudaStream_t stream);

  /// Pairs, a < b, and their number, in GPU memory; complete where the number is at most the capacity.
  /// Condition: reserve() returned kOk.
  GpuPairs pairs() const;

  /// The world boxes that enqueue() and keep_fixed() computed of instances; with `within`, those of enqueue()
  /// are the larger ones.
  const WorldBox* boxes() const;
};

}  // namespace tandem
