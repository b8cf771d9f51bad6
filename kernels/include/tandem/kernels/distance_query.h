#pragma once
#include <cstdint>
#include <limits>
#include <span>

#include "tandem/kernels/detail/interval.h"
#include "tandem/kernels/detail/question.h"

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
  /// One for each pair instead, or none, else kBadOption. The scene finds pairs by `reach`.
  std::span<const double> reach_of_pair = {};
  /// The nearest triangles of a former step, with which the search of a pair begins, by ascending a, then b.
  /// Pairs and triangles that do not exist are passed over. Results are as certified as without, and come
  /// sooner.
  std::span<const FormerNearest> former = {};
};

/// Counts what a query did. The counters depend neither on the number of threads nor on the machine.
struct DistanceCounters {
  std::uint64_t object_pairs = 0;
  std::uint64_t block_pairs = 0;  ///< 16 bounds of boxes each
  std::uint64_t by_float32 = 0;   ///< triangle pairs that float32 bounded
  std::uint64_t by_float64 = 0;   ///< of these, and of former ones: how many float64 bounded
  std::uint64_t touching = 0;     ///< object pairs at distance 0

  friend bool operator==(const DistanceCounters&, const DistanceCounters&) = default;
};

/// Finds how near the surfaces of two bodies are. The geometry is that of ContactQuery: the posed vertices in
/// float64. The scene finds the object pairs whose world boxes are within reach of each other, or a little
/// beyond. There is one row for each pair; an instance has distance 0 to itself. find() takes about 100 KB of
/// the stack of each thread. Result of find(): as of ContactQuery; kBadTolerance or kBadReach where a
/// tolerance or a reach is negative or NaN; kBadOption. Where a pair's own reach is bad, where() of the scene
/// is the pair.
class DistanceQuery : public PairQuestion<DistanceQuery, ObjectDistance, DistanceCounters, DistanceOptions> {
 private:
  friend PairQuestion;
  struct State;
  Status answer(SceneState& scene, const std::span<const ObjectPair>* given, const DistanceOptions& options);
  Status check_reaches(SceneState& scene, std::span<const double> of_pair) const;

  Kept<State> state_;
};

}  // namespace tandem
