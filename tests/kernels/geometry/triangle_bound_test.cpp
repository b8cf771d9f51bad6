// Searches for inputs that bring a computed determinant's error near its bound: the bounds of
// tandem/kernels/detail/orientation.h must hold, and half of them must not, or the search would be too weak
// to show it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "kernels/triangle_families.h"
#include "kernels/triangle_oracle.h"

namespace tandem {
namespace {

struct Points {
  double p[4][3];  // the first is the origin of all differences
};

/// The error of the volume over its bound; 0 where the bound is infinite, and nothing is decided.
template <class Real>
double volume_share(const Points& x) {
  Real bound;
  const Real value = detail::Plane<Real>(x.p[0], x.p[1], x.p[2]).volume(x.p[3], bound);
  if (!std::isfinite(bound)) return 0;
  return oracle_volume_error(x.p[0], x.p[1], x.p[2], x.p[3], static_cast<double>(value)) /
         static_cast<double>(bound);
}

template <class Real>
double area_share(const Points& x) {
  Real bound;
  const Real value = detail::area<Real>(x.p[0], x.p[1], x.p[2], 2, bound);
  if (!std::isfinite(bound)) return 0;
  return oracle_area_error(x.p[0], x.p[1], x.p[2], 2, static_cast<double>(value)) /
         static_cast<double>(bound);
}

/// Numbers a little above a power of two, where a rounding costs most, and zeros, which leave fewer terms for
/// the errors to cancel in; the origin is small and makes the differences round.
Points random_start(Random& random, double unit_roundoff) {
  Points x;
  for (double& k : x.p[0]) k = unit_roundoff * uniform(random, -1.0, 1.0);
  for (int i = 1; i < 4; ++i) {
    for (double& k : x.p[i]) {
      k = uniform(random, 0, 2) == 0 ? 0.0 : 1 + std::exp2(uniform(random, -26.0, -2.0));
      if (uniform(random, 0, 1) == 0) k = -k;
    }
  }
  return x;
}

/// The largest share of its bound that an error reaches: a random walk uphill from many starts.
double largest_share(double (*share)(const Points&), double unit_roundoff) {
  Random random(31);
  double largest = 0;
  for (int start = 0; start < 100; ++start) {
    Points best = random_start(random, unit_roundoff);
    double value = share(best);
    for (int step = 0; step < 400; ++step) {
      Points next = best;
      double& x = next.p[uniform(random, 0, 3)][uniform(random, 0, 2)];
      x += std::ldexp(uniform(random, -1.0, 1.0), uniform(random, -4, 12)) * unit_roundoff;
      const double reached = share(next);
      if (reached >= value) {
        best = next;
        value = reached;
      }
    }
    largest = std::max(largest, value);
  }
  std::printf("errors reach %.3f of the bound\n", largest);
  return largest;
}

void expect_sharp(double share) {
  EXPECT_LE(share, 1);
  EXPECT_GT(share, 0.5);
}

TEST(TriangleBounds, HoldUnderAttackAndHalfOfThemDoNot) {
  expect_sharp(largest_share(volume_share<float>, 0x1p-24));
  expect_sharp(largest_share(volume_share<double>, 0x1p-53));
  expect_sharp(largest_share(area_share<float>, 0x1p-24));
  expect_sharp(largest_share(area_share<double>, 0x1p-53));
}

/// At every magnitude, underflow included.
TEST(TriangleBounds, HoldAtEveryMagnitude) {
  Random random(32);
  for (const auto& family : triangle_families()) {
    for (int i = 0; i < 1000; ++i) {
      const TrianglePair t = family.make(random);
      Points x;
      for (int k = 0; k < 9; ++k) x.p[k / 3][k % 3] = t.a[k / 3][k % 3];
      std::copy_n(t.b[0], 3, x.p[3]);
      EXPECT_LE(volume_share<float>(x), 1) << family;
      EXPECT_LE(volume_share<double>(x), 1) << family;
      EXPECT_LE(area_share<float>(x), 1) << family;
      EXPECT_LE(area_share<double>(x), 1) << family;
    }
  }
}

}  // namespace
}  // namespace tandem
