// Contact queries by any number of threads, and several of them at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <vector>

#include "contact_query_fixture.h"

namespace tandem {
namespace {

TEST_F(Query, DoesNotDependOnThreads) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const BodyScene scene = crowd(seed, 60);
    for (const QueryMode mode : {QueryMode::exact, QueryMode::fast, QueryMode::boxes}) {
      for (const bool first_only : {false, true}) {
        const ContactOptions options = {mode, first_only, true};
        EXPECT_EQ(query_.scene.set_threads(1), Status::kOk);
        ask(scene, options);
        const std::vector<Contact> expected = contacts_of(query_);
        const ContactCounters counters = query_.counters();
        EXPECT_GT(counters.object_pairs, 8 * 16u);
        for (const std::uint32_t threads : {2u, 3u, 8u, 3u, 40u}) {
          EXPECT_EQ(query_.scene.set_threads(threads), Status::kOk);
          ask(scene, options);
          EXPECT_EQ(contacts_of(query_), expected) << threads;
          EXPECT_EQ(query_.counters(), counters) << threads;
        }
      }
    }
  }
}

TEST_F(Query, RefusesOtherNumbersOfThreads) {
  for (const std::uint32_t threads : {0u, kMostSceneThreads + 1, 4000000000u}) {
    EXPECT_EQ(query_.scene.set_threads(threads), Status::kBadOption) << threads;
    EXPECT_EQ(query_.scene.where(), 0u);
  }
  EXPECT_EQ(query_.scene.set_threads(kMostSceneThreads), Status::kOk);
}

/// Enough instances for the poses and the broad phase of many threads, few pairs; some in one place, two far
/// away.
BodyScene wide_crowd(std::uint64_t seed, int instances) {
  BodyScene scene = crowd(seed, instances);
  RandomPoses random(seed);
  const double half_side = 0.7 * std::cbrt(instances);
  for (Instance& instance : scene.instances)
    for (double& x : instance.pose.translation) x = random.symmetric(half_side);
  for (std::size_t i = 3; i < 8; ++i) scene.instances[i] = scene.instances[2];
  scene.instances[8].pose = at(1e9, -1e9, 0);
  scene.instances[9].pose = at(1e9, -1e9, 0.25);
  return scene;
}

TEST_F(Query, OfManyInstancesDoesNotDependOnThreads) {
  for (const int instances : {130, 700, 2500}) {
    const BodyScene scene = wide_crowd(static_cast<std::uint64_t>(instances), instances);
    for (const bool selves : {false, true}) {
      ContactOptions options;
      options.self_pairs = selves;
      ask(scene, options);
      const auto pairs = pairs_of(query_);
      std::vector<ObjectPair> given(query_.pairs().begin(), query_.pairs().end());
      const std::vector<Contact> expected = contacts_of(query_);
      const ContactCounters counters = query_.counters();
      EXPECT_GT(pairs.size(), static_cast<std::size_t>(instances));
      EXPECT_GT(expected.size(), static_cast<std::size_t>(instances));
      std::reverse(given.begin(), given.end());
      EXPECT_EQ(query_.scene.set_threads(1), Status::kOk);
      ask(scene, given, options);
      const std::vector<Contact> reversed = contacts_of(query_);
      EXPECT_EQ(reversed.size(), expected.size());
      for (const std::uint32_t threads : {2u, 3u, 4u, 16u, 5u, 100u}) {
        EXPECT_EQ(query_.scene.set_threads(threads), Status::kOk);
        ask(scene, options);
        EXPECT_EQ(pairs_of(query_), pairs) << threads;
        EXPECT_EQ(contacts_of(query_), expected) << threads;
        EXPECT_EQ(query_.counters(), counters) << threads;
        ASSERT_EQ(query_.scene.find_pairs(0, selves), Status::kOk);
        ASSERT_EQ(query_.find(scene.instances, query_.scene.pairs(), options), Status::kOk);
        EXPECT_EQ(pairs_of(query_), pairs) << threads;
        ASSERT_EQ(query_.find(scene.instances, query_.pairs(), options), Status::kOk);
        EXPECT_EQ(contacts_of(query_), expected) << threads;
        ask(scene, given, options);
        EXPECT_EQ(contacts_of(query_), reversed) << threads;
      }
    }
  }
}

/// Whichever thread comes upon a later one first.
TEST_F(Query, NamesTheFirstInstanceThatItRefusesWhateverTheThreads) {
  const BodyScene scene = wide_crowd(7, 1500);
  Pose scaled = kIdentityPose;
  scaled.rotation[0][0] = 2;
  const std::pair<Instance, Status> refused[] = {{{99, kIdentityPose}, Status::kUnknownAsset},
                                                 {{0, scaled}, Status::kPoseNotRigid},
                                                 {{0, at(0, 1e305, 0)}, Status::kOutOfRange}};
  ASSERT_EQ(query_.set_assets(scene.assets.views()), Status::kOk);
  for (const std::uint32_t threads : {1u, 2u, 4u, 16u}) {
    EXPECT_EQ(query_.scene.set_threads(threads), Status::kOk);
    for (std::size_t kind = 0; kind < 3; ++kind) {
      for (const std::size_t first : {0, 63, 64, 700, 1499}) {
        std::vector<Instance> instances = scene.instances;
        instances[first] = refused[kind].first;
        for (std::size_t i = first + 1; i < instances.size(); i += 37) {
          instances[i] = refused[(kind + i) % 3].first;
        }
        EXPECT_EQ(query_.find(instances), refused[kind].second) << threads << " " << first;
        EXPECT_EQ(query_.where(), first) << threads;
        expect_nothing();
      }
    }
    ASSERT_EQ(query_.find(scene.instances), Status::kOk);
    EXPECT_FALSE(query_.rows().empty());
  }
}

TEST_F(Query, TakesMoreThreadsThanPairs) {
  for (const int cubes : {0, 1, 2, 3}) {
    const BodyScene scene = row_of_cubes(cubes);
    for (const bool selves : {false, true}) {
      ContactOptions options;
      EXPECT_EQ(query_.scene.set_threads(8), Status::kOk);
      options.self_pairs = selves;
      ask(scene, options);
      EXPECT_EQ(found_contacts(query_), all_contacts(scene, selves));
    }
  }
}

TEST_F(Query, ManyObjectsWorkSideBySide) {
  const BodyScene scene = crowd(5, 20);
  ask(scene);
  const std::vector<Contact> expected = contacts_of(query_);
  std::vector<test::Asked<ContactQuery>> queries(4);
  for (int round = 0; round < 3; ++round) {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      EXPECT_EQ(queries[i].scene.set_threads(static_cast<std::uint32_t>(i + 1)), Status::kOk);
      ASSERT_EQ(queries[i].set_assets(scene.assets.views()), Status::kOk);
      ASSERT_EQ(queries[i].find(scene.instances), Status::kOk);
    }
    for (const test::Asked<ContactQuery>& query : queries) EXPECT_EQ(contacts_of(query), expected);
  }
}

/// Each with worker threads of its own, which start and stop while those of the others work.
TEST_F(Query, ManyObjectsOfManyThreadsWorkAtOnce) {
  const BodyScene scene = crowd(6, 60);
  ask(scene);
  const std::vector<Contact> expected = contacts_of(query_);
  const auto work = [&](std::uint32_t first) {
    for (std::uint32_t round = 0; round < 4; ++round) {
      test::Asked<ContactQuery> query;
      EXPECT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
      for (const std::uint32_t more : {0u, 4u, 1u, 9u}) {
        EXPECT_EQ(query.scene.set_threads(first + more), Status::kOk);
        EXPECT_EQ(query.find(scene.instances), Status::kOk);
        EXPECT_EQ(contacts_of(query), expected);
      }
      test::Asked<ContactQuery> moved = std::move(query);
      EXPECT_EQ(moved.find(scene.instances), Status::kOk);
      EXPECT_EQ(contacts_of(moved), expected);
    }
  };
  std::vector<std::thread> callers;
  for (std::uint32_t first = 1; first <= 4; ++first) callers.emplace_back(work, first);
  for (std::thread& caller : callers) caller.join();
}

}  // namespace
}  // namespace tandem
