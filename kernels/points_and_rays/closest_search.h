#pragma once
#include "kernels/contact/candidate.h"
#include "kernels/geometry/point_distance.h"
#include "kernels/points_and_rays/probe_walk.h"
#include "tandem/kernels/closest_query.h"

namespace tandem {

/// The search for the closest point of one point, for CPU and GPU. Source: corners(body, triangle, out) poses
/// a triangle, and distance(pair, tolerance, out) finds the distance of a point, or is false where it leaves
/// that to somebody else: then the search means nothing.
struct ClosestSearch {
  DistanceTolerance tolerance;
  double point[3];
  std::uint32_t body;
  double upper;  ///< of the distance; before one is found, what is at least so far is beyond reach
  double lower;  ///< what was settled is not nearer
  double floor;  ///< nor is what was passed over
  TriangleDistance best;
  std::uint32_t best_body, best_triangle;  ///< of `best`; kNoIndex: none

  std::uint64_t blocks = 0, by_float64 = 0;

  /// beyond_reach: the least number that is; infinite without a reach.
  TANDEM_HD void begin(const double* p, double beyond_reach) {
    for (int k = 0; k < 3; ++k) point[k] = p[k];
    upper = beyond_reach;
    lower = floor = best.interval.upper = HUGE_VAL;
    best_body = best_triangle = kNoIndex;
  }

  /// Bounds the distance of a triangle of the body by float64.
  template <typename Source>
  TANDEM_HD bool settle(const Source& source, std::uint32_t triangle) {
    ++by_float64;
    TrianglePair pair;
    source.corners(body, triangle, pair.a);
    for (double(&corner)[3] : pair.b) {
      for (int k = 0; k < 3; ++k) corner[k] = point[k];
    }
    TriangleDistance found;
    if (!source.distance(pair, tolerance, found)) return false;
    if (found.interval.lower < lower) lower = found.interval.lower;
    if (found.interval.upper < upper) upper = found.interval.upper;
    if (!(found.interval.upper < best.interval.upper)) return true;
    best = found;
    best_body = body;
    best_triangle = triangle;
    return true;
  }

  /// Settles what may be nearer than the tolerance lets pass, and the first in any case.
  template <typename Source>
  TANDEM_HD bool settle(const Source& source, const ClosestCandidate* candidates, std::uint32_t count,
                        const FrameLengths& lengths) {
    std::uint32_t nearest = 0;
    for (std::uint32_t i = 1; i < count; ++i) {
      if (candidates[i].lower < candidates[nearest].lower) nearest = i;
    }
    if (!settle(source, candidates[nearest].triangle)) return false;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (i == nearest) continue;
      const double least = static_cast<double>(candidates[i].lower) * lengths.least_in_world;
      if (best_triangle != kNoIndex && !(least < nearness_below(tolerance, upper)))
        floor = least < floor ? least : floor;
      else if (!settle(source, candidates[i].triangle))
        return false;
    }
    return true;
  }

  /// The row, without what the source and the sides tell: the face, `within` and `winding`.
  TANDEM_HD ClosestPoint row(double reach) const {
    ClosestPoint out = {};
    out.body = out.triangle = out.face = out.within = kNoIndex;
    out.lower = lower < floor ? lower : floor;
    if (upper < out.lower) out.lower = upper;
    out.upper = HUGE_VAL;
    if (best_triangle == kNoIndex || !(out.lower <= reach)) return out;
    out.upper = upper < best.interval.upper ? upper : best.interval.upper;
    for (int k = 0; k < 3; ++k) out.position[k] = best.point_a[k];
    out.body = best_body;
    out.triangle = best_triangle;
    return out;
  }
};

/// The least number that is beyond a reach; infinite without one.
TANDEM_HD inline double beyond(double reach) {
  return reach < HUGE_VAL ? std::nextafter(reach, HUGE_VAL) : reach;
}

}  // namespace tandem
