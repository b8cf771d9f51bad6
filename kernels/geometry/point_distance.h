#pragma once
#include "kernels/geometry/triangle_distance.h"

namespace tandem {

/// The distance of a triangle, t.a, from a point, three times in t.b, by float64, with a guess that takes
/// less time than that of triangle_distance(). False: float64 is not sure enough, and triangle_distance() or
/// find_distance() is.
TANDEM_HD inline bool point_distance_by_float64(const TrianglePair& t, const DistanceTolerance& tolerance,
                                                TriangleDistance& out) {
  const distance::LocalPair local = distance::local_pair(t);
  if (!local.in_range()) return false;
  distance::Point<double> from_point[3];
  for (int i = 0; i < 3; ++i) from_point[i] = distance::minus(local.a[i], local.b[0]);
  const auto nearest = distance::nearest_to_origin<double>(from_point, 0x1p-480);
  TriangleWeights weights = {};
  out.interval = distance::bounded_distance(local, nearest, tolerance, weights);
  if (out.interval.lower == 0 || !is_narrow(out.interval, tolerance)) return false;
  distance::write_points(t, weights, out);
  return true;
}

}  // namespace tandem
