#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <span>

#include "kernels/random_pose.h"

/// Tests of the box tests' promise judge by these: points that are apart, or in contact, for sure; and the
/// scales that they are tried at.
namespace tandem::test {

using Real = long double;
using Direction = std::array<Real, 3>;
using Point = std::array<double, 3>;

/// Trials of this many with TANDEM_LONG=1, a hundredth otherwise.
inline std::uint64_t hundredth_of(std::uint64_t many) {
  return std::getenv("TANDEM_LONG") != nullptr ? many : many / 100;
}

inline Direction cross(const Direction& a, const Direction& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Proves that a plane across `along` has the two hulls strictly on its two sides. Distances from one point
/// are rounded once, products once, sums twice: 4 * 2^-64 of the sum of magnitudes, taken as 16.
inline bool plane_separates(std::span<const Point> a, std::span<const Point> b, const Direction& along) {
  Real lowest[2] = {HUGE_VALL, HUGE_VALL}, highest[2] = {-HUGE_VALL, -HUGE_VALL}, size = 0;
  for (int side = 0; side < 2; ++side) {
    for (const Point& point : side == 0 ? a : b) {
      Real at = 0, magnitude = 0;
      for (int k = 0; k < 3; ++k) {
        const Real term = along[k] * (static_cast<Real>(point[k]) - static_cast<Real>(a[0][k]));
        at += term;
        magnitude += std::fabs(term);
      }
      lowest[side] = std::min(lowest[side], at);
      highest[side] = std::max(highest[side], at);
      size = std::max(size, magnitude);
    }
  }
  const Real error = 16 * 0x1p-64L * size;
  return lowest[0] > highest[1] + 2 * error || lowest[1] > highest[0] + 2 * error;
}

/// Whether the posed point `p` lies strictly inside the tetrahedron, for sure: signs of volumes, each a sum
/// of 6 products of 3 differences, with an error below 32 * 2^-64 of the product of sizes.
inline bool surely_inside(const Point& p, const std::array<Point, 4>& tetrahedron) {
  Direction to[4];
  Real size = 0;
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 3; ++k) {
      to[i][k] = static_cast<Real>(tetrahedron[i][k]) - p[k];
      size = std::max(size, std::fabs(to[i][k]));
    }
  }
  int positive = 0, negative = 0;
  for (int i = 0; i < 4; ++i) {
    const Direction n = cross(to[(i + 1) % 4], to[(i + 2) % 4]);
    const Direction& v = to[(i + 3) % 4];
    const Real volume = (n[0] * v[0] + n[1] * v[1] + n[2] * v[2]) * (i % 2 == 0 ? 1 : -1);
    positive += volume > 0x1p-58L * size * size * size;
    negative += volume < -0x1p-58L * size * size * size;
  }
  return positive == 4 || negative == 4;
}

inline Scale any_scale(RandomPoses& random) {
  constexpr double kSizes[] = {1, 1, 1, 1e-3, 1e3, 0x1p-60, 0x1p60, 0x1p-100, 0x1p-140, 0x1p110};
  constexpr double kCentres[] = {0, 1, 1, 10, 1e3};
  constexpr double kTranslations[] = {0, 1, 1, 1e4, 1e7, 1e12};
  constexpr double kTurns[] = {4, 4, 0, 1e-9, 1e-7, 1e-5, 1e-3};
  Scale scale;
  scale.size = kSizes[random.below(std::size(kSizes))];
  scale.centre = scale.size * kCentres[random.below(std::size(kCentres))];
  scale.translation = scale.size * kTranslations[random.below(std::size(kTranslations))];
  scale.turn = kTurns[random.below(std::size(kTurns))];
  scale.deviation = random.below(3) == 0 ? 1.2e-7 : 0;
  return scale;
}

}  // namespace tandem::test
