#pragma once
#include <cmath>

#include "kernels/geometry/expansion.h"
#include "kernels/geometry/wide_integer.h"

/// These functions decide on which side of a plane or of a line a point lies: float32 and float64 with a
/// proven error bound, and exact. All of them are signs of volume(p, q, r, s) = det(q - p, r - p, s - p), the
/// scalar triple product, and of area(p, q, r) along an axis, a component of (q - p) x (r - p).
namespace tandem::detail {

/// Error bounds of determinants evaluated in Real, whose unit roundoff is u.
///
/// Model. Each operation gives its exact result times (1 + d), plus e: |d| <= u and |e| <= h, where h is the
/// smallest normal number. That covers gradual underflow, and results flushed to zero. Fusing a multiply and
/// an add only removes roundings.
///
/// Leaves. A leaf x is the difference of two float64 coordinates, rounded to Real: for float, a float64
/// difference rounded again, |d| <= u + 2^-53 + u 2^-53. Let m = |x as computed| + kFloor, as computed. Since
/// h <= 2^-94 kFloor, the error of the leaf is at most u m (1 + 5u): underflow drowns in kFloor.
///
/// Volume. Six products of three leaves each. A leaf brings one rounding, a minor's product and difference
/// two, the product with the third leaf one, the sum of three two: with three leaves 3 + 2 + 1 + 2 = 8. So
/// the error is at most ((1 + u)^8 - 1) (1 + 16u) P + underflow, where P, the permanent, is the sum of the
/// six products of the m. Underflow: h in a minor is at most 2^-62 of kFloor^2, that is of every product of
/// two m; in the products and sums of three at most 5h <= 5 * 2^-30 kFloor^3, where P >= 6 kFloor^3: below
/// 2^-30 P, 2^-6 u P for float and far less for double. Together below (8 + 1/32) u P. P is computed from
/// numbers >= 0 with at most 8 roundings and no underflow (kFloor^3 is normal), so P as computed is at least
/// (1 - u)^8 P, and its product with 9u at least 9u (1 - u)^9 P > (8 + 1/32) u P.
///
/// Area. Two products of two leaves: 2 + 1 + 1 = 4 roundings, and 5u (1 - u)^5 P > ((1 + u)^4 - 1)(1 + 16u) P
/// + underflow in the same way.
///
/// Overflow. No partial result exceeds the corresponding one of the permanent, because rounding is monotonic;
/// so where the determinant becomes infinite or NaN, the bound does, and no comparison with it holds. (Fused
/// operations move this by a few roundings at most, where the sign is beyond doubt.)
template <class Real>
struct Bound;

template <>
struct Bound<float> {
  static constexpr float kFloor = 0x1p-32f, kVolume = 9 * 0x1p-24f, kArea = 5 * 0x1p-24f;
};

template <>
struct Bound<double> {
  static constexpr double kFloor = 0x1p-320, kVolume = 9 * 0x1p-53, kArea = 5 * 0x1p-53;
};

template <class Real>
TANDEM_HD inline Real difference(double a, double b) {
  return static_cast<Real>(a - b);
}

/// The m of the proof.
template <class Real>
TANDEM_HD inline Real bounded_size(Real x) {
  return std::fabs(x) + Bound<Real>::kFloor;
}

/// The sign of a computed value, or 0 where it is uncertain.
template <class Real>
TANDEM_HD inline int certain_sign(Real value, Real bound) {
  return static_cast<int>(value > bound) - static_cast<int>(-value > bound);
}

template <class Real>
TANDEM_HD inline int computed_sign(Real value) {
  return static_cast<int>(value > 0) - static_cast<int>(value < 0);
}

/// The plane through p, q and r: the minors that volume(p, q, r, s) is made of, and their permanents.
template <class Real>
struct Plane {
  const double* origin;
  Real normal[3], size[3];

  TANDEM_HD Plane(const double* p, const double* q, const double* r) : origin(p) {
    Real u[3], v[3], mu[3], mv[3];
    for (int k = 0; k < 3; ++k) {
      u[k] = difference<Real>(q[k], p[k]);
      v[k] = difference<Real>(r[k], p[k]);
      mu[k] = bounded_size(u[k]);
      mv[k] = bounded_size(v[k]);
    }
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      normal[k] = u[i] * v[j] - u[j] * v[i];
      size[k] = mu[i] * mv[j] + mu[j] * mv[i];
    }
  }

  /// volume(p, q, r, s), rounded, and the bound of its error.
  TANDEM_HD Real volume(const double* s, Real& bound) const {
    const Real x = difference<Real>(s[0], origin[0]);
    const Real y = difference<Real>(s[1], origin[1]);
    const Real z = difference<Real>(s[2], origin[2]);
    bound = Bound<Real>::kVolume *
            (bounded_size(x) * size[0] + bounded_size(y) * size[1] + bounded_size(z) * size[2]);
    return x * normal[0] + y * normal[1] + z * normal[2];
  }

  /// The sign of volume(p, q, r, s), or 0 where it is uncertain.
  TANDEM_HD int side(const double* s) const {
    Real bound;
    const Real value = volume(s, bound);
    return certain_sign(value, bound);
  }
};

/// area(p, q, r) along axis k, rounded, and the bound of its error.
template <class Real>
TANDEM_HD inline Real area(const double* p, const double* q, const double* r, int k, Real& bound) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  const Real ui = difference<Real>(q[i], p[i]), uj = difference<Real>(q[j], p[j]);
  const Real vi = difference<Real>(r[i], p[i]), vj = difference<Real>(r[j], p[j]);
  bound = Bound<Real>::kArea * (bounded_size(ui) * bounded_size(vj) + bounded_size(uj) * bounded_size(vi));
  return ui * vj - uj * vi;
}

/// Returns whether each product of det(u, v, w) has a factor that is exactly zero, as where four points have
/// one coordinate in common. float64 numbers differ exactly when their difference as computed is not zero.
TANDEM_HD inline bool vanishes(const Between& u, const Between& v, const Between& w) {
  const bool u0 = u.to[0] != u.from[0], u1 = u.to[1] != u.from[1], u2 = u.to[2] != u.from[2];
  const bool v0 = v.to[0] != v.from[0], v1 = v.to[1] != v.from[1], v2 = v.to[2] != v.from[2];
  const bool w0 = w.to[0] != w.from[0], w1 = w.to[1] != w.from[1], w2 = w.to[2] != w.from[2];
  return !((w0 && ((u1 && v2) || (u2 && v1))) || (w1 && ((u2 && v0) || (u0 && v2))) ||
           (w2 && ((u0 && v1) || (u1 && v0))));
}

/// volume(p, q, r, s), rounded, with the exact sign. Of points out of the range of expansions only the sign
/// is known, and the result is 1, 0 or -1.
TANDEM_OUT_OF_LINE TANDEM_HD inline double rounded_volume(const double* p, const double* q, const double* r,
                                                          const double* s) {
  const Between u = {p, q}, v = {p, r}, w = {p, s};
  if (vanishes(u, v, w)) return 0;
  if (in_range(u) && in_range(v) && in_range(w)) return expansion_volume(u, v, w);
  return wide_volume_sign(u, v, w);
}

/// Signs of exact arithmetic, for all finite points: float64 where its bound allows, expansions in their
/// range, wide integers outside.
struct ExactSigns {
  TANDEM_HD static int volume(const double* p, const double* q, const double* r, const double* s) {
    const int sign = Plane<double>(p, q, r).side(s);
    return sign != 0 ? sign : volume_without_bound({p, q}, {p, r}, {p, s});
  }

  TANDEM_HD static int area(const double* p, const double* q, const double* r, int k) {
    double bound;
    const double value = detail::area<double>(p, q, r, k, bound);
    const int sign = certain_sign(value, bound);
    return sign != 0 ? sign : area_without_bound(p, q, r, k);
  }

  TANDEM_OUT_OF_LINE TANDEM_HD static int volume_without_bound(const Between& u, const Between& v,
                                                               const Between& w) {
    if (vanishes(u, v, w)) return 0;
    if (in_range(u) && in_range(v) && in_range(w)) return expansion_volume_sign(u, v, w);
    return wide_volume_sign(u, v, w);
  }

  TANDEM_OUT_OF_LINE TANDEM_HD static int area_without_bound(const double* p, const double* q,
                                                             const double* r, int k) {
    if (in_range(p) && in_range(q) && in_range(r)) return expansion_area_sign(p, q, r, k);
    return wide_area_sign(p, q, r, k);
  }
};

/// Signs as Real computes them: right where nothing is rounded.
template <class Real>
struct ComputedSigns {
  TANDEM_HD static int volume(const double* p, const double* q, const double* r, const double* s) {
    Real bound;
    return computed_sign(Plane<Real>(p, q, r).volume(s, bound));
  }

  TANDEM_HD static int area(const double* p, const double* q, const double* r, int k) {
    Real bound;
    return computed_sign(detail::area<Real>(p, q, r, k, bound));
  }
};

}  // namespace tandem::detail
