#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "tandem/kernels/detail/interval.h"
#include "tandem/kernels/detail/question.h"

namespace tandem {

/// The closest point of the bodies of a scene.
struct ClosestPoint {
  double lower, upper;     ///< lower <= distance <= upper; 0, 0 exactly where the point is on a triangle
  double position[3];      ///< the closest point that was found, rounded to float64
  std::uint32_t body;      ///< that it is on; kNoIndex: all are beyond reach
  std::uint32_t triangle;  ///< in leaf order
  std::uint32_t face;      ///< of the source file, that the triangle comes from
  std::uint32_t within;    ///< the lowest body that the point is inside of; kNoIndex: none, or not asked
  std::int32_t winding;  ///< how often the closed surfaces of all bodies wind around the point; 0: not asked
  std::uint32_t reserved;  ///< 0

  friend bool operator==(const ClosestPoint&, const ClosestPoint&) = default;
};

struct ClosestOptions {
  std::span<const std::array<double, 3>> points;  ///< in the world
  /// If there are any, each point is asked about each of these bodies alone, and not about all together:
  /// rows() ascend by point, then by the place of the body in this list.
  std::span<const std::uint32_t> bodies = {};
  DistanceTolerance tolerance = {};
  /// Points that are surely farther away than this have no closest point: lower >= reach, upper is infinite.
  double reach = std::numeric_limits<double>::infinity();
  /// Whether `within` and `winding` are asked for. An odd number of a body's closed surfaces is around a
  /// point inside of it, as ContainmentQuery has it. A surface winds around what is inside of it once, or -1
  /// times where it is inside out: triangles count as topology.h turns them. A point on a surface is inside
  /// or not as a point is that lies beside it by infinitely little along y, and by infinitely less along z.
  bool sides = false;
};

/// Counts what a question did. The counters depend neither on the number of threads nor on the machine.
struct ClosestCounters {
  std::uint64_t points = 0;
  std::uint64_t blocks = 0;      ///< four boxes or four triangles each
  std::uint64_t by_float64 = 0;  ///< triangles that float64 bounded

  friend bool operator==(const ClosestCounters&, const ClosestCounters&) = default;
};

/// Finds the closest points of the bodies' surfaces, a row for each point in the order of the points, or for
/// each point and each body that the options name. The
/// geometry is that of ContactQuery: the posed vertices in float64. The distance is certified: exact
/// arithmetic cannot refute the interval, which is as narrow as the tolerance asks for. Of triangles whose
/// distances the tolerance does not tell apart, it is unspecified which is named. The filter is not asked,
/// and pairs() are none.
class ClosestQuery : public Answer<ClosestPoint, ClosestCounters> {
 public:
  using Options = ClosestOptions;

  /// Result: kOk; kOutOfRange, where where() of the scene is the first point that has a coordinate which is
  /// NaN or beyond kLargestWorldCoordinate; kBadTolerance or kBadReach where a tolerance or the reach is
  /// negative or NaN; kBadOption where there are 2^32 - 1 rows or more; kUnknownInstance, where where() is
  /// the place in `bodies` of one that does not exist; kNoTopology, where sides are asked for and where() is
  /// an asset whose file has none; kOutOfMemory or kCannotStartThread.
  Status find(Scene& scene, const ClosestOptions& options);

 private:
  struct State;
  Status answer(SceneState& scene, const ClosestOptions& options);

  Kept<State> state_;
};

}  // namespace tandem
