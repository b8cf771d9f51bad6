#pragma once
#include <cmath>
#include <cstdint>

#include "kernels/geometry/box_distance.h"
#include "kernels/geometry/ray_triangle.h"
#include "kernels/geometry/relative_pose.h"
#include "kernels/geometry/wide_integer.h"
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
/// body's. A ray takes one bound for all three axes: n is the largest sum of |N_ij| along a row, f the
/// largest |p - t|_j.
/// - The origin's image is off by at most 4.1 u' n f, the direction's by 8.2 u' n, as its coordinates are
///   below 2.
/// - A coordinate of the direction's image below 2^-60 becomes 2^-60, so that its inverse is finite: 2^-60
///   more.
/// - The image of the point at tau_0 has two roundings, of at most u' (n f + 4 n tau_0) each.
/// - As float32 numbers, o is off by at most 1.01 u of its largest coordinate more, and d likewise.
/// The sums are a and b: a point of the ray at tau_0 + tau is o + tau d in float32 numbers, off by at most a
/// + length b.
///
/// Box test: with m = (c - o) / d and r = (h + slack) / |d|, the ray is in the box from m - r to m + r along
/// each axis. m as computed is off by 3.1 u |c - o| / |d|, r by 3.1 u of itself, and each difference by u
/// (|m| + r). In coordinates, multiplied by |d|, that is below 4.2 u (|c - o| + h + slack) <= 4.2 u (reach +
/// |o| + slack). With the largest of all axes, slack = 1.001 (error + a + length b) + 4.3 u (reach + |o|). So
/// if a triangle below a node has a point of the ray at tau, the largest of the lower ends as computed is at
/// most tau, and the least of the upper ends at least tau.
///
/// Triangle test: w_i of ray_triangle.h, of corners less o, in float32. A coordinate of p_i = v_i - o is off
/// by at most E = error + a and u |p|; one of an edge by 2 S, S = error, and u |e|; one of d by B = b. With
/// P, e and D the largest magnitudes of coordinates, or bounds of them, D_1 >= sum |d_k|, a coordinate of p x
/// e is off by at most 2 ((u P + E) e + P (u e + 2 S) + (u P + E) (u e + 2 S)) for its factors and 3.1 u 2 P
/// e for its rounding; and w by D_1 times that, B 3 (2 P e) for d, and 3.1 u D_1 2 P e for rounding. All
/// together, below
///
///     e ((17 u D_1 + 6.1 B) P + 2.1 D_1 E) + 4.3 D_1 S (P + E).
///
/// The bound as computed has 1.001 for its roundings, and 2^-70 for underflow: factors are below 2^33.
namespace tandem {

/// The functions that templates over Real call for one float64 number; ray_lanes.h has them for several.
namespace float64 {

TANDEM_HD inline bool less(double x, double y) {
  return x < y;
}
TANDEM_HD inline bool at_most(double x, double y) {
  return x <= y;
}
TANDEM_HD inline double select(bool mask, double x, double y) {
  return mask ? x : y;
}
TANDEM_HD inline double magnitude(double x) {
  return std::fabs(x);
}
TANDEM_HD inline float narrowed(double x) {
  return static_cast<float>(x);
}
TANDEM_HD inline double widened(float x) {
  return static_cast<double>(x);
}

/// The power of two that takes a positive float64 number to [1, 2), or subnormal ones to less.
TANDEM_HD inline double scale_to_one(double x) {
  const auto exponent = static_cast<int>(detail::bits_of(x) >> 52);
  return detail::float64_of(static_cast<std::uint64_t>(2046 - (exponent > 1 ? exponent : 1)) << 52);
}

}  // namespace float64

/// A body as points and rays see it.
struct LocalFrame : FrameLengths {
  double inverse[3][3];  ///< N
  double translation[3];
  double error[3];
  double reach[3];
  double lower[3], upper[3];      ///< bounds of the images of posed vertices
  double most_reach, most_error;  ///< of the three axes
  double row_sum;                 ///< n, rounded up
  bool in_range;                  ///< float32 can take the body
};

TANDEM_HD inline LocalFrame local_frame(const Pose& pose, const TreeExtent& extent, const float (&lower)[3],
                                        const float (&upper)[3]) {
  constexpr double kU64 = relative_pose_detail::kU64;
  LocalFrame out;
  relative_pose_detail::invert(pose.rotation, out.inverse);
  out.in_range = bound_lengths(out.inverse, 0, out);
  out.most_reach = out.most_error = out.row_sum = 0;
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
    const double sum =
        (std::fabs(out.inverse[i][0]) + std::fabs(out.inverse[i][1])) + std::fabs(out.inverse[i][2]);
    if (!(sum <= out.row_sum)) out.row_sum = sum * (1 + 0x1p-40);
    if (!(out.error[i] <= out.most_error)) out.most_error = out.error[i];
    if (!(out.reach[i] <= out.most_reach)) out.most_reach = out.reach[i];
    out.in_range = out.in_range && extent.reach[i] <= kLargestInFrame / 4;
  }
  out.in_range = out.in_range && out.most_error <= kLargestInFrame / 4;
  return out;
}

/// N v.
template <typename Real>
TANDEM_HD inline void take_image(const LocalFrame& frame, const Real (&v)[3], Real (&out)[3]) {
  for (int i = 0; i < 3; ++i)
    out[i] = (frame.inverse[i][0] * v[0] + frame.inverse[i][1] * v[1]) + frame.inverse[i][2] * v[2];
}

/// A point as float32 has it in a body's frame.
struct LocalPoint {
  float q[3], slack[3];
  float error;  ///< E of frame_distance.h: max of error_i + a_i
};

/// False: float32 cannot take it.
TANDEM_HD inline bool local_point(const LocalFrame& frame, const double (&p)[3], LocalPoint& out) {
  double v[3], image[3], largest = 0;
  for (int k = 0; k < 3; ++k) v[k] = p[k] - frame.translation[k];
  take_image(frame, v, image);
  bool in_range = frame.in_range;
  for (int k = 0; k < 3; ++k) {
    in_range = in_range && std::fabs(image[k]) <= kLargestInFrame / 4;
    const float q = in_range ? static_cast<float>(image[k]) : 0;
    const double error =
        4.1 * 0x1p-53 *
            ((std::fabs(frame.inverse[k][0] * v[0]) + std::fabs(frame.inverse[k][1] * v[1])) +
             std::fabs(frame.inverse[k][2] * v[2])) +
        0x1p-990;
    const double off = frame.error[k] + std::fabs(image[k] - static_cast<double>(q)) + error;
    const double slack =
        1.001 * off + 2.1 * 0x1p-24 * (frame.reach[k] + std::fabs(static_cast<double>(q))) + 0x1p-60;
    out.q[k] = q;
    out.slack[k] = static_cast<float>(slack * (1 + 0x1p-20));
    if (!(off <= largest)) largest = off;
  }
  out.error = static_cast<float>(largest * (1 + 0x1p-20) + 0x1p-60);
  return in_range;
}

/// A ray of the world, ready for bodies; Real: double, or a vector with a ray in each lane.
template <typename Real>
struct WorldRayOf {
  Real origin[3], direction[3];
  Real scaled[3];   ///< the direction times `factor`
  Real inverse[3];  ///< 1 / scaled
  Real factor;      ///< a power of two; a parameter is one of the scaled ray times this
  double reach;
};
using WorldRay = WorldRayOf<double>;

/// Makes a ray ready that has an origin, a direction and a reach.
template <typename Real>
TANDEM_HD inline void make_ready(WorldRayOf<Real>& ray) {
  using float64::at_most, float64::less, float64::magnitude, float64::scale_to_one, float64::select;
  Real largest = 0.0;
  for (int k = 0; k < 3; ++k) {
    const Real size = magnitude(ray.direction[k]);
    largest = select(less(largest, size), size, largest);
  }
  ray.factor = scale_to_one(largest);
  for (int k = 0; k < 3; ++k) {
    const Real along = ray.direction[k], scaled = along * ray.factor, size = magnitude(scaled);
    // Only what is exactly 0 stays so.
    const Real least = select(less(along, 0.0), Real(-0x1p-1000), Real(0x1p-1000));
    const auto vanished = less(0.0, magnitude(along)) & at_most(size, 0.0);
    ray.scaled[k] = select(vanished, least, scaled);
    ray.inverse[k] = 1.0 / ray.scaled[k];
  }
}

TANDEM_HD inline WorldRay world_ray(const double* origin, const double* direction, double reach) {
  WorldRay ray;
  for (int k = 0; k < 3; ++k) {
    ray.origin[k] = origin[k];
    ray.direction[k] = direction[k];
  }
  ray.reach = reach;
  make_ready(ray);
  return ray;
}

/// Takes the part of a ray that an interval along an axis leaves, before rounding.
template <typename Real>
TANDEM_HD inline void cut_to_slab(const Real& origin, const Real& inverse, const Real& lo, const Real& hi,
                                  Real& near, Real& far) {
  using float64::less, float64::select;
  const Real from = (lo - origin) * inverse, to = (hi - origin) * inverse;
  const auto ascends = less(from, to);
  const Real least = select(ascends, from, to), most = select(ascends, to, from);
  near = select(less(near, least), least, near);
  far = select(less(most, far), most, far);
}

/// Rounds the part outward. A bound along an axis has three roundings, and 2^-50 is spared; rounding keeps
/// the order of numbers, so that the largest is rounded in place of each. Returns whether anything is left of
/// first to last, which are made to be that.
template <typename Real>
TANDEM_HD inline auto leaves_part(const Real& near, const Real& far, Real& first, Real& last) {
  using float64::at_most, float64::less, float64::select;
  constexpr double kLess = 1 - 0x1p-50, kMore = 1 + 0x1p-50;
  const Real from = near * select(less(0.0, near), Real(kLess), Real(kMore)) - 0x1p-1000;
  const Real to = far * select(less(0.0, far), Real(kMore), Real(kLess)) + 0x1p-1000;
  first = select(less(first, from), from, first);
  last = select(less(to, last), to, last);
  return at_most(first, last);
}

/// Returns whether a ray may meet a box: the parameters are bounds of the part of the scaled ray that does. A
/// ray whose coordinate does not change along an axis is compared with the box there.
template <typename Real>
TANDEM_HD inline auto meets_box(const WorldRayOf<Real>& ray, const double* lo, const double* hi, Real& first,
                                Real& last) {
  using float64::at_most, float64::less, float64::magnitude, float64::select;
  Real near = -HUGE_VAL, far = HUGE_VAL;
  auto beside = less(Real(0.0), 0.0);
  for (int k = 0; k < 3; ++k) {
    Real from = near, to = far;
    cut_to_slab<Real>(ray.origin[k], ray.inverse[k], lo[k], hi[k], from, to);
    // Along the whole ray, up to 2^1000, it moves by less than 2^100.
    const Real size = magnitude(ray.scaled[k]);
    const auto moves = !less(size, 0x1p-900);
    near = select(moves, from, near);
    far = select(moves, to, far);
    const auto rests = at_most(size, 0.0);
    beside = beside | (rests & (less(ray.origin[k], lo[k]) | less(hi[k], ray.origin[k])));
  }
  const auto enters = !beside;
  return leaves_part(near, far, first, last) & enters;
}

/// This has as many float32 numbers as a Real has float64 numbers.
template <typename Real>
struct SingleOf;
template <>
struct SingleOf<double> {
  using Type = float;
};

/// A ray as float32 has it in a body's frame.
template <typename Real>
struct LocalRayOf {
  using Single = typename SingleOf<Real>::Type;

  Single o[3], d[3], inverse[3];
  Single slack;                     ///< of the box test, along every axis
  Single length;                    ///< tau_1 - tau_0, rounded up
  Single edge_factor, least_bound;  ///< of the triangle test: least_bound + edge_factor e
  Real start;                       ///< tau_0
};
using LocalRay = LocalRayOf<double>;

enum class RayReach : std::uint8_t { misses, in_frame, out_of_range };

template <typename Real>
TANDEM_HD inline auto rounded_up(const Real& x) {
  using float64::less, float64::narrowed, float64::select;
  return narrowed(select(less(x, 0x1p120), x * (1 + 0x1p-22) + 0x1p-100, Real(HUGE_VAL)));
}

/// The parameter of the local ray that a parameter of the world's is at most.
TANDEM_HD inline float local_limit(const WorldRay& world, const LocalRay& ray, double t) {
  const double limit = t / world.factor;
  const double left = (limit - ray.start) + 0x1p-50 * (limit + ray.start);
  if (!(left > 0)) return 0x1p-100f;
  const float out = rounded_up(left);
  return out < ray.length ? out : ray.length;
}

/// The part of a ray in a body's frame that may meet the body, in float64.
template <typename Real>
struct CutRay {
  Real o[3], d[3];
  Real o_error;  ///< of a coordinate of `o`
  Real far;      ///< f
  Real start, length;
};

TANDEM_HD inline double direction_error(const LocalFrame& frame) {
  return 8.4 * 0x1p-53 * frame.row_sum + 0x1p-59;
}

/// Cuts a ray to a body whose frame is in range. last: the greatest parameter of the world's ray that counts.
/// Returns whether anything is left; `in_range`: whether float64 can tell.
template <typename Real, typename Mask>
TANDEM_HD inline Mask cut_ray(const LocalFrame& frame, const WorldRayOf<Real>& world, const Real& last,
                              CutRay<Real>& out, Mask& in_range) {
  using float64::at_most, float64::less, float64::magnitude, float64::select;
  Real v[3], largest = 0.0;
  out.far = 0.0;
  for (int k = 0; k < 3; ++k) {
    v[k] = world.origin[k] - frame.translation[k];
    const Real size = magnitude(v[k]), along = magnitude(world.scaled[k]);
    out.far = select(less(out.far, size), size, out.far);
    largest = select(less(largest, along), along, largest);
  }
  in_range = at_most(out.far, 0x1p200) & at_most(1.0, largest);
  take_image(frame, v, out.o);
  take_image(frame, world.scaled, out.d);
  out.o_error = 4.2 * 0x1p-53 * frame.row_sum * out.far + 0x1p-990;
  // The largest coordinate of d is above 1/2, so what is in the body's box has parameters below this.
  const Real size = out.far + frame.most_reach, most = 8.0 * size;
  const Real margin = 1.01 * (out.o_error + most * direction_error(frame)) + 0x1p-46 * size + 0x1p-100;
  Real near = -HUGE_VAL, beyond = HUGE_VAL, end = last / world.factor;
  end = select(less(end, most), end, most);
  for (int k = 0; k < 3; ++k) {
    Real& d = out.d[k];
    const Real least = select(less(d, 0.0), Real(-0x1p-60), Real(0x1p-60));
    d = select(less(magnitude(d), 0x1p-60), least, d);
    cut_to_slab<Real>(out.o[k], 1.0 / d, frame.lower[k] - margin, frame.upper[k] + margin, near, beyond);
  }
  out.start = 0.0;
  const Mask meets = leaves_part(near, beyond, out.start, end);
  out.length = (end - out.start) * (1 + 0x1p-40) + 0x1p-60;
  return meets;
}

/// Rounds a ray to float32. Returns whether float32 can take it.
template <typename Real>
TANDEM_HD inline auto round_ray(const LocalFrame& frame, const CutRay<Real>& cut, LocalRayOf<Real>& out) {
  using float64::at_most, float64::less, float64::magnitude, float64::narrowed, float64::select,
      float64::widened;
  using Single = typename LocalRayOf<Real>::Single;
  const double d_error = direction_error(frame);
  Real largest_o = 0.0, largest_d = 0.0, d_1 = 0.0;
  for (int k = 0; k < 3; ++k) {
    out.o[k] = narrowed(cut.o[k] + cut.start * cut.d[k]);
    out.d[k] = narrowed(cut.d[k]);
    out.inverse[k] = (Single{} + 1.0f) / out.d[k];
    const Real o_size = magnitude(widened(out.o[k])), d_size = magnitude(cut.d[k]);
    largest_o = select(less(largest_o, o_size), o_size, largest_o);
    largest_d = select(less(largest_d, d_size), d_size, largest_d);
    d_1 = d_1 + d_size;
  }
  const Real a = 1.01 * 0x1p-24 * largest_o + (cut.o_error + cut.start * d_error) +
                 0x1p-51 * frame.row_sum * (cut.far + 4.0 * cut.start) + 0x1p-120;
  const Real b = 1.01 * 0x1p-24 * largest_d + d_error;
  const Real off = frame.most_error + a, reach = frame.most_reach + largest_o;
  out.slack = rounded_up(1.001 * (off + cut.length * b) + 4.3 * 0x1p-24 * reach + 0x1p-60);
  out.edge_factor = rounded_up(1.001 * ((17 * 0x1p-24 * d_1 + 6.1 * b) * reach + 2.1 * d_1 * off));
  out.least_bound = rounded_up(1.001 * 4.3 * d_1 * frame.most_error * (reach + off) + 0x1p-70);
  out.length = rounded_up(cut.length);
  out.start = cut.start;
  constexpr double kLargest = kLargestInFrame;
  return at_most(off, kLargest) & at_most(cut.length, kLargest);
}

/// last: the greatest parameter of the world's ray that counts.
TANDEM_HD inline RayReach local_ray(const LocalFrame& frame, const WorldRay& world, double last,
                                    LocalRay& out) {
  if (!frame.in_range) return RayReach::out_of_range;
  CutRay<double> cut;
  bool in_range;
  const bool meets = cut_ray(frame, world, last, cut, in_range);
  if (!in_range) return RayReach::out_of_range;
  if (!meets) return RayReach::misses;
  return round_ray(frame, cut, out) ? RayReach::in_frame : RayReach::out_of_range;
}

}  // namespace tandem
