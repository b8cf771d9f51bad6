#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "tandem/kernels/detail/question.h"

namespace tandem {

/// A place where a ray meets a triangle of a body.
struct RayHit {
  double t;                ///< the parameter, within kRayTimeError of itself; infinite: there is no hit
  double weight[2];        ///< of corners 1 and 2, within kRayWeightError; corner 0 has what is left of 1
  std::uint32_t ray;       ///< its place in the list of rays
  std::uint32_t body;      ///< kNoIndex: there is no hit
  std::uint32_t triangle;  ///< in leaf order
  std::uint32_t face;      ///< of the source file, that the triangle comes from

  friend bool operator==(const RayHit&, const RayHit&) = default;
};

/// How far RayHit::t may be from the exact parameter, by which it is multiplied: 2^12 units in the last
/// place. Where the ray begins on the triangle, t is exactly 0. The least parameters, below 2^-1000, are
/// within 2^-1074.
inline constexpr double kRayTimeError = 0x1p-40;

/// How far a weight may be from the exact one. Where the ray lies in the triangle's plane, and for flat
/// triangles, weights are 0 and tell nothing.
inline constexpr double kRayWeightError = 0x1p-30;

enum class RayHits : std::uint32_t {
  first,  ///< a row for each ray, with the hit of the least parameter; of several, the lowest body and
          ///< triangle
  any,    ///< a row for each ray, with some hit if there is one; which one is unspecified
  all,    ///< a row for each triangle that a ray meets, by ascending ray, parameter, body and triangle
};

struct RayOptions {
  std::span<const std::array<double, 3>> origins;          ///< in the world
  std::span<const std::array<double, 3>> directions;       ///< of any length, as many
  double reach = std::numeric_limits<double>::infinity();  ///< the greatest parameter that counts
  RayHits hits = RayHits::first;
};

/// Counts what a question did. The counters depend neither on the number of threads nor on the machine.
struct RayCounters {
  std::uint64_t rays = 0;
  std::uint64_t hits = 0;        ///< rows with a hit
  std::uint64_t blocks = 0;      ///< four boxes or four triangles each
  std::uint64_t by_float64 = 0;  ///< triangles that float32 did not rule out

  friend bool operator==(const RayCounters&, const RayCounters&) = default;
};

/// Finds where rays meet the bodies of a scene. A ray is the set of points origin + t direction, 0 <= t <=
/// reach, in exact arithmetic; the geometry is that of ContactQuery: the posed vertices in float64, and
/// closed triangles. Whether a ray meets a triangle, and which of its hits is first, is decided exactly: no
/// ray slips through an edge or a corner, and one that meets an edge meets both triangles. A ray in the plane
/// of a triangle meets it where it first touches it. The filter is not asked, and pairs() are none.
class RayQuery : public Answer<RayHit, RayCounters> {
 public:
  using Options = RayOptions;

  /// Result: kOk; kOutOfRange, where where() of the scene is the first ray that has a coordinate which is NaN
  /// or beyond kLargestWorldCoordinate; kNoDirection, where it is the first ray with the direction 0;
  /// kBadReach where the reach is negative or NaN; kBadOption where there are not as many directions as
  /// origins, or 2^32 - 1 or more, or `hits` names no choice; kTooManyPairs, where there are 2^32 - 1 hits or
  /// more; kOutOfMemory or kCannotStartThread.
  Status find(Scene& scene, const RayOptions& options);

 private:
  struct State;
  Status answer(SceneState& scene, const RayOptions& options);

  Kept<State> state_;
};

}  // namespace tandem
