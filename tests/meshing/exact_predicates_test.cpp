#include "bvhbuild/meshing/exact_predicates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tandem::build {
namespace {

constexpr double kInfinity = HUGE_VAL;

Point scaled(const Point& p, double scale) {
  return {p[0] * scale, p[1] * scale, p[2] * scale};
}

/// Multiples of one integer vector, moved: exactly on one line in float64 at every scale that is a power of
/// two.
TEST(Collinear, HoldsExactlyForIntegerLinesAtEveryScale) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> number(-1000, 1000);
  for (int i = 0; i < 2000; ++i) {
    const Point base{double(number(random)), double(number(random)), double(number(random))};
    const Point step{double(number(random)), double(number(random)), double(number(random))};
    const auto at = [&](int k) {
      return Point{base[0] + k * step[0], base[1] + k * step[1], base[2] + k * step[2]};
    };
    for (const double scale : {1.0, 0x1p-1074, 0x1p-1000, 0x1p-540, 0x1p500, 0x1p990})
      EXPECT_TRUE(collinear(scaled(at(number(random)), scale), scaled(at(number(random)), scale),
                            scaled(at(1), scale)));
  }
}

TEST(Collinear, FailsOneLastBitBesideTheLine) {
  for (const double scale : {1.0, 0x1p-1040, 0x1p-540, 0x1p500, 0x1p990})
    for (int k = 0; k < 3; ++k) {
      const Point a = scaled({1, 2, 3}, scale);
      const Point b = scaled({4, 6, 8}, scale);
      Point c = scaled({7, 10, 13}, scale);
      EXPECT_TRUE(collinear(a, b, c));
      c[k] = std::nextafter(c[k], kInfinity);
      EXPECT_FALSE(collinear(a, b, c)) << scale << " " << k;
    }
}

TEST(Collinear, SeesTheAreaOfNeedlesBeyondFloat64Products) {
  EXPECT_FALSE(collinear({0, 0, 0}, {1, 0, 0}, {1, 1e-300, 0}));
  EXPECT_FALSE(collinear({0, 0, 0}, {1e-300, 0, 0}, {0, 1e-300, 0}));
  EXPECT_FALSE(collinear({0, 0, 0}, {5e-324, 0, 0}, {0, 0, 5e-324}));
  EXPECT_FALSE(collinear({0, 0, 0}, {1e300, 0, 0}, {0, 5e-324, 0}));
  EXPECT_FALSE(collinear({-1e308, 0, 0}, {1e308, 0, 0}, {0, 5e-324, 0}));
  EXPECT_TRUE(collinear({-1e308, 1e308, 0}, {1e308, -1e308, 0}, {5e-324, -5e-324, 0}));
  EXPECT_TRUE(collinear({1, 2, 3}, {1, 2, 3}, {4, 5, 6}));
  EXPECT_TRUE(collinear({0.0, 0, 0}, {-0.0, 0, 0}, {0, 0, 0}));
}

/// Decimal fractions are not what they look like: only the float64 numbers count.
TEST(Collinear, JudgesTheStoredNumbersNotTheDecimals) {
  EXPECT_TRUE(collinear({0, 0, 0}, {0.1, 0.1, 0}, {0.3, 0.3, 0}));
  EXPECT_FALSE(collinear({0, 0, 0}, {0.1, 0.3, 0}, {0.2, 0.6000000000000001, 0}));
  EXPECT_TRUE(collinear({0, 0, 0}, {0.1, 0.3, 0}, {0.2, 0.6, 0}));
  EXPECT_FALSE(collinear({0, 0, 0}, {0.1, 0.3, 0}, {0.3, 0.9, 0}));  // 3 * 0.1 and 3 * 0.3 round differently
}

TEST(Orientation, IsExactBesideALine) {
  for (const double scale : {1.0, 0x1p-1040, 0x1p-540, 0x1p500, 0x1p990}) {
    const Point2 a{1 * scale, 2 * scale};
    const Point2 b{4 * scale, 6 * scale};
    const Point2 c{7 * scale, 10 * scale};
    EXPECT_EQ(orientation(a, b, c), 0);
    EXPECT_EQ(orientation(a, b, {c[0], std::nextafter(c[1], kInfinity)}), 1);
    EXPECT_EQ(orientation(a, b, {c[0], std::nextafter(c[1], -kInfinity)}), -1);
  }
}

/// Against integers that fit 128 bits: points of a fine grid beside a long line.
TEST(Orientation, AgreesWithIntegerArithmetic) {
  std::mt19937_64 random(11);
  std::uniform_int_distribution<std::int64_t> number(-(std::int64_t{1} << 52), std::int64_t{1} << 52);
  std::uniform_int_distribution<std::int64_t> small(-3, 3);
  for (int i = 0; i < 20000; ++i) {
    const std::int64_t ax = number(random), ay = number(random), bx = number(random) / 2,
                       by = number(random) / 2;
    const std::int64_t cx = ax / 2 + bx / 2 + small(random), cy = ay / 2 + by / 2 + small(random);
    const __int128 area =
        static_cast<__int128>(bx - ax) * (cy - ay) - static_cast<__int128>(by - ay) * (cx - ax);
    const int expected = (area > 0) - (area < 0);
    EXPECT_EQ(orientation({double(ax), double(ay)}, {double(bx), double(by)}, {double(cx), double(cy)}),
              expected);
  }
}

}  // namespace
}  // namespace tandem::build
