#include "bvhbench/economy/difference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

namespace tandem::economy {
namespace {

Patch patch(std::uint32_t a, std::uint32_t b, double x, double depth, double degrees = 0) {
  const double angle = degrees * std::numbers::pi / 180;
  return {{a, b}, {std::sin(angle), 0, std::cos(angle)}, {x, 0, 0}, depth};
}

Difference between(std::vector<Patch> finest, std::vector<Patch> coarser) {
  return difference({0, 0, {}, std::move(finest)}, {0, 0, {}, std::move(coarser)});
}

TEST(Spread, TellsWhatPartsOfTheNumbersAreAtMost) {
  std::vector<double> numbers;
  for (int i = 100; i >= 1; --i) numbers.push_back(i);
  const Spread spread = spread_of(numbers);
  EXPECT_DOUBLE_EQ(spread.mean, 50.5);
  EXPECT_EQ(spread.median, 50);
  EXPECT_EQ(spread.most, 95);
  EXPECT_EQ(spread.largest, 100);
}

TEST(Spread, OfFewNumbersTakesTheLargest) {
  EXPECT_EQ(spread_of({}).largest, 0);
  EXPECT_EQ(spread_of({3}).most, 3);
  EXPECT_EQ(spread_of({3, 1, 2}).most, 3);
  EXPECT_EQ(spread_of({3, 1, 2}).median, 2);
}

TEST(Difference, CountsPairsThatTouchAtOneLevelAlone) {
  Findings finest, coarser;
  finest.touching = {{0, 1}, {0, 2}, {1, 2}, {3, 4}};
  coarser.touching = {{0, 2}, {2, 5}};
  const Difference found = difference(finest, coarser);
  EXPECT_EQ(found.lost_pairs, 3u);
  EXPECT_EQ(found.new_pairs, 1u);
  EXPECT_EQ(found.touching_pairs, 4u);
}

TEST(Difference, MatchesTheNearestManifoldsOfAPairWhateverTheirOrder) {
  const Difference found = between({patch(0, 1, 0, 0.5), patch(0, 1, 10, 0.2), patch(2, 3, 0, 1)},
                                   {patch(2, 3, 0.1, 1.25, 3), patch(0, 1, 9, 0.3), patch(0, 1, 1, 0.5)});
  EXPECT_EQ(found.matched, 3u);
  EXPECT_EQ(found.lost_patches + found.new_patches, 0u);
  EXPECT_NEAR(found.depth.mean, (0 + 0.1 + 0.25) / 3, 1e-15);
  EXPECT_NEAR(found.depth.largest, 0.25, 1e-15);
  EXPECT_NEAR(found.angle.largest, 3, 1e-12);
}

TEST(Difference, NeverMatchesManifoldsOfDifferentPairs) {
  const Difference found = between({patch(0, 1, 0, 0.5)}, {patch(0, 2, 0, 0.25)});
  EXPECT_EQ(found.matched, 0u);
  EXPECT_EQ(found.lost_patches, 1u);
  EXPECT_EQ(found.new_patches, 1u);
}

TEST(Difference, CountsTheWholeDepthOfAManifoldWithoutAMatch) {
  const Difference found =
      between({patch(0, 1, 0, 0.5), patch(0, 1, 5, 0.01)}, {patch(0, 1, 0, 0.5), patch(7, 8, 0, 0.125)});
  EXPECT_EQ(found.matched, 1u);
  EXPECT_EQ(found.lost_patches, 1u);
  EXPECT_EQ(found.new_patches, 1u);
  EXPECT_DOUBLE_EQ(found.depth.mean, (0 + 0.01 + 0.125) / 3);
  EXPECT_EQ(found.depth.largest, 0.125);
}

TEST(Difference, OfASmallAngleKeepsItsDigits) {
  const Difference found = between({patch(0, 1, 0, 0, 0)}, {patch(0, 1, 0, 0, 1e-9)});
  EXPECT_NEAR(found.angle.largest, 1e-9, 1e-18);
}

}  // namespace
}  // namespace tandem::economy
