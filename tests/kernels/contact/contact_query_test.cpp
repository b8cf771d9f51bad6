#include "tandem/kernels/contact_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
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

TEST_F(Query, FindsNothingInEmptyScenes) {
  expect_usable();
  EXPECT_EQ(query_.find({}), Status::kOk);
  expect_nothing();
  expect_usable();
  EXPECT_EQ(query_.set_assets({}), Status::kOk);
  EXPECT_EQ(query_.find({}), Status::kOk);
  expect_nothing();
}

TEST_F(Query, FindsNoPairOfOneInstance) {
  BodyScene scene = row_of_cubes(1);
  ask(scene);
  expect_nothing();
  ContactOptions options;
  options.self_pairs = true;
  ask(scene, options);
  EXPECT_EQ(pairs_of(query_), (std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 0}}));
  EXPECT_EQ(found_contacts(query_), all_contacts(scene, true));
}

TEST_F(Query, TakesNoGivenPairs) {
  expect_usable();
  ask(row_of_cubes(3), std::vector<ObjectPair>{});
  expect_nothing();
}

TEST_F(Query, FindsSelfPairsAmongTheOthersInOrder) {
  BodyScene scene = row_of_cubes(3);
  scene.instances.insert(scene.instances.begin(), {0, at(100, 0, 0)});
  scene.instances.push_back({0, at(-100, 0, 0)});
  ContactOptions options;
  options.self_pairs = true;
  ask(scene, options);
  EXPECT_EQ(pairs_of(query_), (std::vector<std::pair<std::uint32_t, std::uint32_t>>{
                                  {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 3}, {3, 3}, {4, 4}}));
  EXPECT_EQ(found_contacts(query_), all_contacts(scene, true));
  options.self_pairs = false;
  ask(scene, options);
  EXPECT_EQ(found_contacts(query_), all_contacts(scene, false));
}

TEST_F(Query, KeepsGivenPairsAsTheyAreRepeatedAndSwapped) {
  const BodyScene scene = row_of_cubes(3);
  const std::vector<ObjectPair> given = {{2, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 1}, {0, 1}};
  ask(scene, given);
  ASSERT_EQ(query_.pairs().size(), given.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    EXPECT_EQ(query_.pairs()[i].a, given[i].a);
    EXPECT_EQ(query_.pairs()[i].b, given[i].b);
  }
  FaceContacts expected;
  for (const ObjectPair& pair : given) {
    const FaceContacts more = all_contacts(scene, pair.a, pair.b);
    expected.insert(expected.end(), more.begin(), more.end());
  }
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(found_contacts(query_), expected);
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

TEST_F(Query, DoesNotDependOnTheOrderOfInstances) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const BodyScene scene = crowd(seed, 12);
    ask(scene);
    const FaceContacts expected = found_contacts(query_);
    std::vector<std::uint32_t> order(scene.instances.size());
    std::iota(order.begin(), order.end(), 0u);
    RandomPoses random(seed);
    std::shuffle(order.begin(), order.end(), random.engine());
    std::vector<Instance> shuffled;
    for (const std::uint32_t i : order) shuffled.push_back(scene.instances[i]);
    ASSERT_EQ(query_.find(shuffled), Status::kOk);
    FaceContacts found;
    for (auto contact : found_contacts(query_)) {
      contact.a = order[contact.a];
      contact.b = order[contact.b];
      if (contact.a > contact.b) {
        std::swap(contact.a, contact.b);
        std::swap(contact.face_a, contact.face_b);
      }
      found.push_back(contact);
    }
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected);
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

/// Errors of instances are the same for pairs found and given, and leave nothing behind.
class QueryErrors : public Query {
 protected:
  void expect_error(const Instance& bad, Status status) {
    for (const std::size_t place : {0u, 1u, 3u}) {
      BodyScene scene = row_of_cubes(4);
      scene.instances[place] = bad;
      ASSERT_EQ(query_.set_assets(scene.assets.views()), Status::kOk);
      EXPECT_EQ(query_.find(scene.instances), status);
      EXPECT_EQ(query_.where(), place);
      expect_nothing();
      expect_usable();
      const std::vector<ObjectPair> pairs = {{0, 1}, {1, 2}};
      EXPECT_EQ(query_.find(scene.instances, pairs, {}), status);
      EXPECT_EQ(query_.where(), place);
      expect_nothing();
      expect_usable();
    }
  }
};

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                 kInf = std::numeric_limits<double>::infinity();

TEST_F(QueryErrors, NameAnUnknownAsset) {
  expect_error({1, kIdentityPose}, Status::kUnknownAsset);
  expect_error({0xFFFFFFFF, kIdentityPose}, Status::kUnknownAsset);
}

TEST_F(QueryErrors, NameAnUnknownAssetWhereNoneWasGiven) {
  const std::vector<Instance> instances = {{0, kIdentityPose}};
  EXPECT_EQ(query_.find(instances), Status::kUnknownAsset);
  EXPECT_EQ(query_.where(), 0u);
  expect_usable();
}

TEST_F(QueryErrors, NameAPoseThatIsNotRigid) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (const double x : {kNaN, kInf, -kInf, 0.5, 1e200}) {
        Pose pose = kIdentityPose;
        pose.rotation[i][j] = x;
        expect_error({0, pose}, Status::kPoseNotRigid);
      }
    }
    for (const double x : {kNaN, kInf, -kInf}) {
      Pose pose = kIdentityPose;
      pose.translation[i] = x;
      expect_error({0, pose}, Status::kPoseNotRigid);
    }
    Pose mirror = kIdentityPose;
    mirror.rotation[i][i] = -1;
    expect_error({0, mirror}, Status::kPoseNotRigid);
    Pose scaled = kIdentityPose;
    scaled.rotation[i][i] = 1 + 2e-6;
    expect_error({0, scaled}, Status::kPoseNotRigid);
  }
  expect_error({0, Pose{}}, Status::kPoseNotRigid);
}

TEST_F(QueryErrors, NameWhatIsOutOfRange) {
  for (int i = 0; i < 3; ++i) {
    for (const double x : {1.1e300, -1.1e300, 1.7e308, -1.7e308}) {
      Pose pose = kIdentityPose;
      pose.translation[i] = x;
      expect_error({0, pose}, Status::kOutOfRange);
    }
  }
}

TEST_F(QueryErrors, NameAnOriginThatIsOutOfRange) {
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

TEST_F(QueryErrors, NameAnUnknownInstance) {
  const BodyScene scene = row_of_cubes(3);
  for (const ObjectPair bad : {ObjectPair{3, 0}, ObjectPair{0, 3}, ObjectPair{0xFFFFFFFF, 0xFFFFFFFF}}) {
    for (const std::size_t place : {0u, 2u}) {
      std::vector<ObjectPair> pairs = {{0, 1}, {1, 2}, {0, 2}};
      pairs[place] = bad;
      ASSERT_EQ(query_.set_assets(scene.assets.views()), Status::kOk);
      EXPECT_EQ(query_.find(scene.instances, pairs, {}), Status::kUnknownInstance);
      EXPECT_EQ(query_.where(), place);
      expect_nothing();
      expect_usable();
    }
  }
  const std::vector<ObjectPair> pairs = {{0, 0}};
  EXPECT_EQ(query_.find({}, pairs, {}), Status::kUnknownInstance);
}

/// The largest of everything that is in range.
TEST_F(QueryErrors, AreNotWhatIsBarelyInRange) {
  BodyScene scene = row_of_cubes(2);
  for (Instance& instance : scene.instances) instance.pose = at(1e300, -1e300, 1e300);
  ask(scene);
  EXPECT_EQ(query_.rows().size(), 144u);  // every vertex rounds to one point
  scene.instances[1].pose = at(1e300, 1e300, 1e300);
  ask(scene);
  EXPECT_TRUE(query_.rows().empty());
}

TEST_F(QueryErrors, AreOfInstancesBeforePairs) {
  BodyScene scene = row_of_cubes(2);
  scene.instances[1].asset = 9;
  const std::vector<ObjectPair> pairs = {{0, 7}};
  ASSERT_EQ(query_.set_assets(scene.assets.views()), Status::kOk);
  EXPECT_EQ(query_.find(scene.instances, pairs, {}), Status::kUnknownAsset);
  EXPECT_EQ(query_.where(), 1u);
}

// --- Moving.

TEST_F(Query, MovesWithItsResultsAndThreads) {
  const BodyScene scene = crowd(3, 20);
  query_.scene.set_threads(3);
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
