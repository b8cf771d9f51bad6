#pragma once
#include <cmath>

#include "kernels/geometry/exact_ray.h"
#include "kernels/geometry/orientation.h"
#include "tandem/kernels/ray_query.h"

/// Decides whether a ray meets a triangle, and which of two it meets first, exactly; for CPU and GPU. A
/// cascade: float64 with error bounds, then exact signs, then whole numbers (exact_ray.h).
///
/// **What decides.** Let p_i be corner i less the ray's origin, e_i the edge from corner i to the next, and
/// w_i = det(d, p_i, e_i). Their sum is d . n, n = e_0 x e_1. If two w have opposite signs, the ray's line
/// passes the triangle. If not, and not all are 0, d . n has their sign, and the line crosses the plane at t
/// = (p_0 . n) / (d . n), where the corner across from edge i has the weight w_i / (d . n). If all are 0, the
/// line lies in the triangle's plane, or the triangle is flat and in one plane with the line: exact_ray.h.
///
/// **Bounds.** All five determinants have leaves that are differences of two float64 numbers, or numbers as
/// given; so orientation.h bounds the error of each by 9 u P, u = 2^-53, P being the sum of six products of
/// three factors. Each factor is at most the largest of its vector, with kFloor added: P <= 6 x y z, and 9 u
/// P <= 54 u x y z; computed with 55 u, which the three roundings of the product cannot eat up.
///
/// The quotient t of N and D, off by at most a and b, is off by at most (a / |N| + b / |D|) (1 + 2^-30) of
/// itself and one rounding where both quotients are below 2^-32. A weight w / D, w off by c, is off by (c +
/// b) / |D| (1 + 2^-30), as |w / D| <= 1, and one rounding.
namespace tandem::ray {

/// A float64 result counts if it is surely so near.
inline constexpr double kSureTime = kRayTimeError / 4, kSureWeight = kRayWeightError / 4;

/// The meeting of a ray and a triangle: its parameter is in `t`, the weights of corners 1 and 2 are rounded.
struct Meeting {
  DistanceInterval t;
  double weight[2];
};

/// The determinants of the proof, as float64 has them.
struct Volumes {
  double side[3], height, slope;  ///< w, N = p_0 . n and D = d . n
  double side_error, height_error, slope_error;
};

TANDEM_HD inline double largest_of(const double (&x)[3]) {
  const double a = std::fabs(x[0]), b = std::fabs(x[1]), c = std::fabs(x[2]);
  const double larger = a < b ? b : a;
  return larger < c ? c : larger;
}

TANDEM_HD inline void take_cross(const double (&u)[3], const double (&v)[3], double (&out)[3]) {
  out[0] = u[1] * v[2] - u[2] * v[1];
  out[1] = u[2] * v[0] - u[0] * v[2];
  out[2] = u[0] * v[1] - u[1] * v[0];
}

TANDEM_HD inline double dot_of(const double* u, const double* v) {
  return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
}

TANDEM_HD inline Volumes volumes_of(const double (&origin)[3], const double (&direction)[3],
                                    const double (&corner)[3][3]) {
  double p[3][3], e[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      p[i][k] = corner[i][k] - origin[k];
      e[i][k] = corner[(i + 1) % 3][k] - corner[i][k];
    }
  }
  Volumes out;
  double of_p = 0, of_e = 0;
  for (int i = 0; i < 3; ++i) {
    double across[3];
    take_cross(p[i], e[i], across);
    out.side[i] = dot_of(direction, across);
    const double next_p = largest_of(p[i]), next_e = largest_of(e[i]);
    // NaN and infinity stay, so that nothing is decided by them.
    of_p = next_p <= of_p ? of_p : next_p;
    of_e = next_e <= of_e ? of_e : next_e;
  }
  double normal[3];
  take_cross(e[0], e[1], normal);
  out.height = dot_of(p[0], normal);
  out.slope = dot_of(direction, normal);
  constexpr double kFloor = detail::Bound<double>::kFloor, kFactor = 55 * 0x1p-53;
  of_p += kFloor;
  of_e += kFloor;
  const double of_d = largest_of(direction) + kFloor;
  out.side_error = kFactor * of_d * of_p * of_e;
  out.height_error = kFactor * of_p * of_e * of_e;
  out.slope_error = kFactor * of_d * of_e * of_e;
  return out;
}

TANDEM_HD inline int exact_side(const double (&origin)[3], const double (&direction)[3],
                                const double (&corner)[3][3], int i) {
  const double zero[3] = {0, 0, 0};
  return detail::ExactSigns::volume_without_bound({zero, direction}, {origin, corner[i]},
                                                  {corner[i], corner[(i + 1) % 3]});
}

/// The words of a coordinate with which exact arithmetic is quick. Functions that take kWords decide what
/// needs no more than these (words_of()); the most decide everything.
inline constexpr int kFewWords = 8;

TANDEM_HD inline int words_of(const double (&origin)[3], const double (&direction)[3],
                              const double (&a)[3][3], const double (&b)[3][3]) {
  exact::RayUnits units;
  units.include(origin, direction);
  units.include(a);
  units.include(b);
  return units.words();
}

/// The first parameter and the weights in whole numbers. False: the ray does not meet the triangle.
template <int kWords>
TANDEM_OUT_OF_LINE TANDEM_HD inline bool find_exactly(const double (&origin)[3], const double (&direction)[3],
                                                      const double (&corner)[3][3], Meeting& out) {
  exact::RayUnits units;
  units.include(origin, direction);
  units.include(corner);
  if constexpr (kWords > kFewWords) {
    if (units.words() > kFewWords)
      return exact::find_meeting<kWords>(origin, direction, corner, units, out.t, out.weight);
  }
  return exact::find_meeting<kFewWords>(origin, direction, corner, units, out.t, out.weight);
}

/// The sign of the difference of the parameters at which a ray meets two triangles, both of which it meets.
template <int kWords = detail::kMaxWords>
TANDEM_OUT_OF_LINE TANDEM_HD inline int compare_exactly(const double (&origin)[3],
                                                        const double (&direction)[3], const double (&a)[3][3],
                                                        const double (&b)[3][3]) {
  exact::RayUnits units;
  units.include(origin, direction);
  units.include(a);
  units.include(b);
  if constexpr (kWords > kFewWords) {
    if (units.words() > kFewWords) return exact::compare_meetings<kWords>(origin, direction, a, b, units);
  }
  return exact::compare_meetings<kFewWords>(origin, direction, a, b, units);
}

/// Returns whether a ray meets a triangle, which it does, at a parameter of at most `last`, which is finite.
template <int kWords>
TANDEM_OUT_OF_LINE TANDEM_HD inline bool is_within_exactly(const double (&origin)[3],
                                                           const double (&direction)[3],
                                                           const double (&corner)[3][3], double last) {
  exact::RayUnits units;
  units.include(origin, direction);
  units.include(corner);
  if constexpr (kWords > kFewWords) {
    if (units.words() > kFewWords)
      return exact::compare_with<kWords>(origin, direction, corner, units, last) <= 0;
  }
  return exact::compare_with<kFewWords>(origin, direction, corner, units, last) <= 0;
}

/// What float64 tells of a meeting. False: it is not sure enough.
TANDEM_HD inline bool find_surely(const Volumes& v, Meeting& out) {
  const double size = std::fabs(v.slope), height = std::fabs(v.height);
  const double time_error = v.height_error / height + v.slope_error / size;
  const double weight_error = (v.side_error + v.slope_error) / size;
  if (!(time_error <= kSureTime && weight_error <= kSureWeight)) return false;
  const double t = height / size, off = 1.01 * time_error + 0x1p-51;
  if (!(t > 0x1p-900 && t < 0x1p900)) return false;
  out.t = {t * (1 - off), t * (1 + off)};
  const double b = v.side[2] / v.slope, c = v.side[0] / v.slope;
  out.weight[0] = b < 0 ? 0 : b > 1 ? 1 : b;
  out.weight[1] = c < 0 ? 0 : c > 1 ? 1 : c;
  return true;
}

/// Says what one stage knows.
enum class Answer : std::uint8_t { no, yes, unsure };

/// Says whether a ray meets a triangle, and where first, as far as float64 is sure. v: as of volumes_of().
TANDEM_HD inline Answer find_by_float64(const Volumes& v, Meeting& out) {
  int most = 0, least = 0, unsure = 0;
  for (int i = 0; i < 3; ++i) {
    const int sign = detail::certain_sign(v.side[i], v.side_error);
    most = sign > most ? sign : most;
    least = sign < least ? sign : least;
    unsure += sign == 0;
  }
  if (most > 0 && least < 0) return Answer::no;
  if (unsure > 0) return Answer::unsure;
  const int height = detail::certain_sign(v.height, v.height_error) * (most + least);
  if (height < 0) return Answer::no;
  return height > 0 && find_surely(v, out) ? Answer::yes : Answer::unsure;
}

/// Returns whether a ray meets a triangle, and where first. Finite coordinates; the direction is not 0.
template <int kWords = detail::kMaxWords>
TANDEM_HD inline bool find_meeting(const double (&origin)[3], const double (&direction)[3],
                                   const double (&corner)[3][3], Meeting& out) {
  const Volumes v = volumes_of(origin, direction, corner);
  if (const Answer answer = find_by_float64(v, out); answer != Answer::unsure) return answer == Answer::yes;
  int most = 0, least = 0;
  for (int i = 0; i < 3; ++i) {
    int sign = detail::certain_sign(v.side[i], v.side_error);
    if (sign == 0) sign = exact_side(origin, direction, corner, i);
    most = sign > most ? sign : most;
    least = sign < least ? sign : least;
    if (most > 0 && least < 0) return false;
  }
  const int across = most + least;
  if (across == 0) return find_exactly<kWords>(origin, direction, corner, out);
  const int height = detail::certain_sign(v.height, v.height_error) * across;
  if (height < 0) return false;
  return (height > 0 && find_surely(v, out)) || find_exactly<kWords>(origin, direction, corner, out);
}

/// Says whether a meeting, which there is, lies at most at a parameter, as far as float64 is sure.
TANDEM_HD inline Answer is_within_by_float64(const Meeting& meeting, double last) {
  if (meeting.t.upper <= last) return Answer::yes;
  return meeting.t.lower <= last ? Answer::unsure : Answer::no;
}

/// Returns whether a meeting, which there is, lies at most at a parameter; it may be infinite.
template <int kWords = detail::kMaxWords>
TANDEM_HD inline bool is_within(const double (&origin)[3], const double (&direction)[3],
                                const double (&corner)[3][3], const Meeting& meeting, double last) {
  const Answer answer = is_within_by_float64(meeting, last);
  if (answer != Answer::unsure) return answer == Answer::yes;
  return is_within_exactly<kWords>(origin, direction, corner, last);
}

/// A hit of a ray, and what tells it from others.
struct FoundHit {
  Meeting meeting;
  std::uint32_t body, triangle;
};

/// Says whether a hit comes before another one, as far as float64 is sure.
TANDEM_HD inline Answer comes_before_by_float64(const FoundHit& x, const FoundHit& y) {
  if (x.meeting.t.upper < y.meeting.t.lower) return Answer::yes;
  return y.meeting.t.upper < x.meeting.t.lower ? Answer::no : Answer::unsure;
}

/// Returns whether a hit, of a triangle with these corners, comes before another one: by the parameter, the
/// body and the triangle.
template <int kWords = detail::kMaxWords>
TANDEM_HD inline bool comes_before_exactly(const double (&origin)[3], const double (&direction)[3],
                                           const FoundHit& x, const double (&of_x)[3][3], const FoundHit& y,
                                           const double (&of_y)[3][3]) {
  const int order = compare_exactly<kWords>(origin, direction, of_x, of_y);
  if (order != 0) return order < 0;
  return x.body != y.body ? x.body < y.body : x.triangle < y.triangle;
}

}  // namespace tandem::ray
