#pragma once
#include <cstdint>

#include "kernels/geometry/triangle_distance.h"
#include "kernels/impact/pair_motion.h"
#include "tandem/formats/file.h"

/// Conservative advancement finds how long two moving triangles stay apart.
///
/// At some time of the step, a plane's normal n, not 0, tells the triangles apart where g = n.q - n.p > 0 for
/// each corner p of a and q of b. After s more the difference of their places is at least
///
///     g + s g' - s^2 / 2 acceleration_along(n),   g' = n.(velocity of q) - n.(velocity of p),         (2)
///
/// by the argument of box_times.h; |n| slack is taken off g. It is concave in s, so where it is above 0 for s
/// = 0, it is so up to its root: the least root of the nine pairs of corners is a time until which the
/// triangles are apart. Unlike a bound by the largest speed, (2) is exact but for the last term: near
/// impact, where the nearest points' direction is the one that stops the bodies, the time that is left is
/// nearly its root, and each step squares the error. Bodies that recede, or slide along each other, are apart
/// at any distance that slack allows.
namespace tandem::impact {

/// Steps of conservative advancement for two triangles. Random bodies take 3 and a few 10; more are taken
/// only where triangles turn past each other at distances near the tolerance.
inline constexpr int kMostTriangleSteps = 256;

/// The part of the tolerance that is left between triangles which stop: steps aim at it, so that the many
/// triangles of flat faces that meet are told apart by their boxes once one of them has stopped.
inline constexpr double kAim = 0.5;

/// Corners relative to the bodies' own centres, at the start.
struct MovingTriangles {
  Vector3 a[3], b[3];
  double fastest_a, fastest_b;  ///< the largest |turn x arm| of each, at any time
};

/// Result: the largest |turn x arm|, or more. Where a corner and the centre nearly cancel, the corner's
/// difference from it is still rounded once.
TANDEM_HD inline double corners_of(const MovingBody& body, const Triangle& triangle, Vector3 (&out)[3]) {
  double fastest = 0;
  for (int c = 0; c < 3; ++c) {
    const float* p = triangle.corner[c].position;
    double x[3];
    apply(body.start, p[0], p[1], p[2], x);
    out[c] = vector_of(x) - body.centre;
    fastest = manifold::greater(
        fastest, norm(manifold::cross(body.turn, out[c])) + 0x1p-49 * body.angle * norm(out[c]));
  }
  return fastest;
}

TANDEM_HD inline MovingTriangles moving_triangles(const PairMotion& pair, const Triangle& a,
                                                  const Triangle& b) {
  MovingTriangles out;
  out.fastest_a = corners_of(*pair.a, a, out.a);
  out.fastest_b = corners_of(*pair.b, b, out.b);
  return out;
}

/// Corners at some time, relative to a's centre, and b's velocities relative to it.
struct TrianglesAt {
  Vector3 a[3], b[3], velocity_a[3], velocity_b[3];
  double fastest_a, fastest_b;
};

TANDEM_HD inline TrianglesAt triangles_at(const PairMotion& pair, const MovingTriangles& start,
                                          const PairPlace& place) {
  TrianglesAt out;
  for (int c = 0; c < 3; ++c) {
    out.a[c] = place.turn_a * start.a[c];
    const Vector3 arm = place.turn_b * start.b[c];
    out.b[c] = place.offset + arm;
    out.velocity_a[c] = cross(pair.a->turn, out.a[c]);
    out.velocity_b[c] = pair.displacement + cross(pair.b->turn, arm);
  }
  out.fastest_a = start.fastest_a;
  out.fastest_b = start.fastest_b;
  return out;
}

/// The first s > 0 at which g + s rate - s^2 / 2 bend is not above 0, rounded down; infinite where there is
/// none; 0 where numbers are too large. Condition: g > 0, bend >= 0.
TANDEM_HD inline double first_root(double g, double rate, double bend) {
  const double root = std::sqrt(rate * rate + 2 * bend * g);
  if (!(root < INFINITY)) return 0;
  if (rate <= 0) {
    const double fall = root - rate;
    return fall > 0 ? 2 * g / fall * (1 - 0x1p-48) : INFINITY;
  }
  return bend > 0 ? (rate + root) / bend * (1 - 0x1p-48) : INFINITY;
}

/// Says how a direction keeps triangles apart for some time from now on.
struct Apart {
  bool throughout = false;  ///< for all of it; the rest is not told then
  double nearly = 0;  ///< until they may be `margin` apart along the direction; 0 where they are nearer now
  double gap = 0;     ///< a lower bound of their distance now
};

/// n: from a to b. left: the time; (2) is concave, so what is above 0 now and then is so in between. Its
/// value then has few more roundings than slack is for.
TANDEM_HD inline Apart apart_along(const PairMotion& pair, const TrianglesAt& t, const Vector3& n,
                                   double left, double margin) {
  Apart out;
  const double length = norm(n);
  if (!(length >= 0x1p-400)) return out;
  double at_a[3], at_b[3], rate_a[3], rate_b[3], least = INFINITY;
  for (int c = 0; c < 3; ++c) {
    // Relative to one corner, so that a product with n is no larger than it needs to be.
    at_a[c] = dot(n, t.a[c] - t.a[0]);
    at_b[c] = dot(n, t.b[c] - t.a[0]);
    rate_a[c] = dot(n, t.velocity_a[c]);
    rate_b[c] = dot(n, t.velocity_b[c]);
  }
  const double slack = length * pair.slack;
  const double bend = acceleration_along(pair, n, t.fastest_a, t.fastest_b);
  bool now = true, then = true;  // NaN is not above 0
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double g = at_b[j] - at_a[i] - slack, rate = rate_b[j] - rate_a[i];
      least = manifold::lesser(g, least);
      now = now && g > 0;
      then = then && g + left * (rate - 0.5 * left * bend) > 0;
    }
  }
  out.throughout = now && then;
  if (!now || then) return out;
  out.nearly = least > length * margin ? left : 0;
  // The least root, by few of them: that of whichever is lowest at the least root so far. Each pair of
  // corners is lowest once at most, but for rounding.
  bool lowered = out.nearly > 0;
  for (int rounds = 0; rounds < 9 && lowered; ++rounds) {
    double lowest = 0, lowest_g = 0, lowest_rate = 0;
    lowered = false;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const double g = at_b[j] - at_a[i] - slack - length * margin, rate = rate_b[j] - rate_a[i];
        const double value = g + out.nearly * (rate - 0.5 * out.nearly * bend);
        if (value > lowest) continue;
        lowered = true;
        lowest = value;
        lowest_g = g;
        lowest_rate = rate;
      }
    }
    if (lowered) out.nearly = manifold::lesser(first_root(lowest_g, lowest_rate, bend), out.nearly);
  }
  out.gap = least / length * (1 - 0x1p-48);
  return out;
}

TANDEM_HD inline TrianglePair triangle_pair(const TrianglesAt& t) {
  TrianglePair out;
  for (int c = 0; c < 3; ++c) {
    const Vector3 &p = t.a[c], &q = t.b[c];
    const double a[3] = {p.x, p.y, p.z}, b[3] = {q.x, q.y, q.z};
    for (int k = 0; k < 3; ++k) {
      out.a[c][k] = a[k];
      out.b[c][k] = b[k];
    }
  }
  return out;
}

/// A triangle's normal, on the side of the other.
TANDEM_HD inline Vector3 normal_towards(const Vector3 (&t)[3], const Vector3 (&other)[3]) {
  const Vector3 n = manifold::cross(t[1] - t[0], t[2] - t[0]);
  const double side = dot(n, other[0] - t[0]) + dot(n, other[1] - t[0]) + dot(n, other[2] - t[0]);
  return side < 0 ? -n : n;
}

/// Returns the direction from a to b where they are nearest, as computed.
TANDEM_HD inline Vector3 nearest_direction(const TrianglesAt& t) {
  const distance::LocalPair local = distance::local_pair(triangle_pair(t));
  const auto nearest = distance::nearest_features<double>(local.a, local.b, 0x1p-480);
  const distance::Point<double> n = distance::refined(local, nearest);
  return {-n.x[0], -n.x[1], -n.x[2]};
}

TANDEM_HD inline Apart longer(const Apart& x, const Apart& y) {
  return {x.throughout || y.throughout, manifold::greater(x.nearly, y.nearly),
          manifold::greater(x.gap, y.gap)};
}

/// Returns how long either face's normal keeps the triangles apart.
TANDEM_HD inline Apart apart_by_faces(const PairMotion& pair, const TrianglesAt& t, double left,
                                      double margin) {
  const Apart by_a = apart_along(pair, t, normal_towards(t.a, t.b), left, margin);
  if (by_a.throughout) return by_a;
  return longer(by_a, apart_along(pair, t, -normal_towards(t.b, t.a), left, margin));
}

/// The time up to which two triangles whose boxes may meet need not be advanced: `end` where the planes that
/// they have at `begin`, where `place` is, tell them apart until then. apart: until when their boxes are.
TANDEM_HD inline double time_to_advance_from(const PairMotion& pair, const MovingTriangles& start,
                                             const PairPlace& place, double begin, double end, double apart,
                                             double tolerance) {
  const Apart by_faces =
      apart_by_faces(pair, triangles_at(pair, start, place), end - begin, kAim * tolerance);
  if (by_faces.throughout) return end;
  return manifold::greater(begin + by_faces.nearly, apart);
}

/// The time when triangles stop: until `time`, in parts of the step, they are surely apart.
struct TriangleStop {
  double time;
  std::uint32_t steps;
  bool converged;  ///< they are nearer than the tolerance then, or nothing more can be said in float64
};

/// Advances two triangles from a time before which they are surely apart, until `end` or until they are
/// nearer than the tolerance and may meet. Result: `end` where they are apart until then.
TANDEM_HD inline TriangleStop advance(const PairMotion& pair, const MovingTriangles& start, double from,
                                      double end, double tolerance) {
  double time = from;
  for (std::uint32_t steps = 1; steps <= kMostTriangleSteps; ++steps) {
    const TrianglesAt t = triangles_at(pair, start, place_at(pair, time));
    const double left = end - time, margin = kAim * tolerance;
    Apart apart = apart_by_faces(pair, t, left, margin);
    if (!apart.throughout) apart = longer(apart, apart_along(pair, t, nearest_direction(t), left, margin));
    if (apart.throughout) return {end, steps, true};
    const double next = time + apart.nearly;
    if (apart.gap <= tolerance || !(next > time)) return {time, steps, true};
    time = next;
  }
  return {time, kMostTriangleSteps, false};
}

}  // namespace tandem::impact
