#pragma once
#include <array>
#include <cmath>

#include "kernels/geometry/orientation.h"
#include "meshing.h"

namespace tandem::build {

using Point2 = std::array<double, 2>;

/// Sign of (a - c) x (b - c) in float64 when that sign is certain, else 0.
///
/// Proof. With u = 2^-53, each difference carries a relative error of at most u (a subtraction never
/// underflows inexactly) and each product one more, so `left` and `right` are off by less than (3u + 3u^2 +
/// u^3) of their magnitude, and the final subtraction adds u of its result: |error| <= (3 + 16u) u (|left| +
/// |right|) (Shewchuk 1997, section 4.3), plus at most 2 * 2^-1075 when products underflow. The bound used,
/// 4u (|left| + |right|), exceeds the first part by more than 0.9 u (|left| + |right|), which is over 2^-1074
/// as soon as |left| + |right| > 2^-900. Overflow: an infinite product makes the bound infinite, and no value
/// compares greater than it; NaN compares false.
inline int certain_sign(double ax, double ay, double bx, double by, double cx, double cy) {
  const double left = (ax - cx) * (by - cy);
  const double right = (ay - cy) * (bx - cx);
  const double determinant = left - right;
  const double sum = std::abs(left) + std::abs(right);
  if (!(sum > 0x1p-900) || !(std::abs(determinant) > 0x1p-51 * sum)) return 0;
  return determinant > 0 ? 1 : -1;
}

/// Sign of the signed area of triangle a b c: 1 counter-clockwise, -1 clockwise, 0 on one line.
/// Exact for all finite coordinates, denormal and huge ones included.
inline int orientation(const Point2& a, const Point2& b, const Point2& c) {
  if (const int sign = certain_sign(a[0], a[1], b[0], b[1], c[0], c[1])) return sign;
  const Point p = {a[0], a[1], 0}, q = {b[0], b[1], 0}, r = {c[0], c[1], 0};
  return detail::ExactSigns::area(p.data(), q.data(), r.data(), 2);
}

/// Returns whether a, b and c lie exactly on one line (or on one point). Exact for all finite coordinates.
inline bool collinear(const Point& a, const Point& b, const Point& c) {
  // One projection with an area settles it; nearly every triangle leaves here.
  for (int u = 0, v = 1; u < 3; ++u, v = (v + 1) % 3)
    if (certain_sign(a[u], a[v], b[u], b[v], c[u], c[v]) != 0) return false;
  for (int k = 0; k < 3; ++k)
    if (detail::ExactSigns::area(a.data(), b.data(), c.data(), k) != 0) return false;
  return true;
}

}  // namespace tandem::build
