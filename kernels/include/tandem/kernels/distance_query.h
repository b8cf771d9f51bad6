#pragma once
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/detail/interval.h"

namespace tandem {

/// The distance of the surfaces of an object pair, and where it is.
struct ObjectDistance {
  double lower, upper;                   ///< lower <= distance <= upper; 0, 0 exactly where triangles meet
  double point_a[3], point_b[3];         ///< the nearest points that were found, rounded to float64
  std::uint32_t triangle_a, triangle_b;  ///< that they are on, in leaf order; kNoIndex: beyond reach
  std::uint32_t face_a, face_b;          ///< the faces of the source files that these come from

  friend bool operator==(const ObjectDistance&, const ObjectDistance&) = default;
};

/// Triangles of a pair of instances that were nearest a step ago.
struct FormerNearest {
  std::uint32_t a, b;
  std::uint32_t triangle_a, triangle_b;
};

struct DistanceOptions {
  DistanceTolerance tolerance = {};
  /// Pairs that are surely farther apart than this have no nearest points: lower >= reach, upper is infinite.
  double reach = std::numeric_limits<double>::infinity();
  std::uint32_t threads = 1;  ///< with the caller's, kMostQueryThreads at most; results don't depend on it
  /// Where the query finds the pairs: those that it looks at; null: all. It must stay as long as the call.
  const PairFilter* filter = nullptr;
  /// By ascending a, then b: where to begin to look. Those of pairs or triangles that there are not are
  /// passed over. Results are as certified as without, and come sooner.
  std::span<const FormerNearest> former = {};
};

/// What a query did. The counters depend neither on the number of threads nor on the machine.
struct DistanceCounters {
  std::uint64_t object_pairs = 0;
  std::uint64_t block_pairs = 0;  ///< 16 bounds of boxes each
  std::uint64_t by_float32 = 0;   ///< triangle pairs that float32 bounded
  std::uint64_t by_float64 = 0;   ///< of these, and of former ones: how many float64 bounded
  std::uint64_t touching = 0;     ///< object pairs at distance 0

  friend bool operator==(const DistanceCounters&, const DistanceCounters&) = default;
};

/// Finds how near the surfaces of posed instances are, on the CPU. The geometry is that of ContactQuery: the
/// posed vertices in float64. Keeps its memory from call to call. Throws nothing. Movable, not copyable; one
/// call at a time, several objects side by side. Takes about 100 KB of the stack of each thread.
class DistanceQuery {
 public:
  DistanceQuery();
  DistanceQuery(DistanceQuery&&) noexcept;
  DistanceQuery& operator=(DistanceQuery&&) noexcept;
  ~DistanceQuery();

  /// Names the assets that instances refer to. Queries use level 0 of each; what the views point to must
  /// outlive the queries. Result: kOk; kUnknownAsset, where a view points to nothing and where() is its place
  /// in the list; or kOutOfMemory. After an error there are no assets.
  Status set_assets(std::span<const AssetView> assets);

  /// Finds the object pairs whose world boxes are within reach of each other, or a little beyond, and their
  /// distances. Result: kOk; kUnknownAsset, kPoseNotRigid or kOutOfRange (beyond kLargestWorldCoordinate, or
  /// a tolerance or reach that is negative or NaN), where where() is the instance; kUnknownInstance, where
  /// where() is the filter's excluded pair; kTooManyInstances, kTooManyPairs, kOutOfMemory or
  /// kCannotStartThread. After an error there are no pairs and no distances.
  Status find_distances(std::span<const Instance> instances, const DistanceOptions& options = {});

  /// Finds the distances of the given object pairs, in either order of a and b; an instance is at distance 0
  /// from itself. The filter is not asked. Result: as above, or kUnknownInstance: where() is the pair.
  Status find_distances(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                        const DistanceOptions& options);

  /// The object pairs of the last call: a < b, sorted, where the query found them; as given else.
  std::span<const ObjectPair> pairs() const;

  /// One for each pair. Valid until the next call.
  std::span<const ObjectDistance> distances() const;

  const DistanceCounters& counters() const;

  /// The instance or pair that is to blame for an error.
  std::uint64_t where() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
