#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "kernels/geometry/triangle_test.h"
#include "kernels/triangle_families.h"
#include "kernels/triangle_oracle.h"

namespace tandem {
namespace {

/// Pairs of each family: enough for continuous integration, and 1.4 million in all with TANDEM_LONG=1.
int pairs_per_family() {
  return std::getenv("TANDEM_LONG") != nullptr ? 100'000 : 8'000;
}

TrianglePair reordered(const TrianglePair& pair, Random& random) {
  TrianglePair out;
  int order[] = {0, 1, 2};
  std::shuffle(order, order + 3, random);
  for (int i = 0; i < 3; ++i) std::copy_n(pair.a[order[i]], 3, out.a[i]);
  std::shuffle(order, order + 3, random);
  for (int i = 0; i < 3; ++i) std::copy_n(pair.b[order[i]], 3, out.b[i]);
  return out;
}

/// Each stage by itself, on the pair as it is, exchanged, and with corners in another order.
void expect_every_stage_right(const TrianglePair& pair, Verdict expected, Random& random) {
  for (const TrianglePair& p : {pair, swapped(pair), reordered(pair, random)}) {
    const Verdict by_float64 = decide_float64(p);
    EXPECT_TRUE(by_float64 == expected || by_float64 == Verdict::undecided) << text(p);
    EXPECT_EQ(decide_exact(p), expected) << text(p);
    EXPECT_EQ(decide(p).verdict, expected) << text(p);
  }
}

class TriangleFamilies : public testing::TestWithParam<TriangleFamily> {};

TEST_P(TriangleFamilies, EveryStageAgreesWithExactArithmetic) {
  Random random(20091);
  long exactly = 0, contacts = 0, fast_errors = 0;
  const int count = pairs_per_family() / oracle_share();
  for (int i = 0; i < count && !HasFailure(); ++i) {
    const TrianglePair pair = GetParam().make(random);
    const Verdict expected = oracle_contact(pair) ? Verdict::contact : Verdict::apart;
    expect_every_stage_right(pair, expected, random);
    contacts += expected == Verdict::contact;
    fast_errors += decide_fast(pair) != expected;
    exactly += decide(pair).exactly;
  }
  std::printf("%-18s %d pairs, %ld contacts; %ld left by float64; fast errs in %ld\n", GetParam().name, count,
              contacts, exactly, fast_errors);
  EXPECT_GT(contacts, count / 100);
  EXPECT_LT(contacts, count - count / 200);
}

INSTANTIATE_TEST_SUITE_P(All, TriangleFamilies, testing::ValuesIn(triangle_families()),
                         [](const auto& test) { return test.param.identifier(); });

TEST(TriangleTest, BoundsDecideGenericPairs) {
  Random random(5);
  for (int i = 0; i < 100'000; ++i) EXPECT_FALSE(decide(generic_pair(random)).exactly);
}

TEST(TriangleTest, CoarseGridsNeedNoExactStage) {
  Random random(7);
  for (int i = 0; i < 100'000; ++i) EXPECT_FALSE(decide(grid_pair(random)).exactly);
}

TEST(TriangleTest, FastIsRightWhereFloat32IsExact) {
  Random random(6);
  for (int i = 0; i < 100'000; ++i) {
    const TrianglePair pair = grid_pair(random);
    ASSERT_EQ(decide_fast(pair), decide_exact(pair)) << text(pair);
  }
}

/// A step of one last bit, on either side of touching, in each direction.
TEST(TriangleTest, TouchingEndsOneLastBitFurther) {
  constexpr double kThird = 1.0 / 3;
  const TrianglePair touching = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                                 {{kThird, 0.25, 0}, {0, 1, 1}, {1, 1, 1}}};
  EXPECT_EQ(decide(touching).verdict, Verdict::contact);
  TrianglePair apart = touching;
  apart.b[0][2] = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(decide(apart).verdict, Verdict::apart);
  apart.b[0][2] = -std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(decide(apart).verdict, Verdict::contact);
}

TEST(TriangleTest, FlatTrianglesAreTheirHulls) {
  const double o[3] = {0, 0, 0}, x[3] = {2, 0, 0}, half[3] = {1, 0, 0}, y[3] = {1, -1, 0}, y2[3] = {1, 1, 0};
  const double z[3] = {1, 0, 1}, beyond[3] = {3, 0, 0};
  const auto verdict = [](const double* a0, const double* a1, const double* a2, const double* b0,
                          const double* b1, const double* b2) {
    TrianglePair pair;
    const double* corners[] = {a0, a1, a2, b0, b1, b2};
    for (int i = 0; i < 3; ++i) {
      std::copy_n(corners[i], 3, pair.a[i]);
      std::copy_n(corners[i + 3], 3, pair.b[i]);
    }
    return decide(pair).verdict;
  };
  EXPECT_EQ(verdict(o, x, half, y, y2, y), Verdict::contact);          // crossing segments
  EXPECT_EQ(verdict(o, x, half, half, half, half), Verdict::contact);  // point within a segment
  EXPECT_EQ(verdict(o, x, half, beyond, beyond, beyond), Verdict::apart);
  EXPECT_EQ(verdict(o, half, o, x, beyond, x), Verdict::apart);         // on one line, a gap between
  EXPECT_EQ(verdict(o, half, x, x, beyond, beyond), Verdict::contact);  // on one line, one end in common
  EXPECT_EQ(verdict(o, x, half, z, z, y), Verdict::apart);              // skew
  EXPECT_EQ(verdict(o, o, o, o, o, o), Verdict::contact);
  EXPECT_EQ(verdict(o, o, o, x, x, x), Verdict::apart);
  EXPECT_EQ(verdict(o, x, y2, half, half, half), Verdict::contact);  // point on an edge
  EXPECT_EQ(verdict(o, x, y2, half, z, z), Verdict::contact);        // segment standing on an edge
}

/// Volumes, the hard way: four points almost in a plane, at every magnitude.
TEST(ExactSigns, AgreeWithRationalNumbers) {
  Random random(7);
  for (const auto& family : triangle_families()) {
    for (int i = 0; i < 500; ++i) {
      const TrianglePair t = family.make(random);
      const int expected = oracle_volume_sign(t.a[0], t.a[1], t.a[2], t.b[0]);
      ASSERT_EQ(detail::ExactSigns::volume(t.a[0], t.a[1], t.a[2], t.b[0]), expected) << text(t);
      ASSERT_EQ((detail::wide_volume_sign({t.a[0], t.a[1]}, {t.a[0], t.a[2]}, {t.a[0], t.b[0]})), expected)
          << text(t);
    }
  }
}

bool all_in_range(const TrianglePair& t) {
  bool all = true;
  for (int i = 0; i < 3; ++i) all = all && detail::in_range(t.a[i]) && detail::in_range(t.b[i]);
  return all;
}

/// Expansions and wide integers are independent of each other, and fast enough for many pairs.
TEST(ExactSigns, ExpansionsAgreeWithWideIntegersInTheirRange) {
  Random random(8);
  for (const auto& family : triangle_families()) {
    for (int i = 0; i < pairs_per_family(); ++i) {
      const TrianglePair t = family.make(random);
      if (!all_in_range(t)) continue;
      ASSERT_EQ((detail::expansion_volume_sign({t.a[0], t.a[1]}, {t.a[0], t.a[2]}, {t.a[0], t.b[0]})),
                (detail::wide_volume_sign({t.a[0], t.a[1]}, {t.a[0], t.a[2]}, {t.a[0], t.b[0]})))
          << text(t);
      for (int k = 0; k < 3; ++k) {
        ASSERT_EQ(detail::expansion_area_sign(t.a[0], t.a[1], t.b[0], k),
                  detail::wide_area_sign(t.a[0], t.a[1], t.b[0], k))
            << text(t);
      }
    }
  }
}

/// A determinant of one unit cubed, and none, of numbers of 53 bits at the lower end of the range: the last
/// bit of the last product is the smallest float64 there is.
TEST(ExactSigns, ExpansionsKeepTheLastBitOfTheSmallestNumbers) {
  Random random(10);
  constexpr double kUnit = detail::kSmallestInRange * 0x1p-52;
  constexpr double kOrigin[3] = {0, 0, 0};
  for (int i = 0; i < 1000; ++i) {
    const double m = kUnit * (0x1p52 + 2 + std::floor(uniform(random, 0.0, 0x1p51)));
    const double more = m + kUnit, less = m - kUnit;
    const double u[3] = {m, less, m}, v[3] = {more, m, more};  // u x v = {-1, 0, 1} units squared
    for (const double w_z : {less, m, more}) {
      const double w[3] = {m, m, w_z};
      ASSERT_EQ((detail::expansion_volume_sign({kOrigin, u}, {kOrigin, v}, {kOrigin, w})),
                (w_z > m) - (w_z < m))
          << m / kUnit;
      ASSERT_EQ((detail::wide_volume_sign({kOrigin, u}, {kOrigin, v}, {kOrigin, w})), (w_z > m) - (w_z < m))
          << m / kUnit;
    }
  }
}

/// The ends of the range in which expansions are exact: the smallest and largest numbers of full width.
TEST(ExactSigns, ExpansionsAreExactAtTheEndsOfTheirRange) {
  Random random(9);
  constexpr double kEnds[] = {0, detail::kSmallestInRange, detail::kLargestInRange, 0x1p-253, 1};
  for (int i = 0; i < 20'000; ++i) {
    double p[4][3];
    for (auto& point : p) {
      for (double& x : point) {
        x = kEnds[uniform(random, 0, 4)];
        if (uniform(random, 0, 1) == 0 && x != 0)
          x *= x > 1 ? 1 - 0x1p-53 : 1 + uniform(random, 1, 9) * 0x1p-52;
        if (uniform(random, 0, 1) == 0) x = -x;
      }
    }
    ASSERT_TRUE(detail::in_range(p[0]) && detail::in_range(p[1]) && detail::in_range(p[2]));
    ASSERT_EQ((detail::expansion_volume_sign({p[0], p[1]}, {p[0], p[2]}, {p[0], p[3]})),
              (detail::wide_volume_sign({p[0], p[1]}, {p[0], p[2]}, {p[0], p[3]})));
  }
}

// Searches for inputs that bring a computed determinant's error near its bound: the bounds of
// tandem/kernels/detail/orientation.h must hold, and half of them must not, or the search would be too weak
// to show it.

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
