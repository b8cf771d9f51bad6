#include "tandem/kernels/contact_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "contact_query_fixture.h"

namespace tandem {
namespace {

using test::FaceContacts;

// --- What a scene may be.

TEST_F(Query, AnswersBeforeAnythingIsGiven) {
  expect_nothing();
  EXPECT_EQ(query_.find({}), Status::kOk);
  expect_nothing();
  EXPECT_EQ(query_.find({}, {}), Status::kOk);
  expect_nothing();
  EXPECT_EQ(query_.find({}, std::span<const ObjectPair>(), {}), Status::kOk);
  expect_nothing();
}

TEST_F(Query, TakesTheAssetsThatWereGivenLast) {
  BodyScene cubes = row_of_cubes(2), apart;
  ask(cubes);
  EXPECT_FALSE(query_.rows().empty());
  apart.assets.add(test::cube(0.25f));
  ASSERT_EQ(query_.set_assets(apart.assets.views()), Status::kOk);
  ASSERT_EQ(query_.find(cubes.instances), Status::kOk);
  EXPECT_TRUE(query_.rows().empty());
}

// --- What an answer does not depend on.

TEST_F(Query, IsTheSameWhicheverIsFirst) {
  for (int seed = 0; seed < test::trials(10, 20); ++seed) {
    const BodyScene scene = crowd(static_cast<std::uint64_t>(seed), 40);
    ask(scene);
    const FaceContacts expected = found_contacts(query_);
    std::vector<ObjectPair> swapped;
    for (const ObjectPair& pair : query_.pairs()) swapped.push_back({pair.b, pair.a});
    ask(scene, swapped);
    EXPECT_EQ(found_contacts(query_), expected);
    EXPECT_GT(expected.size(), 100u);
  }
}

TEST_F(Query, IsTheSameForGivenPairsAsForFoundOnes) {
  const BodyScene scene = crowd(1, 30);
  for (const bool selves : {false, true}) {
    ContactOptions options;
    options.self_pairs = selves;
    ask(scene, options);
    const std::vector<Contact> found = contacts_of(query_);
    const ContactCounters counters = query_.counters();
    const std::vector<ObjectPair> pairs(query_.pairs().begin(), query_.pairs().end());
    ask(scene, pairs);
    EXPECT_EQ(contacts_of(query_), found);
    EXPECT_EQ(query_.counters(), counters);
  }
}

/// Vertices and translations on a dyadic grid: every sum is exact.
TEST_F(Query, DoesNotDependOnWhereTheSceneStands) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    RandomPoses random(seed);
    BodyScene scene;
    test::Mesh mesh = test::soup(random, 30, 0.5);
    for (auto& point : mesh.points) {
      for (float& x : point) x = std::round(x * 0x1p10f) * 0x1p-10f;
    }
    scene.assets.add(mesh);
    scene.assets.add(test::cube(0.5f, 2));
    const auto dyadic = [&](double size) { return std::round(random.symmetric(size) * 0x1p10) * 0x1p-10; };
    for (std::uint32_t i = 0; i < 8; ++i) {
      Pose pose = quarter_turn(random);
      for (double& x : pose.translation) x = dyadic(1.5);
      scene.instances.push_back({i % 2, pose});
    }
    ask(scene);
    const FaceContacts expected = found_contacts(query_);
    EXPECT_GT(expected.size(), 10u);
    for (const double far : {1.0, 1e3, 1e7, 0x1p40}) {
      const double by[3] = {dyadic(far), dyadic(far), dyadic(far)};
      std::vector<Instance> moved = scene.instances;
      for (Instance& instance : moved) {
        for (int k = 0; k < 3; ++k) instance.pose.translation[k] += by[k];
      }
      ASSERT_EQ(query_.find(moved), Status::kOk);
      EXPECT_EQ(found_contacts(query_), expected) << far;
    }
  }
}

/// Braces stand for default options; no pairs at all are an empty list of them.
TEST_F(Query, BracesAreDefaultOptions) {
  const BodyScene scene = row_of_cubes(3);
  ask(scene);
  const std::vector<Contact> expected = contacts_of(query_);
  ASSERT_FALSE(expected.empty());
  ASSERT_EQ(query_.find(scene.instances, {}), Status::kOk);
  EXPECT_EQ(contacts_of(query_), expected);
  ASSERT_EQ(query_.find(scene.instances, std::span<const ObjectPair>(), {}), Status::kOk);
  EXPECT_TRUE(contacts_of(query_).empty());
}

/// Rounding aside, which generic triangles have room for.
TEST_F(Query, FastIsExactWhereTrianglesAreGeneric) {
  RandomPoses random(4);
  BodyScene scene;
  scene.assets.add(test::soup(random, 200, 0.3));
  for (int i = 0; i < 6; ++i) scene.instances.push_back({0, random.pose({1, 1, 0.5, 0, 4})});
  ask(scene);
  const FaceContacts exact = found_contacts(query_);
  ContactOptions options;
  options.mode = QueryMode::fast;
  ask(scene, options);
  EXPECT_EQ(found_contacts(query_), exact);
  EXPECT_GT(exact.size(), 1000u);
  EXPECT_EQ(query_.counters().decided_by_float32, query_.counters().candidates);
}

// --- Errors.

TEST_F(Query, NamesAnOriginThatIsOutOfRange) {
  BodyScene scene;
  scene.assets.add(test::cube(0.5f));
  scene.assets.add(test::cube(0.5f), {1e308, 1e308, 1e308});
  scene.instances = {{0, kIdentityPose}, {1, kIdentityPose}};
  ASSERT_EQ(query_.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(query_.find(scene.instances), Status::kOutOfRange);
  EXPECT_EQ(query_.where(), 1u);
  // Products of 1e308 overflow, and their sum is no number.
  const Pose turned = {{{0.6, 0.8, 0}, {-0.8, 0.6, 0}, {0, 0, 1}}, {0, 0, 0}};
  scene.instances[1].pose = turned;
  EXPECT_EQ(query_.find(scene.instances), Status::kOutOfRange);
  expect_nothing();
  expect_usable();
}

// --- Moving.

TEST_F(Query, MovesWithItsResultsAndThreads) {
  const BodyScene scene = crowd(3, 20);
  EXPECT_EQ(query_.scene.set_threads(3), Status::kOk);
  ask(scene);
  const std::vector<Contact> expected = contacts_of(query_);
  test::Asked<ContactQuery> other = std::move(query_);
  EXPECT_EQ(contacts_of(other), expected);
  ASSERT_EQ(other.find(scene.instances), Status::kOk);
  EXPECT_EQ(contacts_of(other), expected);
  query_ = std::move(other);
  EXPECT_EQ(contacts_of(query_), expected);
  expect_usable();
}

TEST_F(Query, IsAsNewOnceItIsMovedFrom) {
  const BodyScene scene = row_of_cubes(2);
  ask(scene);
  const test::Asked<ContactQuery> other = std::move(query_);
  EXPECT_TRUE(query_.pairs().empty());
  EXPECT_TRUE(query_.rows().empty());
  EXPECT_EQ(query_.scene.where(), 0u);
  EXPECT_EQ(query_.scene.place(scene.instances), Status::kUnknownAsset);
  expect_usable();
}

}  // namespace
}  // namespace tandem
