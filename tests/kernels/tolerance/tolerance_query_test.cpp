// Queries by tolerance: verdicts against the finest levels.
#include "tandem/kernels/tolerance_query.h"
#include "kernels/asked.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "level_scenes.h"
#include "tandem/kernels/distance_query.h"

namespace tandem {
namespace {

using test::BodyScene;
using test::RandomPoses;

/// Whether the finest surfaces of each pair meet, by the contact query.
std::vector<bool> truth_of(const BodyScene& scene, std::span<const ObjectPair> pairs) {
  test::Asked<ContactQuery> query;
  EXPECT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(query.find(scene.instances, pairs, {.first_contact_only = true}), Status::kOk);
  std::vector<bool> meet(pairs.size());
  for (const Contact& contact : query.rows()) meet[contact.pair] = true;
  return meet;
}

/// Expects the verdicts of the last call to be right and the counters to tell of them.
void expect_right(const test::Asked<ToleranceQuery>& query, const BodyScene& scene, double tolerance) {
  ASSERT_EQ(query.rows().size(), query.pairs().size());
  const std::vector<bool> meet = truth_of(scene, query.pairs());
  test::Asked<DistanceQuery> distance;
  ASSERT_EQ(distance.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(distance.find(scene.instances, query.pairs(), {}), Status::kOk);
  ToleranceCounters counted;
  for (std::size_t i = 0; i < meet.size(); ++i) {
    const auto [verdict, level_a, level_b] = query.rows()[i];
    switch (verdict) {
      case ToleranceVerdict::apart:
        ++counted.apart;
        EXPECT_FALSE(meet[i]);
        break;
      case ToleranceVerdict::touching:
        ++counted.touching;
        EXPECT_TRUE(meet[i]);
        EXPECT_EQ(level_a + level_b, 0);
        break;
      case ToleranceVerdict::within_tolerance:
        ++counted.within_tolerance;
        EXPECT_GT(level_a + level_b, 0);
        EXPECT_LE(distance.rows()[i].upper, tolerance * (1 + 1e-5));
        break;
    }
  }
  const ToleranceCounters& counters = query.counters();
  EXPECT_EQ(counters.apart, counted.apart);
  EXPECT_EQ(counters.touching, counted.touching);
  EXPECT_EQ(counters.within_tolerance, counted.within_tolerance);
  EXPECT_EQ(counters.work.object_pairs, meet.size());
}

double any_tolerance(RandomPoses& random, const BodyScene& scene) {
  const AssetView& asset = scene.assets.views()[random.below(scene.assets.size())];
  const double errors =
      asset.level(static_cast<std::uint32_t>(random.below(asset.levels.size()))).error_bound;
  switch (random.below(4)) {
    case 0:
      return 0;
    case 1:
      return 4.1 * errors;
    case 2:
      return errors * random.uniform(0, 10);
    default:
      return test::any_distance(random, scene);
  }
}

TEST(ToleranceQuery, VerdictsAreThoseOfTheFinestLevelsWhereTheyAreCertain) {
  test::Asked<ToleranceQuery> query, threaded;
  ToleranceCounters all;
  for (int seed = 0; seed < test::trials(400, 50) && !HasFailure(); ++seed) {
    RandomPoses random(815 + static_cast<std::uint64_t>(seed));
    const BodyScene scene = test::any_level_scene(random);
    const double tolerance = any_tolerance(random, scene);
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(query.find(scene.instances, {.tolerance = tolerance}), Status::kOk);
    expect_right(query, scene, tolerance);
    ASSERT_EQ(threaded.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(threaded.find(scene.instances, {.tolerance = tolerance}), Status::kOk);
    EXPECT_TRUE(std::ranges::equal(query.rows(), threaded.rows()));
    EXPECT_EQ(query.counters(), threaded.counters());
    // These pairs are given now.
    std::vector<ObjectPair> pairs(query.pairs().begin(), query.pairs().end());
    const std::vector<PairVerdict> verdicts(query.rows().begin(), query.rows().end());
    for (ObjectPair& pair : pairs) std::swap(pair.a, pair.b);
    ASSERT_EQ(query.find(scene.instances, pairs, {.tolerance = tolerance}), Status::kOk);
    expect_right(query, scene, tolerance);
    for (std::size_t i = 0; i < pairs.size(); ++i) EXPECT_EQ(query.rows()[i].verdict, verdicts[i].verdict);
    EXPECT_TRUE(tolerance > 0 || query.counters().within_tolerance == 0);
    all.apart += query.counters().apart;
    all.touching += query.counters().touching;
    all.within_tolerance += query.counters().within_tolerance;
    if (HasFailure()) std::printf("seed %d, tolerance %a:\n%s", seed, tolerance, test::text(scene).c_str());
  }
  EXPECT_GT(all.apart, 50u);
  EXPECT_GT(all.touching, 200u);
  EXPECT_GT(all.within_tolerance, 200u);
}

/// Balls of three levels whose errors are 0, 0.01 and 0.1 at most, 1 in radius.
class Balls : public testing::Test {
 protected:
  Balls() {
    RandomPoses random(1);
    auto levels = test::split_levels(test::cube(1, 4), 3, 0.001, random);
    levels.error = {0, std::max(0.01, levels.error[1]), std::max(0.1, levels.error[2])};
    test::add_levels(scene_.assets, levels);
    scene_.instances = {{0, kIdentityPose}, {0, kIdentityPose}};
    EXPECT_EQ(query_.set_assets(scene_.assets.views()), Status::kOk);
  }
  PairVerdict verdict_at(double gap, double tolerance, double away = 0) {
    for (Instance& instance : scene_.instances) instance.pose.translation[1] = away;
    scene_.instances[0].pose.translation[0] = away;
    scene_.instances[1].pose.translation[0] = away + 2 + gap;
    const ObjectPair both[] = {{0, 1}};
    EXPECT_EQ(query_.find(scene_.instances, both, {.tolerance = tolerance}), Status::kOk);
    return query_.rows()[0];
  }
  BodyScene scene_;
  test::Asked<ToleranceQuery> query_;
};

TEST_F(Balls, AreLookedAtAtTheCoarsestLevelThatTells) {
  EXPECT_EQ(verdict_at(-0.1, 0.41), (PairVerdict{ToleranceVerdict::within_tolerance, 2, 2}));
  EXPECT_EQ(verdict_at(0.1, 0.41), (PairVerdict{ToleranceVerdict::within_tolerance, 2, 2}));
  EXPECT_EQ(verdict_at(0.3, 0.41), (PairVerdict{ToleranceVerdict::apart, 2, 2}));
  EXPECT_EQ(verdict_at(0.1, 0.39), (PairVerdict{ToleranceVerdict::apart, 1, 1}));
  EXPECT_EQ(verdict_at(0.005, 0.041), (PairVerdict{ToleranceVerdict::within_tolerance, 1, 1}));
}

TEST_F(Balls, AreDecidedExactlyWhereNoOtherLevelTells) {
  for (const double tolerance : {0.0, 0.039}) {
    EXPECT_EQ(verdict_at(-0.1, tolerance), (PairVerdict{ToleranceVerdict::touching, 0, 0}));
    EXPECT_EQ(verdict_at(0.005, tolerance), (PairVerdict{ToleranceVerdict::apart, 0, 0}));
  }
}

TEST_F(Balls, FarAwayRoundingIsAnErrorToo) {
  EXPECT_EQ(verdict_at(-0.1, 0.0401, 1e7).verdict, ToleranceVerdict::within_tolerance);
  // One unit in the last place is a quarter here: no level tells what is within 0.41 of a finest surface.
  EXPECT_EQ(verdict_at(-0.5, 0.41, 2e15), (PairVerdict{ToleranceVerdict::touching, 0, 0}));
}

TEST_F(Balls, AnInstanceTouchesItself) {
  const ObjectPair selves[] = {{0, 0}, {1, 1}};
  ASSERT_EQ(query_.find(scene_.instances, selves, {.tolerance = 1}), Status::kOk);
  for (const PairVerdict& verdict : query_.rows())
    EXPECT_EQ(verdict, (PairVerdict{ToleranceVerdict::touching, 0, 0}));
}

TEST_F(Balls, AViewWithoutTheFinestLevelIsRefused) {
  const AssetView views[] = {scene_.assets.views()[0], scene_.assets.views()[0].levels_from(1)};
  scene_.instances[1].asset = 1;
  EXPECT_EQ(query_.set_assets(views), Status::kOk);
  EXPECT_EQ(query_.find(scene_.instances, {}), Status::kNoFinestLevel);
  EXPECT_EQ(query_.where(), 1u);
  const AssetView empty[] = {{}};
  EXPECT_EQ(query_.set_assets(empty), Status::kUnknownAsset);
  EXPECT_EQ(query_.find(scene_.instances, {}), Status::kUnknownAsset);
}

TEST_F(Balls, PairsOfTheLastCallMayBeGivenAgain) {
  verdict_at(-0.1, 0);
  ASSERT_EQ(query_.find(scene_.instances, {}), Status::kOk);
  ASSERT_EQ(query_.pairs().size(), 1u);
  ASSERT_EQ(query_.find(scene_.instances, query_.pairs(), {}), Status::kOk);
  ASSERT_EQ(query_.pairs().size(), 1u);
  EXPECT_EQ(query_.rows()[0].verdict, ToleranceVerdict::touching);
  ASSERT_EQ(query_.find({}, {}), Status::kOk);
  EXPECT_TRUE(query_.pairs().empty());
  EXPECT_EQ(query_.counters(), ToleranceCounters());
}

}  // namespace
}  // namespace tandem
