#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kernels/geometry/pair_motion.h"
#include "kernels/query_scenes.h"
#include "kernels/solid_meshes.h"
#include "tandem/kernels/moved_query.h"

namespace tandem::test {
namespace {

using Pairs = std::vector<ObjectPair>;

// A box asset whose corners are those of its bounds.
struct Corners {
  float lower[3], upper[3];
  double origin[3];

  AssetBox box() const { return asset_box(lower, upper, origin); }
};

Corners any_corners(RandomPoses& random) {
  Corners out{};
  const double size = std::pow(10, random.uniform(-6, 4)), away = random.below(2) == 0 ? 0 : 1000 * size;
  for (int k = 0; k < 3; ++k) {
    const double at = random.symmetric(away), half = random.below(8) == 0 ? 0 : random.uniform(0, size);
    out.lower[k] = static_cast<float>(at - half);
    out.upper[k] = static_cast<float>(at + half);
    out.origin[k] = random.below(2) == 0 ? 0 : random.symmetric(1e6);
  }
  return out;
}

// A pose near another: what a body does in a few steps.
Pose near(RandomPoses& random, const Pose& pose, double turn, double way) {
  const double a = random.symmetric(turn);
  const Pose by = {{{std::cos(a), -std::sin(a), 0}, {std::sin(a), std::cos(a), 0}, {0, 0, 1}}, {}};
  Pose out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) out.rotation[i][j] += by.rotation[i][k] * pose.rotation[k][j];
    }
    out.translation[i] = pose.translation[i] + random.symmetric(way);
  }
  return out;
}

// A posed point of the smaller body as the larger one sees it: the point in float64, as queries have it, and
// all else in more digits.
void seen(const PosedPair& pair, const double (&x)[3], long double (&out)[3]) {
  double posed[3];
  apply(pair.smaller, x[0], x[1], x[2], posed);
  for (int i = 0; i < 3; ++i) {
    out[i] = 0;
    for (int k = 0; k < 3; ++k) {
      out[i] += static_cast<long double>(pair.larger.rotation[k][i]) *
                (static_cast<long double>(posed[k]) - pair.larger.translation[k]);
    }
  }
}

// The longest way of a corner.
double longest_way(const Corners& corners, const PosedPair& then, const PosedPair& now) {
  long double longest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double x[3];
    for (int k = 0; k < 3; ++k) x[k] = (corner >> k & 1) != 0 ? corners.upper[k] : corners.lower[k];
    long double from[3], to[3], squared = 0;
    seen(then, x, from);
    seen(now, x, to);
    for (int k = 0; k < 3; ++k) squared += (to[k] - from[k]) * (to[k] - from[k]);
    longest = std::max(longest, std::sqrt(squared));
  }
  return static_cast<double>(longest);
}

// A box moves as its corners do: no point of it goes farther than they.
TEST(PairMotion, NoPointOfTheSmallerBodyGoesFarther) {
  RandomPoses random(1);
  int small = 0;
  for (int trial = 0; trial < trials(100'000, 20); ++trial) {
    const Corners corners = any_corners(random);
    const double far = std::pow(10, random.uniform(-6, 9)), size = std::sqrt(corners.box().squared);
    const double deviation = random.below(2) == 0 ? 0 : 3e-7;
    const double turn = random.below(6) == 0 ? 0 : std::pow(10, random.uniform(-17, 0.5));
    const double way = random.below(6) == 0
                           ? 0
                           : (size + far * (random.below(4) == 0)) * std::pow(10, random.uniform(-17, 0));
    const PosedPair then = {random.pose({.translation = far, .deviation = deviation}),
                            random.pose({.translation = far, .deviation = deviation})};
    PosedPair now = then;
    if (random.below(4) != 0) now.smaller = near(random, then.smaller, turn, way);
    if (random.below(2) != 0) now.larger = near(random, then.larger, turn, way);
    const double longest = longest_way(corners, then, now), bound = pair_motion(corners.box(), then, now);
    ASSERT_LE(longest, bound) << trial;
    // It is not much more than that, apart from rounding.
    double numbers = 0;
    for (int k = 0; k < 3; ++k) {
      numbers += std::fabs(corners.lower[k]) + std::fabs(corners.upper[k]);
      for (const PosedPair& pair : {then, now})
        numbers += std::fabs(pair.larger.translation[k]) + std::fabs(pair.smaller.translation[k]);
    }
    ASSERT_LE(bound, 1.74 * longest + 0x1p-44 * numbers) << trial;
    small += longest < 1e-10 * numbers;
  }
  EXPECT_GT(small, 1000);
}

TEST(PairMotion, BodiesThatStandHaveNone) {
  RandomPoses random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const Corners corners = any_corners(random);
    const PosedPair then = {random.pose({.translation = 1}), random.pose({.translation = 1})};
    EXPECT_EQ(pair_motion(corners.box(), then, then), 0);
  }
}

// Boxes in a row, each a little in the next.
struct Row {
  SampleAssets assets;
  std::vector<Instance> bodies;
  Scene scene;
  MovedQuery moved;

  explicit Row(std::uint32_t count = 6) {
    assets.add(cube(0.5f));
    assets.add(box(1, 1, 1));
    for (std::uint32_t i = 0; i < count; ++i)
      bodies.push_back({0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.99 * i, 0, 0}}});
    EXPECT_EQ(scene.set_assets(assets.views()), Status::kOk);
  }

  Status find(const MovedOptions& options) {
    EXPECT_EQ(scene.place(bodies), Status::kOk);
    return moved.find(scene, options);
  }
  Pairs rows(const MovedOptions& options) {
    EXPECT_EQ(find(options), Status::kOk);
    return {moved.rows().begin(), moved.rows().end()};
  }
  Pairs all() const { return {moved.pairs().begin(), moved.pairs().end()}; }
};

constexpr MovedOptions kTolerant = {.tolerance = 0.001};

TEST(MovedQuery, PairsThatHaveNotMovedAreKept) {
  Row row;
  EXPECT_EQ(row.rows(kTolerant).size(), 5u);
  EXPECT_TRUE(row.rows(kTolerant).empty());
  EXPECT_EQ(row.moved.counters(), (MovedCounters{5, 5}));
  row.bodies[3].pose.translation[1] += 0.0009;
  EXPECT_TRUE(row.rows(kTolerant).empty());
  row.bodies[3].pose.translation[1] += 0.0002;
  EXPECT_EQ(row.rows(kTolerant), (Pairs{{2, 3}, {3, 4}}));
  EXPECT_EQ(row.all(), (Pairs{{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}}));
  const std::span<const std::uint32_t> kept = row.moved.kept_rows();
  EXPECT_EQ(std::vector(kept.begin(), kept.end()), (std::vector<std::uint32_t>{0, 1, kNoIndex, kNoIndex, 4}));
}

TEST(MovedQuery, SlowMotionAddsUp) {
  Row row(2);
  int steps = 0;
  for (row.rows(kTolerant); row.rows(kTolerant).empty(); ++steps) row.bodies[1].pose.translation[2] += 0.0003;
  EXPECT_EQ(steps, 4);
  EXPECT_TRUE(row.rows(kTolerant).empty());
}

TEST(MovedQuery, BodiesThatMoveTogetherDoNotMoveAgainstEachOther) {
  Row row;
  RandomPoses random(3);
  row.rows(kTolerant);
  const Pose by = random.pose({.translation = 7});
  for (Instance& body : row.bodies) {
    const Pose before = body.pose;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        body.pose.rotation[i][j] = 0;
        for (int k = 0; k < 3; ++k) body.pose.rotation[i][j] += by.rotation[i][k] * before.rotation[k][j];
      }
    }
    apply(by, before.translation[0], before.translation[1], before.translation[2], body.pose.translation);
  }
  EXPECT_EQ(row.find({.tolerance = 1e-12}), Status::kOk);
  for (const ObjectPair& pair : row.moved.rows()) EXPECT_NE(pair.b, pair.a + 1);  // but those that came to it
}

TEST(MovedQuery, NothingIsKeptByNoToleranceNorOfOtherAssetsBodiesOrScenes) {
  Row row;
  row.rows(kTolerant);
  EXPECT_EQ(row.rows({}).size(), 5u);
  EXPECT_EQ(row.rows({.tolerance = 5e-324}).size(), 0u);
  EXPECT_EQ(row.rows({.tolerance = INFINITY}).size(), 0u);
  row.moved.forget_poses();
  EXPECT_EQ(row.rows({.tolerance = INFINITY}).size(), 5u);
  row.bodies[0].asset = 1;  // of the same shape
  EXPECT_EQ(row.rows({.tolerance = INFINITY}), (Pairs{{0, 1}}));
  ASSERT_EQ(row.scene.set_assets(row.assets.views()), Status::kOk);
  EXPECT_EQ(row.rows({.tolerance = INFINITY}).size(), 5u);
  Row other;
  ASSERT_EQ(other.scene.place(other.bodies), Status::kOk);
  ASSERT_EQ(row.moved.find(other.scene, {.tolerance = INFINITY}), Status::kOk);
  EXPECT_EQ(row.moved.rows().size(), 5u);
}

TEST(MovedQuery, APairThatLeftTheListIsARowWhenItComesBack) {
  Row row;
  row.rows(kTolerant);
  row.bodies[5].pose.translation[2] += 3;
  EXPECT_TRUE(row.rows(kTolerant).empty());
  EXPECT_EQ(row.all().size(), 4u);
  row.bodies[5].pose.translation[2] -= 3;
  EXPECT_EQ(row.rows(kTolerant), (Pairs{{4, 5}}));
}

TEST(MovedQuery, EachPairMayHaveItsOwnTolerance) {
  Row row;
  row.rows(kTolerant);
  for (Instance& body : row.bodies)
    body.pose.translation[1] += 1e-4 * static_cast<double>(&body - row.bodies.data());
  const std::vector<double> tolerance = {1, 0, 1e-5, 1e-3, 2e-4};
  EXPECT_EQ(row.rows({.tolerance_of_pair = tolerance}), (Pairs{{1, 2}, {2, 3}}));
  EXPECT_EQ(row.find({.tolerance_of_pair = std::span(tolerance).first(4)}), Status::kBadOption);
  EXPECT_TRUE(row.moved.rows().empty() && row.moved.pairs().empty() && row.moved.kept_rows().empty());
  EXPECT_EQ(row.rows({.tolerance = INFINITY}).size(), 5u);
}

TEST(MovedQuery, TolerancesThatAreNoneAreRefused) {
  Row row;
  for (const double bad : {-1e-300, std::nan("")}) {
    row.rows(kTolerant);
    EXPECT_EQ(row.find({.tolerance = bad}), Status::kBadTolerance);
    EXPECT_EQ(row.scene.where(), 0u);
    row.rows(kTolerant);
    const std::vector<double> tolerance = {1, 0, 1, bad, 0};
    EXPECT_EQ(row.find({.tolerance_of_pair = tolerance}), Status::kBadTolerance);
    EXPECT_EQ(row.scene.where(), 3u);
    EXPECT_EQ(row.rows({.tolerance = INFINITY}).size(), 5u);
  }
}

TEST(MovedQuery, GivenPairsComeInTheirOrder) {
  Row row;
  ASSERT_EQ(row.scene.place(row.bodies), Status::kOk);
  const Pairs given = {{4, 3}, {0, 1}, {3, 4}, {0, 5}, {0, 1}};
  ASSERT_EQ(row.moved.find(row.scene, given, kTolerant), Status::kOk);
  EXPECT_EQ(row.moved.rows().size(), 5u);
  const Pairs next = {{0, 1}, {4, 3}, {5, 0}, {3, 4}};
  ASSERT_EQ(row.moved.find(row.scene, next, kTolerant), Status::kOk);
  EXPECT_EQ(Pairs(row.moved.rows().begin(), row.moved.rows().end()), (Pairs{{5, 0}}));
  const std::span<const std::uint32_t> kept = row.moved.kept_rows();
  EXPECT_EQ(std::vector(kept.begin(), kept.end()), (std::vector<std::uint32_t>{1, 0, kNoIndex, 2}));
  const Pairs unknown = {{0, 6}};
  EXPECT_EQ(row.moved.find(row.scene, unknown, kTolerant), Status::kUnknownInstance);
}

TEST(MovedQuery, GoesOnFromWhatItWas) {
  Row row, later;
  row.rows(kTolerant);
  row.bodies[2].pose.translation[1] += 0.0008;
  row.rows(kTolerant);
  const std::vector<PosedBodies> posed(row.moved.posed().begin(), row.moved.posed().end());
  row.bodies[2].pose.translation[1] += 0.0008;
  later.bodies = row.bodies;
  ASSERT_EQ(later.moved.resume(later.scene, posed), Status::kOk);
  EXPECT_EQ(later.rows(kTolerant), row.rows(kTolerant));
  EXPECT_EQ(later.moved.rows().size(), 2u);
  std::vector<PosedBodies> bad = posed;
  bad[1].b.asset = 2;
  EXPECT_EQ(later.moved.resume(later.scene, bad), Status::kUnknownAsset);
  EXPECT_EQ(later.scene.where(), 1u);
}

TEST(MovedQuery, ThreadsDoNotChangeIt) {
  Row one(3000), many(3000);
  RandomPoses random(4);
  ASSERT_EQ(many.scene.set_threads(7), Status::kOk);
  for (int step = 0; step < 4; ++step) {
    for (std::size_t i = 0; i < one.bodies.size(); ++i) {
      one.bodies[i].pose.translation[2] += random.symmetric(0.0008);
      many.bodies[i].pose = one.bodies[i].pose;
    }
    const Pairs rows = one.rows(kTolerant);
    EXPECT_EQ(rows, many.rows(kTolerant));
    EXPECT_TRUE(std::ranges::equal(one.moved.kept_rows(), many.moved.kept_rows()));
    EXPECT_GT(rows.size(), 0u);
  }
  EXPECT_GT(one.moved.counters().kept, 0u);
}

}  // namespace
}  // namespace tandem::test
