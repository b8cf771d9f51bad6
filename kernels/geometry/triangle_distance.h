#pragma once
#include <cmath>

#include "kernels/geometry/exact_distance.h"
#include "kernels/geometry/nearest_features.h"
#include "kernels/geometry/triangle_test.h"
#include "tandem/kernels/detail/interval.h"

/// The distance of two triangles as a certified interval, for CPU and GPU. Triangles are closed, flat ones
/// are the hulls of their corners; the distance is that of exact arithmetic on the corners.
///
/// A cascade: float64 guesses the nearest points and certifies what it can, exact arithmetic does the rest.
/// Whatever the guess, both ends of the interval hold:
///  - upper: two points of the triangles are no nearer to each other than the triangles are;
///  - lower: along any direction n, no point of a and no point of b are nearer to each other than min n.a -
///    max n.b over the corners, divided by |n|.
///
/// **Proof** of the bounds in float64. Let u = 2^-53, and let the corners be taken relative to a[0], each
/// difference rounded once; M is the largest magnitude of a coordinate, and 2^-200 <= M <= 2^200.
///
/// Upper. With weights as float64 numbers in [0, 1] whose sum rounds to at most 1, the points that are meant
/// are w0 A0 + w1 A1 + w2 A2 of the exact corners, where w0 is 1 less the others; as that may be -u, the
/// point meant may lie beyond the triangle by 2 u M a coordinate. The computed p = A0 + w1 (A1 - A0) + w2 (A2
/// - A0) has in each coordinate errors of u M from the corners, 2 u M from each of two differences, 2 u M
/// from each product and 3 u M from each of the two sums: below 20 u M with what lies beyond and terms of
/// second order. Both points together are off by less than 40 sqrt(3) u M < 70 u M. The length as computed is
/// off by at most 4 u of itself and underflow, which is below 2^-500: `upper` has 80 u M and 8 u.
///
/// Lower. A product n.x as computed, with the rounding of x's coordinates, is off by at most 4.01 u |n|_1 M;
/// two of them, and their difference, by 9 u |n|_1 M and u of the difference. Where |n|_1 M is above 2^-900,
/// underflow, 2^-1074 an operation, is covered by what 8.02 leaves of 9 (2^-56 * 2^-900). |n| as computed is
/// off by 3 u where no square underflows to matter: n is scaled so that its largest coordinate is 1 to 2.
namespace tandem {

struct TriangleDistance {
  DistanceInterval interval;
  double point_a[3], point_b[3];  ///< where it is: points of a and b, rounded to float64
};

namespace distance {

/// Two triangles relative to the first corner of a.
struct LocalPair {
  Point<double> a[3], b[3];
  double largest;  ///< M of the proof

  /// Returns whether the proof's conditions on M hold.
  TANDEM_HD bool in_range() const { return largest >= 0x1p-200 && largest <= 0x1p200; }
};

TANDEM_HD inline LocalPair local_pair(const TrianglePair& t) {
  LocalPair out;
  out.largest = 0;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      out.a[i].x[k] = t.a[i][k] - t.a[0][k];
      out.b[i].x[k] = t.b[i][k] - t.a[0][k];
      const double of_a = std::fabs(out.a[i].x[k]), of_b = std::fabs(out.b[i].x[k]);
      const double larger = of_a < of_b ? of_b : of_a;
      if (!(larger <= out.largest)) out.largest = larger;
    }
  }
  return out;
}

/// n times a power of two, so that its largest coordinate is from 1 to 2. Condition: that is normal.
TANDEM_HD inline Point<double> normalised(const Point<double>& n) {
  const double largest = detail::greatest(std::fabs(n.x[0]), std::fabs(n.x[1]), std::fabs(n.x[2]));
  const double factor = 1 / detail::power_of_two_below(largest);
  return scaled(factor, n);
}

/// A lower bound of the distance: how far a lies beyond b along n, where it does, else 0. Condition:
/// pair.in_range().
TANDEM_HD inline double distance_along(const LocalPair& pair, const Point<double>& direction) {
  const double size = std::fabs(direction.x[0]) + std::fabs(direction.x[1]) + std::fabs(direction.x[2]);
  if (!(size >= 0x1p-600 && size <= 0x1p900)) return 0;
  const Point<double> n = normalised(direction);
  const double least_a = detail::least(dot(n, pair.a[0]), dot(n, pair.a[1]), dot(n, pair.a[2]));
  const double most_b = detail::greatest(dot(n, pair.b[0]), dot(n, pair.b[1]), dot(n, pair.b[2]));
  const double n_1 = std::fabs(n.x[0]) + std::fabs(n.x[1]) + std::fabs(n.x[2]);
  constexpr double kU = 0x1p-53;
  const double gap = (least_a - most_b) - 9.1 * kU * n_1 * pair.largest;
  return gap > 0 ? gap / std::sqrt(dot(n, n)) * (1 - 8 * kU) : 0;
}

/// The points that weights mean, relative to a[0].
TANDEM_HD inline Point<double> point_at(const Point<double> (&corner)[3], const double (&weight)[3]) {
  const Point<double> u = minus(corner[1], corner[0]), v = minus(corner[2], corner[0]);
  return plus(corner[0], plus(scaled(weight[1], u), scaled(weight[2], v)));
}

/// An upper bound of the distance: that of these points. Condition: pair.in_range(); weights are in [0, 1],
/// and weight 1 plus weight 2 rounds to at most 1.
TANDEM_HD inline double distance_at(const LocalPair& pair, const TriangleWeights& weights) {
  const Point<double> apart = minus(point_at(pair.a, weights.a), point_at(pair.b, weights.b));
  constexpr double kU = 0x1p-53;
  return std::sqrt(dot(apart, apart)) * (1 + 8 * kU) + 80 * kU * pair.largest;
}

/// The weights of the nearest features.
TANDEM_HD inline TriangleWeights weights_of(const Nearest<double>& nearest) {
  TriangleWeights out = {};
  const int feature = static_cast<int>(nearest.feature);
  const auto on_edge = [](double(&weight)[3], int edge, double along) {
    weight[edge] = 1 - along;
    weight[(edge + 1) % 3] = along;
  };
  if (feature < 9) {
    on_edge(out.a, feature / 3, nearest.s);
    on_edge(out.b, feature % 3, nearest.t);
    return out;
  }
  double(&face)[3] = feature < 12 ? out.a : out.b;
  double(&other)[3] = feature < 12 ? out.b : out.a;
  other[feature % 3] = 1;
  face[0] = 1 - nearest.s - nearest.t > 0 ? 1 - nearest.s - nearest.t : 0;
  face[1] = nearest.s;
  face[2] = nearest.t;
  return out;
}

/// n less its part along e, twice, as the first time leaves an error of the size of the part.
TANDEM_HD inline Point<double> without_part(Point<double> n, const Point<double>& e) {
  const double factor = inverse(dot(e, e), 0x1p-1000);
  for (int i = 0; i < 2; ++i) n = minus(n, scaled(factor * dot(n, e), e));
  return n;
}

/// The direction in which two features that are nearest are apart, better than the difference of their points
/// where that is small beside them: normal to the edges that the points are within.
TANDEM_HD inline Point<double> refined(const LocalPair& pair, const Nearest<double>& nearest) {
  const int feature = static_cast<int>(nearest.feature);
  if (feature >= 9) return nearest.along;
  const int i = feature / 3, j = feature % 3;
  const Point<double> e = minus(pair.a[(i + 1) % 3], pair.a[i]), f = minus(pair.b[(j + 1) % 3], pair.b[j]);
  const bool within_e = nearest.s > 0 && nearest.s<1, within_f = nearest.t> 0 && nearest.t < 1;
  if (within_e && within_f) {
    const Point<double> n = cross(e, f);
    return dot(n, nearest.apart) < 0 ? scaled(-1.0, n) : n;
  }
  // The corner's offset from the edge is taken from the nearer end.
  const Point<double> offset =
      minus(pair.a[(i + (nearest.s > 0.5)) % 3], pair.b[(j + (nearest.t > 0.5)) % 3]);
  if (within_e) return without_part(offset, e);
  return within_f ? without_part(offset, f) : offset;
}

/// Returns the interval that float64 knows: it is always right, and the narrower the farther the triangles
/// are apart for their size.
/// nearest: a guess.
TANDEM_HD inline DistanceInterval bounded_distance(const LocalPair& pair, const Nearest<double>& nearest,
                                                   const DistanceTolerance& tolerance,
                                                   TriangleWeights& weights) {
  weights = weights_of(nearest);
  DistanceInterval interval = {distance_along(pair, nearest.along), distance_at(pair, weights)};
  if (is_narrow(interval, tolerance)) return interval;
  const double lower = distance_along(pair, refined(pair, nearest));
  if (lower > interval.lower) interval.lower = lower;
  return interval;
}

TANDEM_HD inline DistanceInterval bounded_distance(const LocalPair& pair, const DistanceTolerance& tolerance,
                                                   TriangleWeights& weights) {
  return bounded_distance(pair, nearest_features<double>(pair.a, pair.b, 0x1p-480), tolerance, weights);
}

/// Finds where edge i of a triangle goes through the plane of a face, as weights of both. False: it does not
/// as computed.
TANDEM_HD inline bool pierces(const Point<double> (&face)[3], const Point<double> (&other)[3], int i,
                              double (&on_face)[3], double (&on_other)[3]) {
  const int next = (i + 1) % 3;
  const Point<double> u = minus(face[1], face[0]), v = minus(face[2], face[0]), normal = cross(u, v);
  const double from = dot(minus(other[i], face[0]), normal), to = dot(minus(other[next], face[0]), normal);
  if (!(from * to <= 0 && from != to)) return false;
  const double along = clamped_to_1(from / (from - to));
  const Point<double> r = minus(plus(other[i], scaled(along, minus(other[next], other[i]))), face[0]);
  const double inverse_square = inverse(dot(normal, normal), 0x1p-960);
  const double s = clamped_to_1(dot(r, cross(v, normal)) * inverse_square);
  const double t = clamped_to_1(dot(r, cross(normal, u)) * inverse_square), rest = 1 - s;
  on_face[1] = s;
  on_face[2] = t < rest ? t : rest;
  on_face[0] = rest - on_face[2];
  on_other[i] = 1 - along;
  on_other[next] = along;
  on_other[(i + 2) % 3] = 0;
  return true;
}

/// Finds the weights of a point that two triangles which meet have in common, up to rounding: the best of
/// `weights`, the nearest points of their features, and of the points where edges go through faces.
TANDEM_HD inline void find_common_point(const LocalPair& pair, TriangleWeights& weights) {
  double least = distance_at(pair, weights);
  for (int i = 0; i < 6; ++i) {
    TriangleWeights other;
    const bool found = i < 3 ? pierces(pair.a, pair.b, i, other.a, other.b)
                             : pierces(pair.b, pair.a, i - 3, other.b, other.a);
    if (!found || !(distance_at(pair, other) < least)) continue;
    least = distance_at(pair, other);
    weights = other;
  }
}

/// A lower bound of the distance: how far apart the triangles are along the direction of two points.
TANDEM_HD inline double distance_along_points(const TrianglePair& t, const double (&point_a)[3],
                                              const double (&point_b)[3]) {
  const LocalPair local = local_pair(t);
  if (!local.in_range()) return 0;
  return distance_along(local, {{point_a[0] - point_b[0], point_a[1] - point_b[1], point_a[2] - point_b[2]}});
}

/// Sums of the corners with these weights.
TANDEM_HD inline void write_points(const TrianglePair& t, const TriangleWeights& weights,
                                   TriangleDistance& out) {
  for (int k = 0; k < 3; ++k) {
    out.point_a[k] =
        t.a[0][k] + (weights.a[1] * (t.a[1][k] - t.a[0][k]) + weights.a[2] * (t.a[2][k] - t.a[0][k]));
    out.point_b[k] =
        t.b[0][k] + (weights.b[1] * (t.b[1][k] - t.b[0][k]) + weights.b[2] * (t.b[2][k] - t.b[0][k]));
  }
}

}  // namespace distance

/// The distance of two triangles by whole numbers of at most so many words a coordinate: an interval, 0, 0
/// exactly where the triangles meet, and where it is. False: the interval is wider than `tolerance` asks for,
/// and more words would make it narrow. With the most words that is never so.
template <int kWords>
TANDEM_HD inline bool find_distance(const TrianglePair& t, const DistanceTolerance& tolerance,
                                    TriangleDistance& out) {
  TriangleWeights weights = {};
  const distance::LocalPair local = distance::local_pair(t);
  if (local.in_range()) {
    out.interval = distance::bounded_distance(local, tolerance, weights);
  } else {
    out.interval = {0, INFINITY};
  }
  if (out.interval.lower == 0) {
    Verdict verdict = decide_float64(t);
    if (verdict == Verdict::undecided) verdict = decide_exact(t);
    if (verdict == Verdict::contact) {
      out.interval = {0, 0};
      if (local.in_range()) distance::find_common_point(local, weights);
      distance::write_points(t, weights, out);
      return true;
    }
  }
  bool narrow = out.interval.lower != 0 && is_narrow(out.interval, tolerance);
  if (!narrow && exact::exponents_of(t).words() <= kWords) {
    out.interval = exact::distance_apart<kWords>(t, weights);
    narrow = true;
  }
  distance::write_points(t, weights, out);
  return narrow;
}

/// The distance of two triangles: an interval as narrow as `tolerance` asks for, and where it is. The
/// interval is 0, 0 exactly where the triangles meet; the points are then one point that both have, up to
/// rounding, where coordinates differ by 2^-200 to 2^200 (else any points of them). Condition: corners are at
/// most kLargestWorldCoordinate in magnitude.
TANDEM_HD inline TriangleDistance triangle_distance(const TrianglePair& t,
                                                    const DistanceTolerance& tolerance = {}) {
  TriangleDistance out;
  find_distance<detail::kMaxWords>(t, tolerance, out);
  return out;
}

}  // namespace tandem
