#pragma once
#include <cmath>

#include "kernels/geometry/box_distance.h"
#include "kernels/geometry/ray_triangle.h"
#include "kernels/geometry/relative_pose.h"
#include "tandem/kernels/world_box.h"

/// Points and rays of the world in the frame of a body's stored coordinates, in which float32 walks its tree;
/// for CPU and GPU.
///
/// **Frame.** T(x) = N (x - t), N being the inverse of the body's rotation as computed, t its translation. T
/// is affine and det N > 0 for rigid poses: it keeps which ray meets which triangle, and the parameters. For
/// a posed vertex x of a stored v, T(x) - v = (N R - I) v + N e, where |e| <= posing_error(): so along axis i
/// it is at most error_i = sum |N R - I|_ij reach_j + |N_ij| posing_j, with the roundings of the product, as
/// relative_pose.h has them. u is 2^-24 here, u' is 2^-53.
///
/// **Points.** N (p - t) as computed is off by at most 4.1 u' sum |N_ij (p - t)_j|, as the difference has one
/// rounding, the product another, and two sums the rest. The float32 number next to it is off by a difference
/// that float64 has exactly. Both together are a_i.
///
/// Box bound: |T(x) - T(p)|_i >= |c - q|_i - h_i - error_i - a_i for x below a node, q being the float32
/// point. |c - q| as computed is too large by at most u (reach + |q|), and h + slack too small by at most u
/// (reach + slack): slack_i = 1.001 (error_i + a_i) + 2.1 u (reach_i + |q_i|) makes up for both, and the gap
/// as computed is at most 1 + u of the exact one where it is positive. The sum of squares has 1 + u seven
/// times; limit_of() and distance_of() spare 16 u.
///
/// **Rays.** The direction is scaled by a power of two so that its largest coordinate is from 1 to 2, which
/// multiplies parameters by another. What reaches the body's box, in float64 with `margin` for all errors,
/// runs from tau_0 to tau_1; the float32 ray begins at tau_0, so that no coordinate is larger than the
/// body's. A point of the ray at tau_0 + tau is o + tau d in float32 numbers, off by at most a_i + length
/// b_i, a and b being the errors of o and d. A coordinate of d below 2^-60 becomes 2^-60, so that its inverse
/// is finite; b has the difference.
///
/// Box test: with m = (c - o) / d and r = (h + slack) / |d|, the ray is in the box from m - r to m + r along
/// each axis. m as computed is off by 3.1 u |c - o| / |d|, r by 3.1 u of itself, and each difference by u
/// (|m| + r). In coordinates, multiplied by |d|, that is below 4.2 u (|c - o| + h + slack) <= 4.2 u (reach +
/// |o| + slack): slack_i = 1.001 (error_i + a_i + length b_i) + 4.3 u (reach_i + |o_i|). So if a triangle
/// below a node has a point of the ray at tau, the largest of the lower ends as computed is at most tau, and
/// the least of the upper ends at least tau.
///
/// Triangle test: w_i of ray_triangle.h, of corners less o, in float32. A coordinate of p_i = v_i - o is off
/// by at most E = max(error_k + a_k) and u |p|; one of an edge by 2 S = 2 max error_k and u |e|; one of d by
/// B = max b_k. With P, e and D the largest magnitudes of coordinates, or bounds of them, D_1 >= sum |d_k|, a
/// coordinate of p x e is off by at most 2 ((u P + E) e + P (u e + 2 S) + (u P + E) (u e + 2 S)) for its
/// factors and 3.1 u 2 P e for its rounding; and w by D_1 times that, B 3 (2 P e) for d, and 3.1 u D_1 2 P e
/// for rounding. All together, below
///
///     e ((17 u D_1 + 6.1 B) P + 2.1 D_1 E) + 4.3 D_1 S (P + E).
///
/// The bound as computed has 1.001 for its roundings, and 2^-70 for underflow: factors are below 2^33.
namespace tandem {

/// A body as points and rays see it.
struct LocalFrame : FrameLengths {
  double inverse[3][3];  ///< N
  double translation[3];
  double error[3];
  double reach[3];
  double lower[3], upper[3];  ///< bounds of the images of posed vertices
  float largest_error;        ///< S
  bool in_range;              ///< float32 can take the body
};

TANDEM_HD inline LocalFrame local_frame(const Pose& pose, const TreeExtent& extent, const float (&lower)[3],
                                        const float (&upper)[3]) {
  constexpr double kU64 = relative_pose_detail::kU64;
  LocalFrame out;
  relative_pose_detail::invert(pose.rotation, out.inverse);
  out.in_range = bound_lengths(out.inverse, 0, out);
  double largest = 0;
  for (int i = 0; i < 3; ++i) {
    out.translation[i] = pose.translation[i];
    out.reach[i] = extent.reach[i];
    out.error[i] = 0x1p-100;
    for (int j = 0; j < 3; ++j) {
      double f = i == j ? -1 : 0, f_size = i == j ? 1 : 0;
      for (int k = 0; k < 3; ++k) {
        f += out.inverse[i][k] * pose.rotation[k][j];
        f_size += std::fabs(out.inverse[i][k] * pose.rotation[k][j]);
      }
      out.error[i] += std::fabs(out.inverse[i][j]) * relative_pose_detail::posing_error(pose, extent, j) +
                      (std::fabs(f) + 4.01 * kU64 * f_size) * extent.reach[j];
    }
    out.error[i] *= 1 + 0x1p-40;
    out.lower[i] = static_cast<double>(lower[i]) - out.error[i];
    out.upper[i] = static_cast<double>(upper[i]) + out.error[i];
    if (!(out.error[i] <= largest)) largest = out.error[i];
    out.in_range = out.in_range && extent.reach[i] <= kLargestInFrame / 4;
  }
  out.in_range = out.in_range && largest <= kLargestInFrame / 4;
  out.largest_error = out.in_range ? static_cast<float>(largest * (1 + 0x1p-20)) : INFINITY;
  return out;
}

/// N v, v a difference of float64 numbers with one rounding, and the bound of its error.
TANDEM_HD inline void take_image(const LocalFrame& frame, const double (&v)[3], double (&out)[3],
                                 double (&error)[3]) {
  for (int i = 0; i < 3; ++i) {
    const double x = frame.inverse[i][0] * v[0], y = frame.inverse[i][1] * v[1],
                 z = frame.inverse[i][2] * v[2];
    out[i] = (x + y) + z;
    error[i] = 4.1 * 0x1p-53 * ((std::fabs(x) + std::fabs(y)) + std::fabs(z)) + 0x1p-990;
  }
}

/// A point as float32 has it in a body's frame.
struct LocalPoint {
  float q[3], slack[3];
  float error;  ///< E of frame_distance.h: max of error_i + a_i
};

/// False: float32 cannot take it.
TANDEM_HD inline bool local_point(const LocalFrame& frame, const double (&p)[3], LocalPoint& out) {
  double v[3], image[3], error[3], largest = 0;
  for (int k = 0; k < 3; ++k) v[k] = p[k] - frame.translation[k];
  take_image(frame, v, image, error);
  bool in_range = frame.in_range;
  for (int k = 0; k < 3; ++k) {
    in_range = in_range && std::fabs(image[k]) <= kLargestInFrame / 4;
    const float q = in_range ? static_cast<float>(image[k]) : 0;
    const double off = frame.error[k] + std::fabs(image[k] - static_cast<double>(q)) + error[k];
    const double slack =
        1.001 * off + 2.1 * 0x1p-24 * (frame.reach[k] + std::fabs(static_cast<double>(q))) + 0x1p-60;
    out.q[k] = q;
    out.slack[k] = static_cast<float>(slack * (1 + 0x1p-20));
    if (!(off <= largest)) largest = off;
  }
  out.error = static_cast<float>(largest * (1 + 0x1p-20) + 0x1p-60);
  return in_range;
}

/// A ray of the world, ready for bodies.
struct WorldRay {
  double origin[3], direction[3];
  double scaled[3];  ///< the direction times `factor`
  double factor;     ///< a power of two; a parameter is one of the scaled ray times this
  double reach;
};

TANDEM_HD inline WorldRay world_ray(const double* origin, const double* direction, double reach) {
  WorldRay ray;
  for (int k = 0; k < 3; ++k) {
    ray.origin[k] = origin[k];
    ray.direction[k] = direction[k];
  }
  const double largest = ray::largest_of(ray.direction);
  ray.factor = std::ldexp(1.0, -std::ilogb(largest));
  if (!(ray.factor <= 0x1p1022)) ray.factor = 0x1p1022;  // of subnormal numbers
  for (int k = 0; k < 3; ++k) {
    ray.scaled[k] = direction[k] * ray.factor;
    // Only what is exactly 0 stays so.
    if (ray.scaled[k] == 0 && direction[k] != 0) ray.scaled[k] = direction[k] > 0 ? 0x1p-1000 : -0x1p-1000;
  }
  ray.reach = reach;
  return ray;
}

/// Returns whether a ray may meet a box: the parameters are bounds of the part of the scaled ray that does.
/// Rounded outward: quotients of differences have three roundings, and 2^-50 is spared. A ray whose
/// coordinate does not change along an axis is compared with the box there.
TANDEM_HD inline bool meets_box(const double (&origin)[3], const double (&direction)[3], const double* lo,
                                const double* hi, double& first, double& last) {
  for (int k = 0; k < 3; ++k) {
    if (std::fabs(direction[k]) < 0x1p-900) {
      // Along the whole ray, up to 2^1000, it moves by less than 2^100.
      if (direction[k] == 0 && !(lo[k] <= origin[k] && origin[k] <= hi[k])) return false;
      continue;
    }
    const double inverse = 1 / direction[k];
    double from = (lo[k] - origin[k]) * inverse, to = (hi[k] - origin[k]) * inverse;
    if (inverse < 0) {
      const double t = from;
      from = to, to = t;
    }
    from *= from > 0 ? 1 - 0x1p-50 : 1 + 0x1p-50;
    to *= to > 0 ? 1 + 0x1p-50 : 1 - 0x1p-50;
    from -= 0x1p-1000;
    to += 0x1p-1000;
    if (from > first) first = from;
    if (to < last) last = to;
  }
  return first <= last;
}

/// A ray as float32 has it in a body's frame.
struct LocalRay {
  float o[3], d[3], inverse[3], slack[3];
  float length;                    ///< tau_1 - tau_0, rounded up
  float edge_factor, least_bound;  ///< of the triangle test: least_bound + edge_factor e
  double start;                    ///< tau_0
};

enum class RayReach : std::uint8_t { misses, in_frame, out_of_range };

TANDEM_HD inline float rounded_up(double x) {
  return x < 0x1p120 ? static_cast<float>(x * (1 + 0x1p-22) + 0x1p-100) : INFINITY;
}

/// The parameter of the local ray that a parameter of the world's is at most.
TANDEM_HD inline float local_limit(const WorldRay& world, const LocalRay& ray, double t) {
  const double limit = t / world.factor;
  const double left = (limit - ray.start) + 0x1p-50 * (limit + ray.start);
  if (!(left > 0)) return 0x1p-100f;
  const float out = rounded_up(left);
  return out < ray.length ? out : ray.length;
}

/// last: the greatest parameter of the world's ray that counts.
TANDEM_HD inline RayReach local_ray(const LocalFrame& frame, const WorldRay& world, double last,
                                    LocalRay& out) {
  if (!frame.in_range) return RayReach::out_of_range;
  double v[3], o[3], o_error[3], d[3], d_error[3], scaled[3];
  double far = 0, reach = 0;
  for (int k = 0; k < 3; ++k) {
    v[k] = world.origin[k] - frame.translation[k];
    scaled[k] = world.scaled[k];
    if (!(std::fabs(v[k]) <= far)) far = std::fabs(v[k]);
    if (frame.reach[k] > reach) reach = frame.reach[k];
  }
  if (!(far <= 0x1p200 && ray::largest_of(scaled) >= 1)) return RayReach::out_of_range;
  take_image(frame, v, o, o_error);
  take_image(frame, scaled, d, d_error);
  // The largest coordinate of d is above 1/2, so what is in the body's box has parameters below this.
  const double most = 8 * (far + reach);
  double lo[3], hi[3], start = 0, end = last / world.factor;
  if (!(end <= most)) end = most;
  for (int k = 0; k < 3; ++k) {
    const double margin = 1.01 * (o_error[k] + most * d_error[k]) + 0x1p-46 * (far + reach) + 0x1p-100;
    if (std::fabs(d[k]) < 0x1p-60) d[k] = d[k] < 0 ? -0x1p-60 : 0x1p-60, d_error[k] += 0x1p-59;
    const double wide = margin + most * (d_error[k]);
    lo[k] = frame.lower[k] - wide;
    hi[k] = frame.upper[k] + wide;
  }
  if (!meets_box(o, d, lo, hi, start, end)) return RayReach::misses;
  const double length = (end - start) * (1 + 0x1p-40) + 0x1p-60;
  double d_1 = 0, off = 0, d_off = 0, largest = 0;
  for (int k = 0; k < 3; ++k) {
    const double from = o[k] + start * d[k];
    out.o[k] = static_cast<float>(from);
    out.d[k] = static_cast<float>(d[k]);
    out.inverse[k] = 1 / out.d[k];
    const double a = std::fabs(from - static_cast<double>(out.o[k])) + o_error[k] + start * d_error[k] +
                     4 * 0x1p-53 * (std::fabs(o[k]) + start * std::fabs(d[k]));
    const double b = std::fabs(d[k] - static_cast<double>(out.d[k])) + d_error[k];
    const double size = frame.reach[k] + std::fabs(static_cast<double>(out.o[k]));
    const double slack = 1.001 * (frame.error[k] + a + length * b) + 4.3 * 0x1p-24 * size + 0x1p-60;
    out.slack[k] = static_cast<float>(slack * (1 + 0x1p-20));
    d_1 += std::fabs(d[k]);
    if (frame.error[k] + a > off) off = frame.error[k] + a;
    if (b > d_off) d_off = b;
    if (size > largest) largest = size;
  }
  if (!(off <= kLargestInFrame && length <= kLargestInFrame)) return RayReach::out_of_range;
  const double s = static_cast<double>(frame.largest_error);
  out.edge_factor = rounded_up(1.001 * ((17 * 0x1p-24 * d_1 + 6.1 * d_off) * largest + 2.1 * d_1 * off));
  out.least_bound = rounded_up(1.001 * 4.3 * d_1 * s * (largest + off) + 0x1p-70);
  out.length = rounded_up(length);
  out.start = start;
  return RayReach::in_frame;
}

}  // namespace tandem
