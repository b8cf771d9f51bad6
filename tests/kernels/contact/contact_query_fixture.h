#pragma once
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "kernels/asked.h"
#include "kernels/query_scenes.h"
#include "tandem/kernels/contact_query.h"

/// A query, and scenes that it is asked about.
namespace tandem {

using test::BodyScene;
using test::found_contacts;
using test::RandomPoses;

template <typename Query>
std::vector<Contact> contacts_of(const Query& query) {
  return {query.rows().begin(), query.rows().end()};
}

inline std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_of(const test::Asked<ContactQuery>& query) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> out;
  for (const ObjectPair& pair : query.pairs()) out.emplace_back(pair.a, pair.b);
  return out;
}

inline Pose at(double x, double y, double z) {
  Pose pose = kIdentityPose;
  pose.translation[0] = x;
  pose.translation[1] = y;
  pose.translation[2] = z;
  return pose;
}

/// A row of unit cubes that touch.
inline BodyScene row_of_cubes(int count) {
  BodyScene scene;
  scene.assets.add(test::cube(0.5f));
  for (int i = 0; i < count; ++i) scene.instances.push_back({0, at(i, 0, 0)});
  return scene;
}

/// Enough object pairs for several chunks of each of many threads.
inline BodyScene crowd(std::uint64_t seed, int instances) {
  RandomPoses random(seed);
  BodyScene scene;
  scene.assets.add(test::soup(random, 40, 0.4));
  scene.assets.add(test::grid_soup(random, 10, 1));
  scene.assets.add(test::cube(0.5f, 2));
  for (int i = 0; i < instances; ++i) {
    Pose pose = any_rotation(random);
    for (double& x : pose.translation) x = random.symmetric(3);
    scene.instances.push_back({static_cast<std::uint32_t>(random.below(3)), pose});
  }
  return scene;
}

class Query : public testing::Test {
 protected:
  void ask(const BodyScene& scene, const ContactOptions& options = {}) {
    ASSERT_EQ(query_.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(query_.find(scene.instances, options), Status::kOk);
  }
  void ask(const BodyScene& scene, const std::vector<ObjectPair>& pairs, const ContactOptions& options = {}) {
    ASSERT_EQ(query_.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(query_.find(scene.instances, pairs, options), Status::kOk);
  }
  void expect_nothing() {
    EXPECT_TRUE(query_.pairs().empty());
    EXPECT_TRUE(query_.rows().empty());
    EXPECT_EQ(query_.counters(), ContactCounters{});
  }
  /// Right in spite of what came before.
  void expect_usable() {
    const BodyScene scene = row_of_cubes(3);
    ask(scene);
    EXPECT_EQ(found_contacts(query_), all_contacts(scene, false));
    EXPECT_FALSE(query_.rows().empty());
  }

  test::Asked<ContactQuery> query_;
};

}  // namespace tandem
