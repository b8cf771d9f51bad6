#pragma once
#include "kernels/geometry/expansion.h"
#include "kernels/geometry/triangle_distance.h"

/// How far points lie along a direction, nearly exactly, for CPU and GPU. What lies flat on both sides of a
/// plane has the same distance everywhere; where that is small beside the bodies, float64 cannot tell it.
///
/// **Proof.** For n.x - c, let u = 2^-53 and S = |c| + sum |n_k x_k|. Products and the running sum of their
/// upper halves are exact as pairs of numbers. The six lower halves are below u S each, as is each partial
/// sum of them below 6 u S, so their five additions err by less than 30 u^2 S, and S as computed is too small
/// by less than 4 u of itself. One addition at the end rounds by u of the result. Underflow adds less than 30
/// 2^-1074. So both ends are right with 2^-51 of the result, which has another u for rounding the end, 2^-100
/// S and 2^-1000. Beyond S = 2^900, where halves could overflow, nothing is known.
namespace tandem::distance {

/// Bounds of n.x - c.
struct Height {
  double low, high;
};

TANDEM_HD inline Height height_along(const Point<double>& n, const double (&x)[3], double c) {
  double sum = -c, rest = 0, size = std::fabs(c);
  for (int k = 0; k < 3; ++k) {
    const detail::Rounded product = detail::two_product(n.x[k], x[k]);
    const detail::Rounded next = detail::two_sum(sum, product.high);
    sum = next.high;
    rest = detail::plus(rest, detail::plus(next.low, product.low));
    size += std::fabs(product.high);
  }
  if (!(size <= 0x1p900)) return {-INFINITY, INFINITY};
  const double value = detail::plus(sum, rest);
  const double error = 0x1p-51 * std::fabs(value) + (0x1p-100 * size + 0x1p-1000);
  return {value - error, value + error};
}

/// The least and the largest height of a triangle's corners.
TANDEM_HD inline Height height_along(const Point<double>& n, const double (&corner)[3][3], double c) {
  Height out = height_along(n, corner[0], c);
  for (int i = 1; i < 3; ++i) {
    const Height next = height_along(n, corner[i], c);
    if (next.low < out.low) out.low = next.low;
    if (next.high > out.high) out.high = next.high;
  }
  return out;
}

/// A direction, and the height from which heights along it are told.
struct Direction {
  Point<double> n;   ///< its largest coordinate is from 1 to 2; or 0, and then nothing is known
  double c = 0;      ///< n.x of some point near both bodies, so that differences are small numbers
  double scale = 0;  ///< 1 / |n|, rounded down
};

TANDEM_HD inline Direction direction_along(const Point<double>& direction, const double (&near)[3]) {
  Direction out = {{{0, 0, 0}}};
  const double size = std::fabs(direction.x[0]) + std::fabs(direction.x[1]) + std::fabs(direction.x[2]);
  if (!(size >= 0x1p-600 && size <= 0x1p900)) return out;
  out.n = normalised(direction);
  out.c = dot(out.n, {{near[0], near[1], near[2]}});
  out.scale = 1 / std::sqrt(dot(out.n, out.n)) * (1 - 0x1p-48);
  return out;
}

/// Returns how far apart points are that lie at least at one height and at most at another, at least. A
/// difference of two heights is rounded once more, which the scale has room for.
TANDEM_HD inline double distance_of_heights(const Direction& along, double low, double high) {
  const double gap = low - high;
  return gap > 0 ? gap * along.scale : 0;
}

/// A lower bound of the distance of two triangles.
TANDEM_HD inline double distance_across(const Direction& along, const TrianglePair& t) {
  return distance_of_heights(along, height_along(along.n, t.a, along.c).low,
                             height_along(along.n, t.b, along.c).high);
}

/// The direction along which two triangles are farthest apart, of a few that may be best: across their
/// nearest features, as guessed, and across either face. `length` is by how much they are apart along it; 0:
/// by none.
TANDEM_HD inline Direction best_direction(const TrianglePair& t, double& length) {
  const LocalPair local = local_pair(t);
  Direction best = {{{0, 0, 0}}};
  length = 0;
  if (!local.in_range()) return best;
  const Nearest<double> nearest = nearest_features<double>(local.a, local.b, 0x1p-480);
  const auto across = [](const Point<double>(&x)[3]) { return cross(minus(x[1], x[0]), minus(x[2], x[0])); };
  const Point<double> faces[2] = {across(local.a), across(local.b)};
  const Point<double> directions[] = {nearest.along, refined(local, nearest), faces[0],
                                      faces[1],      scaled(-1.0, faces[0]),  scaled(-1.0, faces[1])};
  for (const Point<double>& direction : directions) {
    const Direction next = direction_along(direction, t.b[0]);
    const double apart = distance_across(next, t);
    if (!(apart > length)) continue;
    length = apart;
    best = next;
  }
  return best;
}

}  // namespace tandem::distance
