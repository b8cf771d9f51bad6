#include "kernels/geometry/triangle_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "kernels/triangle_families.h"
#include "kernels/triangle_oracle.h"
#include "tandem/kernels/world_box.h"

namespace tandem {
namespace {

/// Pairs of each of 22 families: enough for continuous integration, and a million in all with TANDEM_LONG=1.
int pairs_per_family() {
  return std::getenv("TANDEM_LONG") != nullptr ? 50'000 : 2'000;
}

bool in_range(const TrianglePair& pair) {
  const auto fits = [](double x) { return std::fabs(x) <= kLargestWorldCoordinate; };
  return std::all_of(&pair.a[0][0], &pair.a[0][0] + 9, fits) &&
         std::all_of(&pair.b[0][0], &pair.b[0][0] + 9, fits);
}

/// The largest difference of coordinates, which errors of points are measured by.
double extent_of(const TrianglePair& pair) {
  double extent = 0;
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        extent = std::max({extent, std::fabs(pair.a[i][k] - pair.b[j][k]),
                           std::fabs(pair.a[i][k] - pair.a[j][k]), std::fabs(pair.b[i][k] - pair.b[j][k])});
      }
    }
  }
  return extent;
}

/// Whether no axis has coordinates that are small beside those of another: normals as computed tell little
/// of it then, and points are worse, which no interval is.
bool is_even(const TrianglePair& pair) {
  const double extent = extent_of(pair);
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 3; ++i) {
      const double x = std::fabs(pair.a[i][k] - pair.b[i][k]);
      if (x != 0 && x < 0x1p-20 * extent) return false;
    }
  }
  return true;
}

double largest_of(const TrianglePair& pair) {
  double largest = 0;
  for (const auto* t : {&pair.a, &pair.b}) {
    for (const auto& corner : *t) {
      for (const double x : corner) largest = std::max(largest, std::fabs(x));
    }
  }
  return largest;
}

double separation(const TriangleDistance& found) {
  return std::hypot(found.point_a[0] - found.point_b[0], found.point_a[1] - found.point_b[1],
                    found.point_a[2] - found.point_b[2]);
}

void expect_certified(const TrianglePair& pair, const DistanceOracle& oracle, const DistanceInterval& found,
                      const char* stage) {
  EXPECT_TRUE(oracle.is_in(found.lower, found.upper))
      << stage << ": [" << found.lower << ", " << found.upper << "] of " << oracle.rounded() << "\n"
      << text(pair);
}

/// Every stage by itself, and the cascade.
void expect_every_stage_right(const TrianglePair& pair) {
  const DistanceOracle oracle(pair);
  const DistanceTolerance tolerance = {0, 1e-6};
  const distance::LocalPair local = distance::local_pair(pair);
  TriangleWeights weights;
  if (local.in_range())
    expect_certified(pair, oracle, distance::bounded_distance(local, tolerance, weights), "float64");
  if (!oracle.meet()) {
    const DistanceInterval exact = exact::distance_apart(pair, weights);
    expect_certified(pair, oracle, exact, "exact");
    EXPECT_TRUE(exact.upper - exact.lower <= exact.upper * 0x1p-49 + 0x1p-1072) << text(pair);
  }
  const TriangleDistance found = triangle_distance(pair, tolerance);
  expect_certified(pair, oracle, found.interval, "cascade");
  EXPECT_EQ(oracle.meet(), found.interval.upper == 0) << text(pair);
  EXPECT_TRUE(found.interval.upper - found.interval.lower <= 1e-6 * found.interval.upper + 0x1p-1072)
      << text(pair);
  if (!local.in_range() || !is_even(pair)) return;
  EXPECT_LE(separation(found),
            found.interval.upper + 1e-9 * extent_of(pair) + 4 * DBL_EPSILON * largest_of(pair))
      << text(pair);
}

/// are_within() at the distance rounded either way, and next to it.
void expect_decisions_right(const TrianglePair& pair) {
  const DistanceOracle oracle(pair);
  if (oracle.meet()) return;
  double d = oracle.rounded();
  for (int i = 0; i < 2; ++i) d = std::nextafter(d, 0);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(exact::are_within(pair, d), oracle.is_in(0, d)) << d << "\n" << text(pair);
    d = std::nextafter(d, HUGE_VAL);
  }
}

class TriangleDistances : public testing::TestWithParam<TriangleFamily> {};

TEST_P(TriangleDistances, EveryIntervalHoldsTheExactDistance) {
  Random random(815);
  const int count = pairs_per_family() / oracle_share();
  int apart = 0;
  for (int i = 0; i < count && !HasFailure(); ++i) {
    const TrianglePair pair = GetParam().make(random);
    if (!in_range(pair)) continue;
    apart += triangle_distance(pair).interval.lower > 0;
    expect_every_stage_right(i % 2 == 0 ? pair : swapped(pair));
  }
  EXPECT_GT(apart, 0);
}

TEST_P(TriangleDistances, ClearanceIsDecidedExactly) {
  Random random(1111);
  const int count = pairs_per_family() / 25 / oracle_share();
  for (int i = 0; i < count && !HasFailure(); ++i) {
    const TrianglePair pair = GetParam().make(random);
    if (in_range(pair)) expect_decisions_right(pair);
  }
}

INSTANTIATE_TEST_SUITE_P(Families, TriangleDistances, testing::ValuesIn(triangle_families()),
                         [](const auto& test) { return test.param.identifier(); });

// Triangles that are nearly in touch, beside those of the families.

/// b is moved away from where it touches a by a gap of any size.
TrianglePair with_gap(Random& random, TrianglePair pair) {
  const double gap = std::ldexp(1, -uniform(random, 1, 60));
  const int k = uniform(random, 0, 2);
  double most_a = -HUGE_VAL, least_b = HUGE_VAL;
  for (int i = 0; i < 3; ++i) {
    most_a = std::max(most_a, pair.a[i][k]);
    least_b = std::min(least_b, pair.b[i][k]);
  }
  for (int i = 0; i < 3; ++i) pair.b[i][k] += most_a - least_b + gap;
  return pair;
}

TrianglePair generic_gap(Random& random) {
  return with_gap(random, generic_pair(random));
}
TrianglePair grid_gap(Random& random) {
  return with_gap(random, grid_pair(random));
}

/// Two faces, nearly or quite parallel, one above the other.
TrianglePair parallel_faces(Random& random) {
  TrianglePair pair = generic_pair(random);
  const double gap = std::ldexp(1, -uniform(random, 0, 50)),
               tilt = std::ldexp(uniform(random, 0, 1), -uniform(random, 0, 55));
  for (int i = 0; i < 3; ++i) {
    pair.a[i][2] = 0;
    pair.b[i][2] = gap + tilt * pair.b[i][0];
  }
  return pair;
}

/// Edges, nearly or quite parallel.
TrianglePair parallel_edges(Random& random) {
  TrianglePair pair = generic_pair(random);
  const double gap = std::ldexp(1, -uniform(random, 0, 50)),
               tilt = std::ldexp(uniform(random, 0, 1), -uniform(random, 0, 55));
  for (int i = 0; i < 2; ++i) {
    pair.a[i][1] = pair.a[i][2] = 0;
    pair.b[i][1] = tilt * pair.b[i][0];
    pair.b[i][2] = gap;
  }
  pair.a[2][2] = -std::fabs(pair.a[2][2]);
  pair.b[2][2] = gap + std::fabs(pair.b[2][2]);
  return pair;
}

/// Long triangles with a width of few last bits.
TrianglePair needles(Random& random) {
  TrianglePair pair = generic_pair(random);
  for (auto* t : {&pair.a, &pair.b}) {
    const double along = uniform(random, 0.0, 1.0);
    for (int k = 0; k < 3; ++k) {
      (*t)[2][k] = (*t)[0][k] + along * ((*t)[1][k] - (*t)[0][k]);
      (*t)[2][k] += std::ldexp(uniform(random, -1.0, 1.0), -uniform(random, 20, 60));
    }
  }
  return pair;
}

/// Segments and points.
TrianglePair flat(Random& random) {
  TrianglePair pair = generic_pair(random);
  std::copy_n(pair.a[0], 3, pair.a[2]);
  if (uniform(random, 0, 1) != 0) std::copy_n(pair.a[0], 3, pair.a[1]);
  if (uniform(random, 0, 1) != 0) std::copy_n(pair.b[0], 3, pair.b[1]);
  if (uniform(random, 0, 1) != 0) std::copy_n(pair.b[1], 3, pair.b[2]);
  return pair;
}

/// Far from the origin, small for the distance there.
TrianglePair far_away(Random& random) {
  TrianglePair pair = generic_gap(random);
  const double far = std::ldexp(1, uniform(random, 10, 45));
  for (auto* t : {&pair.a, &pair.b}) {
    for (auto& corner : *t) {
      for (double& x : corner) x += far;
    }
  }
  return pair;
}

/// A large and a small one.
TrianglePair large_and_small(Random& random) {
  TrianglePair pair = generic_pair(random);
  const double size = std::ldexp(1, -uniform(random, 5, 50)), height = std::ldexp(1, -uniform(random, 0, 50));
  for (auto& corner : pair.b) {
    for (double& x : corner) x *= size;
    corner[2] += height;
  }
  for (auto& corner : pair.a) corner[2] *= uniform(random, 0, 1);
  return pair;
}

constexpr TriangleFamily kNear[] = {{"generic_gap", generic_gap},
                                    {"grid_gap", grid_gap},
                                    {"parallel_faces", parallel_faces},
                                    {"parallel_edges", parallel_edges},
                                    {"needles", needles},
                                    {"flat", flat},
                                    {"far_away", far_away},
                                    {"large_and_small", large_and_small}};

INSTANTIATE_TEST_SUITE_P(Near, TriangleDistances, testing::ValuesIn(kNear),
                         [](const auto& test) { return test.param.identifier(); });

// Closed forms, which are met exactly where they are float64 numbers.

TrianglePair above_origin(double height) {
  return {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{1, 1, height}, {2, 1, height + 1}, {1, 2, height + 1}}};
}

TEST(TriangleDistance, OfACornerOverAFaceIsItsHeight) {
  for (const double height : {1.0, 0x1p-20, 0x1p-60, 0x1p-300, 0x1p-1000}) {
    const TriangleDistance found = triangle_distance(above_origin(height));
    EXPECT_LE(found.interval.lower, height);
    EXPECT_GE(found.interval.upper, height);
    EXPECT_LE(found.interval.upper - found.interval.lower, 1e-6 * height);
    EXPECT_NEAR(found.point_a[0], 1, 1e-15);
    EXPECT_NEAR(found.point_a[1], 1, 1e-15);
  }
  EXPECT_EQ(triangle_distance(above_origin(0)).interval.upper, 0);
}

TEST(TriangleDistance, OfTrianglesThatCrossIsZeroAtACommonPoint) {
  const TrianglePair pair = {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{1, 1, -1}, {1, 1, 3}, {9, 1, 3}}};
  const TriangleDistance found = triangle_distance(pair);
  EXPECT_EQ(found.interval.lower, 0);
  EXPECT_EQ(found.interval.upper, 0);
  EXPECT_NEAR(separation(found), 0, 1e-15);
  EXPECT_NEAR(found.point_a[2], 0, 1e-15);
}

TEST(TriangleDistance, OfANeedleThroughASegmentIsZeroWhereTheyMeet) {
  const TrianglePair pair = {{{3, 3, 2}, {3, 4, 1}, {3, 4, 1}},
                             {{5, 1, 0}, {1, 0x1.3ffffffffffffp+2, 4}, {0, 6, 5}}};
  const TriangleDistance found = triangle_distance(pair);
  EXPECT_EQ(found.interval.upper, 0);
  EXPECT_NEAR(separation(found), 0, 1e-12);
}

TEST(TriangleDistance, WideNumbersDecideATieEitherWay) {
  const TrianglePair pair = {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{1, 1, 3}, {2, 1, 4}, {1, 2, 4}}};
  EXPECT_TRUE(exact::are_within(pair, 3));
  EXPECT_FALSE(exact::are_within(pair, std::nextafter(3, 0)));
  const TrianglePair corners = {{{0, 0, 0}, {-4, 0, 0}, {0, -4, 0}}, {{3, 4, 0}, {9, 9, 1}, {9, 8, -1}}};
  EXPECT_TRUE(exact::are_within(corners, 5));
  EXPECT_FALSE(exact::are_within(corners, std::nextafter(5, 0)));
}

}  // namespace
}  // namespace tandem
