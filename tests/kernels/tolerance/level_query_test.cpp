// Queries at levels of detail: what they say of the finest level.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "kernels/asked.h"
#include "kernels/geometry/level_error.h"
#include "level_scenes.h"

namespace tandem {
namespace {

using test::BodyScene;
using test::LevelViews;
using test::RandomPoses;

std::vector<ObjectPair> every_pair(std::size_t count) {
  std::vector<ObjectPair> pairs;
  for (std::uint32_t a = 0; a < count; ++a) {
    for (std::uint32_t b = a + 1; b < count; ++b)
      pairs.push_back(a % 2 == 0 ? ObjectPair{a, b} : ObjectPair{b, a});
  }
  return pairs;
}

/// The pairs of instances, ascending, that have a contact.
std::set<std::pair<std::uint32_t, std::uint32_t>> pairs_with_contacts(
    const test::Asked<ContactQuery>& query) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> out;
  for (const Contact& contact : query.rows()) {
    const auto [a, b] = query.pairs()[contact.pair];
    out.insert(std::minmax(a, b));
  }
  return out;
}

using LevelOfBody = std::vector<std::uint32_t>;

std::vector<Instance> at_levels(const BodyScene& scene, const LevelViews& views, const LevelOfBody& level) {
  std::vector<Instance> out = scene.instances;
  for (std::size_t i = 0; i < out.size(); ++i) out[i].asset = views.first[out[i].asset] + level[i];
  return out;
}

LevelOfBody any_levels(const BodyScene& scene, RandomPoses& random) {
  LevelOfBody level;
  for (const Instance& instance : scene.instances)
    level.push_back(
        static_cast<std::uint32_t>(random.below(scene.assets.views()[instance.asset].levels.size())));
  return level;
}

double error_of(const BodyScene& scene, std::size_t instance, std::uint32_t level) {
  const AssetView& asset = scene.assets.views()[scene.instances[instance].asset];
  return posed_level_error(asset.level(level), asset.header->lower, asset.header->upper,
                           for_stored_coordinates(scene.instances[instance].pose, asset.header->origin));
}

/// Runs check(scene, views, random, seed) on random scenes.
template <typename Check>
void for_scenes(int count, Check check) {
  for (int seed = 0; seed < count && !testing::Test::HasFailure(); ++seed) {
    RandomPoses random(4711 + static_cast<std::uint64_t>(seed));
    const BodyScene scene = test::any_level_scene(random);
    check(scene, LevelViews(scene.assets.views()), random);
    if (testing::Test::HasFailure()) std::printf("seed %d:\n%s", seed, test::text(scene).c_str());
  }
}

TEST(LevelQuery, NoContactAtAnyLevelMeansApartAtTheFinest) {
  test::Asked<ContactQuery> finest, coarse;
  std::size_t met = 0, told_apart = 0, asked = 0;
  for_scenes(
      test::trials(400, 50), [&](const BodyScene& scene, const LevelViews& views, RandomPoses& random) {
        const double within =
            random.below(2) == 0 ? 0 : test::any_distance(random, scene) * random.uniform(0, 0.2);
        const std::vector<ObjectPair> pairs = every_pair(scene.instances.size());
        ASSERT_EQ(finest.set_assets(scene.assets.views()), Status::kOk);
        ASSERT_EQ(finest.find(scene.instances, pairs, {.within = within}), Status::kOk);
        const auto truth = pairs_with_contacts(finest);
        ASSERT_EQ(coarse.set_assets(views.views), Status::kOk);
        for (int trial = 0; trial < 6; ++trial) {
          const auto bodies = at_levels(scene, views, any_levels(scene, random));
          EXPECT_EQ(coarse.scene.set_threads(1 + static_cast<std::uint32_t>(trial % 2)), Status::kOk);
          const ContactOptions options = {
              .first_contact_only = trial % 2 == 0, .within = within, .add_error_bounds = true};
          ASSERT_EQ(trial % 3 == 0 ? coarse.find(bodies, options) : coarse.find(bodies, pairs, options),
                    Status::kOk);
          const auto near = pairs_with_contacts(coarse);
          EXPECT_TRUE(std::includes(near.begin(), near.end(), truth.begin(), truth.end()));
          asked += pairs.size();
          met += truth.size();
          told_apart += pairs.size() - near.size();
        }
      });
  EXPECT_GT(met, asked / 10);
  EXPECT_GT(told_apart, asked / 10);
}

TEST(LevelQuery, AContactIsWithinTwiceTheErrorsAtTheFinest) {
  test::Asked<ContactQuery> finest, coarse;
  std::size_t beyond = 0;
  for_scenes(
      test::trials(200, 50), [&](const BodyScene& scene, const LevelViews& views, RandomPoses& random) {
        ASSERT_EQ(finest.set_assets(scene.assets.views()), Status::kOk);
        ASSERT_EQ(coarse.set_assets(views.views), Status::kOk);
        const LevelOfBody level = any_levels(scene, random);
        ASSERT_EQ(coarse.find(at_levels(scene, views, level), every_pair(level.size()),
                              {.first_contact_only = true, .add_error_bounds = true}),
                  Status::kOk);
        for (const auto& pair : pairs_with_contacts(coarse)) {
          const auto [a, b] = pair;
          const double d = 2 * (1 + 1e-15) * (error_of(scene, a, level[a]) + error_of(scene, b, level[b]));
          const ObjectPair both[] = {{a, b}};
          ASSERT_EQ(finest.find(scene.instances, both, {.within = d}), Status::kOk);
          EXPECT_FALSE(finest.rows().empty());
          ASSERT_EQ(finest.find(scene.instances, both, {}), Status::kOk);
          beyond += finest.rows().empty() ? 1 : 0;
        }
      });
  EXPECT_GT(beyond, 0u);
}

TEST(LevelQuery, FinestLevelsAreDecidedAsWithout) {
  test::Asked<ContactQuery> plain, with;
  for_scenes(test::trials(60, 20), [&](const BodyScene& scene, const LevelViews&, RandomPoses& random) {
    ASSERT_EQ(plain.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(with.set_assets(scene.assets.views()), Status::kOk);
    for (const double within : {0.0, test::any_distance(random, scene)}) {
      const bool selves = random.below(2) == 0;
      ASSERT_EQ(plain.find(scene.instances, {.self_pairs = selves, .within = within}), Status::kOk);
      ASSERT_EQ(
          with.find(scene.instances, {.self_pairs = selves, .within = within, .add_error_bounds = true}),
          Status::kOk);
      EXPECT_TRUE(std::ranges::equal(plain.rows(), with.rows()));
      EXPECT_EQ(plain.counters(), with.counters());
    }
  });
}

TEST(LevelQuery, AnInstanceWithItselfIsAskedForContactsOfItsLevel) {
  RandomPoses random(3);
  BodyScene scene;
  test::add_levels(scene.assets, test::split_levels(test::soup(random, 20, 0.5), 3, 0.05, random));
  scene.instances = {{0, random.pose({})}};
  const LevelViews views(scene.assets.views());
  const ObjectPair self[] = {{0, 0}};
  test::Asked<ContactQuery> query;
  ASSERT_EQ(query.set_assets(views.views), Status::kOk);
  for (std::uint32_t level = 0; level < 3; ++level) {
    const auto body = at_levels(scene, views, {level});
    ASSERT_EQ(query.find(body, self, {}), Status::kOk);
    const std::vector<Contact> plain(query.rows().begin(), query.rows().end());
    ASSERT_EQ(query.find(body, self, {.add_error_bounds = true}), Status::kOk);
    EXPECT_TRUE(std::ranges::equal(query.rows(), plain));
  }
}

TEST(LevelQuery, KeptInstancesAreFoundAtTheirLevels) {
  test::Asked<ContactQuery> kept, anew;
  std::size_t found = 0;
  for_scenes(40, [&](const BodyScene& scene, const LevelViews& views, RandomPoses& random) {
    const auto bodies = at_levels(scene, views, any_levels(scene, random));
    std::vector<Motion> motion(bodies.size(), Motion::moving);
    for (std::size_t i = 0; i < motion.size(); i += 2) motion[i] = Motion::fixed;
    std::vector<ObjectPair> not_both_fixed;
    for (const ObjectPair& pair : every_pair(bodies.size())) {
      if (motion[pair.a] != Motion::fixed || motion[pair.b] != Motion::fixed) not_both_fixed.push_back(pair);
    }
    ASSERT_EQ(kept.set_assets(views.views), Status::kOk);
    ASSERT_EQ(anew.set_assets(views.views), Status::kOk);
    kept.filter.motion = motion.data();
    const ContactOptions options = {.add_error_bounds = true};
    ASSERT_EQ(kept.find(bodies, options), Status::kOk);
    ASSERT_EQ(anew.find(bodies, not_both_fixed, options), Status::kOk);
    EXPECT_EQ(pairs_with_contacts(kept), pairs_with_contacts(anew));
    EXPECT_EQ(kept.rows().size(), anew.rows().size());
    found += kept.rows().size();
  });
  EXPECT_GT(found, 0u);
}

/// Two sheets that face each other, each with a spike of its finest level in the middle that points at the
/// other: where the spikes just touch, the coarse levels are as far apart as their errors are together.
class Spikes {
 public:
  explicit Spikes(float height) {
    for (const float side : {1.0f, -1.0f}) {
      test::Mesh coarse, fine;
      const std::array<float, 3> a = {-1, -1, 0}, b = {1, -1, 0}, c = {0, 2, 0}, top = {0, 0, side * height};
      coarse.add(a, b, c);
      fine.add(a, b, top);
      fine.add(b, c, top);
      fine.add(c, a, top);
      test::add_levels(scene.assets, {{fine, coarse}, {0, static_cast<double>(height)}});
    }
  }
  BodyScene scene;
};

TEST(LevelQuery, TheSlackCoversRotationsThatAreNotQuiteRigidAndRounding) {
  test::Asked<ContactQuery> finest, coarse;
  int met = 0, missed_without_slack = 0;
  for (int seed = 0; seed < test::trials(3000, 30); ++seed) {
    RandomPoses random(9000 + static_cast<std::uint64_t>(seed));
    Spikes spikes(static_cast<float>(std::pow(10, -random.uniform(0, 7))));
    BodyScene& scene = spikes.scene;
    const double height = static_cast<double>(scene.assets.mesh(0).points[2][2]) != 0
                              ? scene.assets.mesh(0).points[2][2]
                              : scene.assets.mesh(0).points[8][2];
    const double aways[] = {0, 1, 1e7, 1e12};
    const double away = aways[random.below(4)];
    // Its scale is mostly as large as is_rigid() lets pass.
    Pose pose = random.pose({1, 1, 0, 0, 4});
    const double factor = random.below(3) == 0 ? 1 : 1 + 0.4999 * kRigidTolerance;
    for (auto& row : pose.rotation) {
      for (double& x : row) x *= factor;
    }
    for (double& x : pose.translation) x = random.symmetric(away);
    ASSERT_TRUE(is_rigid(pose));
    scene.instances = {{0, pose}, {1, pose}};
    // b is moved away along the axis as far as the spikes touch, by bisection.
    ASSERT_EQ(finest.set_assets(scene.assets.views()), Status::kOk);
    double near = 0, far = 4 * height + 1e-12 * away;
    const auto touch = [&](double by) {
      for (int k = 0; k < 3; ++k)
        scene.instances[1].pose.translation[k] = pose.translation[k] + pose.rotation[k][2] * by;
      EXPECT_EQ(finest.find(scene.instances, every_pair(2), {}), Status::kOk);
      return !finest.rows().empty();
    };
    for (int i = 0; i < 200 && near < far; ++i) {
      const double middle = near + (far - near) / 2;
      if (middle == near || middle == far) break;
      (touch(middle) ? near : far) = middle;
    }
    if (!touch(near)) continue;
    ++met;
    const LevelViews views(scene.assets.views());
    ASSERT_EQ(coarse.set_assets(views.views), Status::kOk);
    for (const LevelOfBody& level : {LevelOfBody{1, 1}, {0, 1}, {1, 0}}) {
      const auto bodies = at_levels(scene, views, level);
      ASSERT_EQ(coarse.find(bodies, every_pair(2), {.add_error_bounds = true}), Status::kOk);
      EXPECT_FALSE(coarse.rows().empty()) << seed;
      ASSERT_EQ(coarse.find(bodies, every_pair(2), {.within = height * (level[0] + level[1])}), Status::kOk);
      missed_without_slack += coarse.rows().empty() ? 1 : 0;
    }
  }
  EXPECT_GT(met, 1000);
  EXPECT_GT(missed_without_slack, 100);
}

}  // namespace
}  // namespace tandem
