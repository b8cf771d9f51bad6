#pragma once
#include <cmath>
#include <cstdint>

#include "tandem/formats/platform.h"
#include "tandem/kernels/pose.h"

/// How far the bodies of a pair have moved against each other, by one rule for CPU and GPU. Host code is
/// compiled with -ffp-contract=off and device code with --fmad=false, so that both give the same bits.
namespace tandem {

/// The box that bounds an asset.
struct AssetBox {
  double origin[3];
  double centre[3], half[3];  ///< stored coordinates; half: not less than the box's half-extents
  double squared;             ///< the sum of the squares of `half`: how large the asset is
};

/// lower, upper, origin: as a file's header has them.
inline AssetBox asset_box(const float (&lower)[3], const float (&upper)[3], const double (&origin)[3]) {
  AssetBox box = {};
  for (int k = 0; k < 3; ++k) {
    const double from = lower[k], to = upper[k], centre = 0.5 * (from + to);
    box.origin[k] = origin[k];
    box.centre[k] = centre;
    box.half[k] = std::fmax(to - centre, centre - from) * (1 + 0x1p-51);  // the difference was rounded
    box.squared += box.half[k] * box.half[k];
  }
  return box;
}

/// Returns whether two poses are the same: what they pose stands where it stood, to the last bit.
TANDEM_HD inline bool is_same(const Pose& x, const Pose& y) {
  bool same = true;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) same = same && x.rotation[i][j] == y.rotation[i][j];
    same = same && x.translation[i] == y.translation[i];
  }
  return same;
}

/// Two bodies, the larger first, in stored coordinates.
struct PosedPair {
  Pose larger, smaller;
};

namespace pair_motion_detail {

/// The place of the smaller body in the frame of the larger one, by the transposed rotation, which is the
/// inverse one of a rigid pose.
struct SmallerInLarger {
  double rotation[3][3], translation[3];
  double size;  ///< of the numbers that the translation is made of

  TANDEM_HD explicit SmallerInLarger(const PosedPair& pair) : size(0) {
    const auto &l = pair.larger.rotation, &s = pair.smaller.rotation;
    double apart[3];
    for (int k = 0; k < 3; ++k) {
      const double of_l = pair.larger.translation[k], of_s = pair.smaller.translation[k];
      apart[k] = of_s - of_l;
      size += std::fabs(of_s) + std::fabs(of_l);
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) rotation[i][j] = l[0][i] * s[0][j] + l[1][i] * s[1][j] + l[2][i] * s[2][j];
      translation[i] = l[0][i] * apart[0] + l[1][i] * apart[1] + l[2][i] * apart[2];
    }
  }
};

}  // namespace pair_motion_detail

/// Returns a bound of the way of every point of the smaller body, seen from the larger one: 0 if neither has
/// moved. box: the smaller body's. Condition: the poses are rigid, see is_rigid().
///
/// Proof. Let x = centre + y with |y[j]| <= half[j] be a point of the box, and M, m and N, n the place of the
/// smaller body in the larger one's frame then and now. Row i of the way (N x + n) - (M x + m) is at most
///
///   |((N - M) centre + (n - m))[i]| + sum over j of |(N - M)[i][j]| half[j],
///
/// and the way at most the root of the sum of the rows' squares. Rounding: let u = 2^-53, let c, h be the
/// lengths of centre and half, and t the sum of the translations' sizes, then and now. A column of a rigid
/// rotation is at most 1.000001 long.
/// - An entry of M or N is off by at most 3.01 u, as the lengths of two columns bound the products; an entry
///   of N - M, at most 2.01 large, by 8.1 u. An entry of m, n is off by 5.1 u times its part of t.
/// - So the first term of a row is off by 8.1 sqrt(3) u c + 4.1 u (2.01 sqrt(3) c + 1.01 t) + 6.2 u t <= u
/// (29
///   c + 12 t), the second by 8.1 sqrt(3) u h + 4.1 u 2.01 sqrt(3) h <= 29 u h. The roundings of their sum,
///   of squares and of the root are at most 6 u of the result.
/// - A query poses points in float64: a coordinate errs by 4.01 u (1.01 (c + h) + the translation), and so a
///   point by 7.1 u (c + h + t), then and now.
/// Three rows make sqrt(3) as much as one: u (sqrt(3) (29 c + 29 h + 12 t) + 14.2 (c + h + t)) < 2^-46 (c + h
/// + t). What underflows is less than 2^-900 in all, as stored coordinates are less than 2^128; where squares
/// may underflow, the sum of the rows bounds the way.
TANDEM_HD inline double pair_motion(const AssetBox& box, const PosedPair& then, const PosedPair& now) {
  if (is_same(then.larger, now.larger) && is_same(then.smaller, now.smaller)) return 0;
  const pair_motion_detail::SmallerInLarger before(then), after(now);
  double squared = 0, sum = 0, size = before.size + after.size;
  for (int i = 0; i < 3; ++i) {
    double at_centre = after.translation[i] - before.translation[i], beside = 0;
    for (int j = 0; j < 3; ++j) {
      const double turned = after.rotation[i][j] - before.rotation[i][j];
      at_centre += turned * box.centre[j];
      beside += std::fabs(turned) * box.half[j];
    }
    const double way = std::fabs(at_centre) + beside;
    squared += way * way;
    sum += way;
    size += std::fabs(box.centre[i]) + box.half[i];
  }
  return (squared > 0x1p-900 ? std::sqrt(squared) : sum) * (1 + 0x1p-50) + (0x1p-46 * size + 0x1p-900);
}

/// Returns whether the second body of a pair is the larger one.
TANDEM_HD inline bool second_is_larger(const AssetBox& a, const AssetBox& b) {
  return a.squared < b.squared;
}

/// The rule: whether a pair is taken as it was found, given where its bodies stood then and stand now, in the
/// coordinates of their files. Nothing is kept by a tolerance of 0.
TANDEM_HD inline bool is_kept(const AssetBox& a, const AssetBox& b, const Pose (&then)[2],
                              const Pose (&now)[2], double tolerance) {
  if (!(tolerance > 0)) return false;
  const bool b_larger = second_is_larger(a, b);
  const AssetBox &larger = b_larger ? b : a, &smaller = b_larger ? a : b;
  const int l = b_larger ? 1 : 0, s = 1 - l;
  const auto stored = [&](const Pose(&poses)[2]) {
    return PosedPair{for_stored_coordinates(poses[l], larger.origin),
                     for_stored_coordinates(poses[s], smaller.origin)};
  };
  return pair_motion(smaller, stored(then), stored(now)) <= tolerance;
}

}  // namespace tandem
