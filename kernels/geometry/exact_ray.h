#pragma once
#include <cfloat>
#include <cmath>

#include "kernels/geometry/exact_distance.h"
#include "kernels/geometry/wide_number.h"

/// Where a ray meets a triangle, in whole numbers, for any finite coordinates, on CPU and GPU.
///
/// The ray is the set of points o + t d with t >= 0; d is not 0. A triangle is closed; a flat one is the hull
/// of its corners. The parameter of a meeting is a quotient: with p the first corner less o, and n = e x f of
/// two edges, t = (p . n) / (d . n) where the ray crosses the plane. Where it lies in the plane, or the
/// triangle is flat, what is met is an interval of the ray; its first parameter is 0 or a quotient of smaller
/// degrees.
///
/// Coordinates of points have one unit, and those of the direction another: so every quotient is one of whole
/// numbers times the quotient of the units.
namespace tandem::exact {

/// t = numerator / denominator times the quotient of the units; 0 <= numerator, 0 < denominator.
template <int kWords>
struct RayTime {
  WideNumber<kWords, 3> numerator, denominator;
};

struct RayUnits {
  detail::ExponentRange points, direction;

  TANDEM_HD void include(const double (&corner)[3][3]) {
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) points.include(corner[i][k]);
    }
  }
  TANDEM_HD void include(const double* origin, const double* along) {
    for (int k = 0; k < 3; ++k) {
      points.include(origin[k]);
      direction.include(along[k]);
    }
  }
  TANDEM_HD int words() const {
    return points.words() < direction.words() ? direction.words() : points.words();
  }
  /// The exponent of what a quotient of whole numbers is multiplied by.
  TANDEM_HD int exponent() const {
    const int above = points.unit > points.largest ? 0 : points.unit;
    return above - direction.unit;
  }
};

/// The sign of |x| 2^shift - |y|.
template <int kWords, int kX, int kY>
TANDEM_HD inline int compare_scaled(const WideNumber<kWords, kX>& x, int shift,
                                    const WideNumber<kWords, kY>& y) {
  if (x.size() == 0 || y.size() == 0) return x.size() == y.size() ? 0 : x.size() != 0 ? 1 : -1;
  // The 32 bits of a number below a place, which may lie beyond its ends.
  const auto bits_below = [](const auto& number, int place) {
    std::uint32_t out = 0;
    for (int i = 1; i <= 32; ++i) {
      const int at = place - i;
      const std::uint32_t bit = at >= 0 ? number.word(at / 32) >> at % 32 & 1 : 0;
      out = out << 1 | bit;
    }
    return out;
  };
  const auto top_of = [](const auto& number) {
    int bit = 31;
    while (number.word(number.size() - 1) >> bit == 0) --bit;
    return 32 * (number.size() - 1) + bit + 1;
  };
  const int top_x = top_of(x), top_y = top_of(y);
  if (top_x + shift != top_y) return top_x + shift < top_y ? -1 : 1;
  for (int below = 0; below < top_x || below < top_y; below += 32) {
    const std::uint32_t of_x = bits_below(x, top_x - below), of_y = bits_below(y, top_y - below);
    if (of_x != of_y) return of_x < of_y ? -1 : 1;
  }
  return 0;
}

/// A ray and the triangles that it may meet, in the units that are given. units.words() <= kWords.
template <int kWords>
class ExactRay {
 public:
  template <int kDegree>
  using Number = WideNumber<kWords, kDegree>;
  template <int kDegree>
  using Vector = WideVector<kWords, kDegree>;

  TANDEM_HD ExactRay(const double* origin, const double* direction, const RayUnits& units)
      : origin_(origin), units_(units), n_(units.words() < 2 ? 2 : units.words()) {
    for (int k = 0; k < 3; ++k) d_.x[k].assign_difference(direction[k], 0, units.direction.unit, n_);
    one_.assign(std::uint64_t{1} << 52);
  }

  /// Finds the first parameter at which the ray meets a triangle, and where: the weights of corners 1 and 2.
  /// False: it does not meet it.
  TANDEM_HD bool find(const double (&corner)[3][3], RayTime<kWords>& out, double (&weight)[2]) {
    corner_ = &corner;
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < 3; ++i) {
        p_[i].x[k].assign_difference(corner[i][k], origin_[k], units_.points.unit, n_);
        e_[i].x[k].assign_difference(corner[(i + 1) % 3][k], corner[i][k], units_.points.unit, n_);
      }
    }
    assign_cross(e_[0], e_[1], normal_, term2_);
    assign_dot(d_, normal_, out.denominator, term3_);
    weight[0] = weight[1] = 0;
    if (out.denominator.sign() != 0) return find_crossing(out, weight);
    for (int k = 0; k < 3; ++k) {
      if (normal_.x[k].sign() != 0) return find_in_plane(k, out);
    }
    return find_on_segment(out);
  }

 private:
  /// The part of det(d, p, e) of an edge is the weight of the corner across from it. Numbers of one sign have
  /// the share that their magnitudes have.
  TANDEM_HD bool find_crossing(RayTime<kWords>& out, double (&weight)[2]) {
    const int sign = out.denominator.sign();
    for (int i = 0; i < 3; ++i) {
      assign_cross(p_[i], e_[i], across_, term2_);
      assign_dot(d_, across_, part_, term3_);
      if (part_.sign() * sign < 0) return false;
      if (i != 1) weight[i == 2 ? 0 : 1] = share(part_, out.denominator);
    }
    assign_dot(p_[0], normal_, out.numerator, term3_);
    if (out.numerator.sign() * sign < 0) return false;
    if (sign < 0) out.denominator.negate();
    if (out.numerator.sign() < 0) out.numerator.negate();
    return true;
  }

  /// out = u[i] v[j] - u[j] v[i], the part along axis k of a cross product.
  TANDEM_HD void assign_part(const Vector<1>& u, const Vector<1>& v, int k, Number<2>& out) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    out.assign_product(u.x[i], v.x[j]);
    term2_.assign_product(u.x[j], v.x[i]);
    out.subtract(term2_);
  }

  /// The sign of a / b - c / d, all of which are at least 0.
  TANDEM_HD int compare(const Number<2>& a, const Number<2>& b, const Number<2>& c, const Number<2>& d) {
    left_.assign_product(a, d);
    right_.assign_product(c, b);
    return Number<4>::compare_magnitudes(left_, right_);
  }

  /// A ray in the triangle's plane, of which axis k sees the front or the back. On the inner side of edge i a
  /// + t s >= 0, where s = (e x d)_k and a = -(e x p)_k, times the sign of the normal.
  TANDEM_HD bool find_in_plane(int k, RayTime<kWords>& out) {
    const bool turned = normal_.x[k].sign() < 0;
    Number<2> first, first_of, last, last_of;  // t from first / first_of to last / last_of
    first_of.assign_product(one_, one_);
    bool ends = false;
    for (int i = 0; i < 3; ++i) {
      assign_part(e_[i], d_, k, slope_);
      assign_part(e_[i], p_[i], k, height_);
      if (turned)
        slope_.negate();
      else
        height_.negate();
      if (slope_.sign() <= 0 && height_.sign() < 0) return false;
      if (slope_.sign() > 0 && height_.sign() < 0) {
        height_.negate();
        if (compare(height_, slope_, first, first_of) > 0) first = height_, first_of = slope_;
      } else if (slope_.sign() < 0) {
        slope_.negate();
        if (!ends || compare(height_, slope_, last, last_of) < 0) last = height_, last_of = slope_;
        ends = true;
      }
    }
    if (ends && compare(first, first_of, last, last_of) > 0) return false;
    out.numerator.assign_product(first, one_);
    out.denominator.assign_product(first_of, one_);
    return true;
  }

  /// A flat triangle, which is the hull of two of its corners, s from the first to the second. With p from
  /// the ray's origin to the first, o + t d = first + v s where t d x s = p x s and v d x s = p x d.
  TANDEM_HD bool find_on_segment(RayTime<kWords>& out) {
    int from = 0, to = 0;
    for (int k = 0; k < 3 && from == to; ++k) {
      for (int i = 1; i < 3; ++i) {
        if ((*corner_)[i][k] < (*corner_)[from][k]) from = i;
        if ((*corner_)[i][k] > (*corner_)[to][k]) to = i;
      }
      if ((*corner_)[from][k] == (*corner_)[to][k]) from = to = 0;
    }
    for (int k = 0; k < 3; ++k) {
      span_.x[k].assign_difference((*corner_)[to][k], (*corner_)[from][k], units_.points.unit, n_);
    }
    assign_cross(d_, span_, across_, term2_);
    assign_dot(p_[from], across_, part_, term3_);
    if (part_.sign() != 0) return false;
    for (int k = 0; k < 3; ++k) {
      if (across_.x[k].sign() != 0) return find_on_segment(p_[from], k, out);
    }
    return find_along_segment(from, to, out);
  }

  TANDEM_HD bool find_on_segment(const Vector<1>& p, int k, RayTime<kWords>& out) {
    Number<2>& of = across_.x[k];
    assign_part(p, span_, k, height_);
    assign_part(p, d_, k, slope_);
    if (of.sign() < 0) {
      of.negate();
      height_.negate();
      slope_.negate();
    }
    if (height_.sign() < 0 || !is_within(slope_, of)) return false;
    out.numerator.assign_product(height_, one_);
    out.denominator.assign_product(of, one_);
    return true;
  }

  /// A segment or point that is parallel to the ray.
  TANDEM_HD bool find_along_segment(int from, int to, RayTime<kWords>& out) {
    int k = 0;
    while (d_.x[k].sign() == 0) ++k;
    assign_cross(p_[from], d_, across_, term2_);
    for (int i = 0; i < 3; ++i) {
      if (across_.x[i].sign() != 0) return false;
    }
    const int sign = d_.x[k].sign();
    const int of_from = p_[from].x[k].sign() * sign, of_to = p_[to].x[k].sign() * sign;
    if (of_from < 0 && of_to < 0) return false;
    const bool from_first = Number<1>::compare_magnitudes(p_[from].x[k], p_[to].x[k]) < 0;
    Number<1> first = p_[from_first ? from : to].x[k], of = d_.x[k];
    if (of_from <= 0 || of_to <= 0) first = Number<1>();
    if (first.sign() < 0) first.negate();
    if (sign < 0) of.negate();
    height_.assign_product(first, one_);
    slope_.assign_product(of, one_);
    out.numerator.assign_product(height_, one_);
    out.denominator.assign_product(slope_, one_);
    return true;
  }

  const double* origin_;
  const double (*corner_)[3][3] = nullptr;
  const RayUnits& units_;
  int n_;
  Number<1> one_;
  Vector<1> d_, p_[3], e_[3], span_;
  Vector<2> normal_, across_;
  Number<2> term2_, slope_, height_;
  Number<3> term3_, part_;
  Number<4> left_, right_;
};

/// lower <= t <= upper, as float64 numbers that differ by at most 2^-49 of t, or by two of the least float64
/// numbers. Quotients have 2^-52 from each of the two numbers, and 2^-53 for rounding; 4 u are spared.
template <int kWords>
TANDEM_HD inline DistanceInterval interval_of(const RayTime<kWords>& time, const RayUnits& units) {
  if (time.numerator.sign() == 0) return {0, 0};
  constexpr double kSpare = 4 * 0x1p-53, kSmall = 0x1p-1000, kLeast = 0x1p-1074;
  const Scaled p = scaled(time.numerator), q = scaled(time.denominator);
  const int exponent = p.exponent - q.exponent + units.exponent();
  double lower = std::ldexp(p.lower / q.upper * (1 - kSpare), exponent);
  double upper = std::ldexp(p.upper / q.lower * (1 + kSpare), exponent);
  if (lower < kSmall) lower = lower > kLeast ? lower - kLeast : 0;
  if (upper < kSmall) upper += kLeast;
  if (lower > DBL_MAX) lower = DBL_MAX;
  return {lower, upper};
}

/// Finds where a ray first meets a triangle. Condition: units.words() <= kWords, of both.
template <int kWords>
TANDEM_OUT_OF_LINE TANDEM_HD inline bool find_meeting(const double* origin, const double* direction,
                                                      const double (&corner)[3][3], const RayUnits& units,
                                                      DistanceInterval& t, double (&weight)[2]) {
  ExactRay<kWords> ray(origin, direction, units);
  RayTime<kWords> time;
  if (!ray.find(corner, time, weight)) return false;
  t = interval_of(time, units);
  return true;
}

/// Compares where a ray first meets two triangles, both of which it meets: the sign of the difference.
template <int kWords>
TANDEM_OUT_OF_LINE TANDEM_HD inline int compare_meetings(const double* origin, const double* direction,
                                                         const double (&a)[3][3], const double (&b)[3][3],
                                                         const RayUnits& units) {
  ExactRay<kWords> ray(origin, direction, units);
  RayTime<kWords> of_a, of_b;
  double weight[2];
  ray.find(a, of_a, weight);
  ray.find(b, of_b, weight);
  WideNumber<kWords, 6> left, right;
  left.assign_product(of_a.numerator, of_b.denominator);
  right.assign_product(of_b.numerator, of_a.denominator);
  return WideNumber<kWords, 6>::compare_magnitudes(left, right);
}

/// Compares where a ray first meets a triangle, which it does, with a finite parameter that is not negative:
/// the sign of t - last.
template <int kWords>
TANDEM_OUT_OF_LINE TANDEM_HD inline int compare_with(const double* origin, const double* direction,
                                                     const double (&corner)[3][3], const RayUnits& units,
                                                     double last) {
  ExactRay<kWords> ray(origin, direction, units);
  RayTime<kWords> time;
  double weight[2];
  ray.find(corner, time, weight);
  if (last == 0) return time.numerator.sign();
  // nvcc 13 compiles assign_difference() with a constant 0 and number of words to twice the number.
  const detail::Magnitude of_last = detail::magnitude(last);
  WideNumber<kWords, 1> factor;
  WideNumber<kWords, 4> right;
  factor.assign(of_last.significand);
  right.assign_product(factor, time.denominator);
  return compare_scaled(time.numerator, units.exponent() - of_last.exponent, right);
}

}  // namespace tandem::exact
