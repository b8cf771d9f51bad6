// Points of a step among those of the step before.
#include "kernels/manifold/finish.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "kernels/random_pose.h"

namespace tandem::manifold {
namespace {

// Compares each with each, as teams on a GPU do.
struct PlainTeam {
  static std::uint32_t rank() { return 0; }
  static std::uint32_t size() { return 1; }
  static void sync() {}
};

using Points = std::vector<ManifoldPoint>;

void turn_point(test::RandomPoses& random, ManifoldPoint& point) {
  const bool down = random.below(4) == 0;
  point.normal[1] = down ? 0 : 0.6, point.normal[2] = down ? -1 : 0.8;
}

ManifoldPoint point_at(test::RandomPoses& random, bool on_lattice) {
  ManifoldPoint point = {};
  for (int k = 0; k < 3; ++k) {
    // A lattice has many that are as near, and many at one place.
    point.in_a[k] = k == 2       ? 0
                    : on_lattice ? static_cast<double>(random.below(40)) / 64
                                 : random.symmetric(0.5);
    point.in_b[k] = point.in_a[k] + k;
  }
  point.id = feature_hash(random.below(1000), 1);
  turn_point(random, point);
  return point;
}

void move_point(test::RandomPoses& random, double way, ManifoldPoint& point) {
  for (int k = 0; k < 3; ++k) {
    // On either body alone, too.
    if (random.below(3) != 0) point.in_a[k] += random.symmetric(way);
    if (random.below(3) != 0) point.in_b[k] += random.symmetric(way);
  }
}

template <typename Team>
Points matched(const Points& now, const Points& before) {
  Points points = now;
  const Team team;
  const PointMatcher<Team> matcher(team, 1);
  matcher.match(points.data(), 3, static_cast<std::uint32_t>(points.size()) - 3,
                {before.data(), 2, static_cast<std::uint32_t>(before.size()) - 2});
  return points;
}

TEST(PointMatcher, OfManyPointsFindsWhatComparingEachWithEachFinds) {
  test::RandomPoses random(41);
  const std::size_t counts[][2] = {{4, 4},      {180, 200},  {300, 300},  {1000, 1000},
                                   {10, 20000}, {20000, 10}, {8300, 600}, {600, 8300}};
  for (const auto& [old, fresh] : counts) {
    for (int kind = 0; kind < 4; ++kind) {
      Points before, now;
      for (std::size_t i = 0; i < old; ++i) before.push_back(point_at(random, kind % 2 != 0));
      for (std::size_t i = 0; i < fresh; ++i) {
        ManifoldPoint point =
            random.below(8) == 0 || kind == 3 ? point_at(random, kind % 2 != 0) : before[random.below(old)];
        const double ways[] = {0, 1e-3, 0.02};
        move_point(random, ways[random.below(3)], point);
        point.previous = static_cast<std::uint32_t>(random.below(9));  // what was there does not matter
        turn_point(random, point);
        now.push_back(point);
      }
      const Points expected = matched<PlainTeam>(now, before), found = matched<OneThread>(now, before);
      std::size_t same = 0, different = 0;
      for (std::size_t i = 3; i < fresh; ++i) {
        ASSERT_EQ(found[i].previous, expected[i].previous) << i << " of " << fresh << " kind " << kind;
        ASSERT_EQ(found[i].id, expected[i].id) << i << " of " << fresh << " kind " << kind;
        (found[i].previous == kNoIndex ? different : same) += 1;
      }
      ASSERT_EQ(0, std::memcmp(found.data(), expected.data(), fresh * sizeof found[0]));
      EXPECT_TRUE(std::min(old, fresh) < 100 || (same > 20 && different > 20)) << same << " " << different;
    }
  }
}

// Points that a search in a tree looks at, on average, where each has moved a little.
double looked_at(std::uint32_t count) {
  test::RandomPoses random(42);
  std::vector<ManifoldPoint> points;
  for (std::uint32_t i = 0; i < count; ++i) points.push_back(point_at(random, false));
  std::uint64_t visits = 0;
  for (const PointTree::Place place : {&ManifoldPoint::in_a, &ManifoldPoint::in_b}) {
    const PointTree tree(points.data(), count, place);
    for (std::uint32_t i = 0; i < count; ++i) {
      double at[3], least = 0.02 * 0.02;
      for (int k = 0; k < 3; ++k) at[k] = (points[i].*place)[k] + random.symmetric(1e-3);
      bool found = false;
      tree.visit_near(at, least, [&](std::uint32_t j) {
        ++visits;
        found = found || j == i;
        double distance = 0;
        for (int k = 0; k < 3; ++k) distance += std::pow((points[j].*place)[k] - at[k], 2);
        least = std::min(least, distance);
      });
      EXPECT_TRUE(found || least < 3e-6);
    }
  }
  return static_cast<double>(visits) / (2 * count);
}

TEST(PointMatcher, ASearchLooksAtFewPointsHoweverManyThereAre) {
  const double of_few = looked_at(128), of_many = looked_at(PointTree::kMost);
  EXPECT_LT(of_few, 40);
  EXPECT_LT(of_many, 40);  // of 8,192
  EXPECT_LT(of_many, 3 * of_few);
}

}  // namespace
}  // namespace tandem::manifold
