#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "kernels/contact/contact_query_fixture.h"
#include "kernels/scene/filter_oracle.h"
#include "tandem/kernels/configuration_query.h"
#include "tandem/kernels/distance_query.h"

/// Configurations of a scene, on whatever device: what is found is what a scene on the CPU finds whose bodies
/// are moved.
namespace tandem {

using test::any_rotation;
using test::centred_at;
using test::FilterArrays;
using test::random_filter;
using Rows = std::vector<ConfigurationPair>;

inline constexpr std::uint32_t kConfigurations = 60, kMostNearPairs = 10;

// A crowd of bodies of which some move: the others stand, one of them removed.
struct Question {
  BodyScene scene = crowd(5, 60);
  std::vector<std::uint32_t> bodies = {3, 41, 7, 8, 30, 59};
  std::vector<Pose> poses;
  FilterArrays filter;

  explicit Question(unsigned parts) : filter(random_filter(60, parts, 9)) {
    RandomPoses random(3);
    for (std::uint32_t i = 0; i < kConfigurations; ++i) {
      for (const std::uint32_t body : bodies) {
        const double place[3] = {random.symmetric(5), random.symmetric(5), random.symmetric(5)};
        const AssetView& asset = scene.assets.views()[scene.instances[body].asset];
        poses.push_back(centred_at(asset, any_rotation(random), place));
      }
    }
  }

  ConfigurationOptions options() const { return {.bodies = bodies, .poses = poses}; }
};

// Moves the bodies to one configuration after the other: ask(configuration, scene, moves) is told whether a
// body of a pair moves by moves(pair).
template <typename Ask>
void in_each_configuration(const Question& question, const PairFilter& filter, const Ask& ask) {
  Scene scene;
  EXPECT_EQ(scene.set_assets(question.scene.assets.views()), Status::kOk);
  EXPECT_EQ(scene.place(question.scene.instances, filter), Status::kOk);
  EXPECT_EQ(scene.remove(17), Status::kOk);
  const std::size_t moving = question.bodies.size();
  const auto moves = [&](const ObjectPair& pair) {
    return std::ranges::count(question.bodies, pair.a) + std::ranges::count(question.bodies, pair.b) != 0;
  };
  for (std::uint32_t i = 0; i < kConfigurations; ++i) {
    const std::span<const Pose> poses = std::span(question.poses).subspan(i * moving, moving);
    EXPECT_EQ(scene.move(question.bodies, poses), Status::kOk);
    ask(i, scene, moves);
  }
}

// Finds the rows by asking for contacts in each configuration.
inline Rows by_contacts(const Question& question, const PairFilter& filter, double within) {
  ContactQuery query;
  Rows rows;
  in_each_configuration(question, filter, [&](std::uint32_t configuration, Scene& scene, const auto& moves) {
    EXPECT_EQ(query.find(scene, {.first_contact_only = true, .within = within}), Status::kOk);
    for (const Contact& contact : query.rows()) {
      const ObjectPair pair = query.pairs()[contact.pair];
      if (moves(pair)) rows.push_back({configuration, pair.a, pair.b, 0, within});
    }
  });
  std::ranges::sort(rows);
  return rows;
}

// The least interval of each configuration, of pairs of which one moves at least; none beyond reach.
inline Rows by_distances(const Question& question, const PairFilter& filter, double reach) {
  DistanceQuery query;
  Rows rows;
  in_each_configuration(question, filter, [&](std::uint32_t configuration, Scene& scene, const auto& moves) {
    EXPECT_EQ(query.find(scene, {.reach = reach}), Status::kOk);
    ConfigurationPair least = {configuration, kNoIndex, kNoIndex, HUGE_VAL, HUGE_VAL};
    for (std::size_t k = 0; k < query.rows().size(); ++k) {
      const ObjectPair pair = query.pairs()[k];
      if (!moves(pair)) continue;
      least.lower = std::min(least.lower, query.rows()[k].lower);
      if (query.rows()[k].upper < least.upper)
        least.a = pair.a, least.b = pair.b, least.upper = query.rows()[k].upper;
    }
    if (least.upper < HUGE_VAL) rows.push_back(least);
  });
  return rows;
}

/// Says whether scenes of this kind can be made here.
template <typename TheScene>
bool can_be_made() {
  return true;
}

template <typename TheScene>
class ConfigurationsOn : public testing::Test {
 protected:
  void SetUp() override {
    if (!can_be_made<TheScene>()) GTEST_SKIP() << "no GPU here";
  }
};
TYPED_TEST_SUITE_P(ConfigurationsOn);

TYPED_TEST_P(ConfigurationsOn, TouchWhereContactsOfTheMovedSceneDoWhateverTheFilterAndTheThreads) {
  std::size_t touching = 0, free = 0;
  for (const unsigned parts : {0u, 1u, 14u, 16u, 31u}) {
    const Question question(parts);
    ExcludedPairTable table;
    const PairFilter filter = question.filter.view(table);
    for (const double within : {0.0, 0.25}) {
      const Rows expected = by_contacts(question, filter, within);
      TypeParam scene;
      ASSERT_EQ(scene.set_assets(question.scene.assets.views()), Status::kOk);
      ASSERT_EQ(scene.place(question.scene.instances, filter), Status::kOk);
      ASSERT_EQ(scene.remove(17), Status::kOk);
      ConfigurationQuery query;
      ConfigurationCounters counted;
      for (const std::uint32_t threads : {1u, 2u, 5u}) {
        SCOPED_TRACE(testing::Message() << "filter " << parts << ", within " << within << ", " << threads);
        ASSERT_EQ(scene.set_threads(threads), Status::kOk);
        ConfigurationOptions options = question.options();
        options.within = within;
        options.find = ConfigurationPairs::all;
        ASSERT_EQ(query.find(scene, options), Status::kOk);
        EXPECT_TRUE(std::ranges::equal(query.rows(), expected));
        options.find = ConfigurationPairs::first;
        ASSERT_EQ(query.find(scene, options), Status::kOk);
        // One of each, and it is one of all.
        std::map<std::uint64_t, int> of_each;
        for (const ConfigurationPair& row : query.rows()) {
          ++of_each[row.configuration];
          EXPECT_TRUE(std::ranges::binary_search(expected, row));
        }
        for (const ConfigurationPair& row : expected) EXPECT_EQ(of_each[row.configuration], 1);
        EXPECT_EQ(query.counters().touching, of_each.size());
        EXPECT_EQ(query.counters().configurations, kConfigurations);
        if (threads > 1) {
          EXPECT_EQ(query.counters(), counted);
        }
        counted = query.counters();
        touching += of_each.size();
        free += kConfigurations - of_each.size();
      }
      EXPECT_TRUE(std::ranges::equal(
          std::span(scene.instances().data(), 17), std::span(question.scene.instances.data(), 17),
          [](const Instance& x, const Instance& y) { return x.asset == y.asset; }));
    }
  }
  EXPECT_GT(touching, 400u);
  EXPECT_GT(free, 400u);
}

TYPED_TEST_P(ConfigurationsOn, AreAsNearAsTheNearestPairOfTheMovedSceneWhateverTheFilterAndTheThreads) {
  std::size_t touching = 0, apart = 0, beyond = 0;
  for (const unsigned parts : {0u, 14u, 31u}) {
    const Question question(parts);
    ExcludedPairTable table;
    const PairFilter filter = question.filter.view(table);
    TypeParam scene;
    ASSERT_EQ(scene.set_assets(question.scene.assets.views()), Status::kOk);
    ASSERT_EQ(scene.place(question.scene.instances, filter), Status::kOk);
    ASSERT_EQ(scene.remove(17), Status::kOk);
    for (const double reach : {0.0, 0.1, HUGE_VAL}) {
      const Rows expected = by_distances(question, filter, reach);
      ConfigurationQuery query;
      Rows found;
      ConfigurationCounters counted;
      for (const std::uint32_t threads : {1u, 2u, 5u}) {
        SCOPED_TRACE(testing::Message() << "filter " << parts << ", reach " << reach << ", " << threads);
        ASSERT_EQ(scene.set_threads(threads), Status::kOk);
        ConfigurationOptions options = question.options();
        options.within = reach;
        options.find = ConfigurationPairs::nearest;
        ASSERT_EQ(query.find(scene, options), Status::kOk);
        ASSERT_EQ(query.rows().size(), expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) {
          const ConfigurationPair &x = query.rows()[i], &y = expected[i];
          EXPECT_EQ(x.configuration, y.configuration);
          EXPECT_LE(x.lower, y.upper);
          EXPECT_LE(y.lower, x.upper);
          EXPECT_LE(x.upper - x.lower, 1.0001e-6 * x.upper);
          EXPECT_EQ(x.upper == 0, y.upper == 0);
          if (x.upper > 0) {
            EXPECT_EQ(ObjectPair(x.a, x.b), ObjectPair(y.a, y.b));
          }
          (x.upper == 0 ? touching : apart) += 1;
        }
        beyond += kConfigurations - expected.size();
        if (threads > 1) {
          EXPECT_EQ(query.counters(), counted);
          EXPECT_TRUE(std::ranges::equal(query.rows(), found));
        }
        // Most of the 333 pairs are passed over, as their boxes are farther apart than the nearest bodies.
        if (parts == 0) {
          EXPECT_LT(query.counters().object_pairs, kConfigurations * kMostNearPairs);
        }
        counted = query.counters();
        found.assign(query.rows().begin(), query.rows().end());
      }
    }
  }
  EXPECT_GT(touching, 200u);
  EXPECT_GT(apart, 150u);
  EXPECT_GT(beyond, 200u);
}

// What stands is prepared once, and again where anything of it changes.
TYPED_TEST_P(ConfigurationsOn, SeeWhatChangedBetweenTwoCalls) {
  const BodyScene cubes = row_of_cubes(3);  // each touches the next
  TypeParam scene;
  ASSERT_EQ(scene.set_assets(cubes.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(cubes.instances), Status::kOk);
  ConfigurationQuery query;
  const std::uint32_t first[] = {0}, last[] = {2};
  const Pose at_start[] = {cubes.instances[0].pose}, at_end[] = {cubes.instances[2].pose};
  const auto touches = [&](std::span<const std::uint32_t> bodies, std::span<const Pose> poses) {
    EXPECT_EQ(query.find(scene, {.bodies = bodies, .poses = poses}), Status::kOk);
    return !query.rows().empty();
  };
  EXPECT_TRUE(touches(first, at_start));
  EXPECT_TRUE(touches(first, at_start));
  Pose away = cubes.instances[1].pose;
  away.translation[1] += 5;
  ASSERT_EQ(scene.move(1, away), Status::kOk);
  EXPECT_FALSE(touches(first, at_start));
  EXPECT_TRUE(touches(first, at_end));
  EXPECT_FALSE(touches(last, at_end));
  ASSERT_EQ(scene.remove(2), Status::kOk);
  EXPECT_FALSE(touches(first, at_end));
  std::uint32_t body = 0;
  ASSERT_EQ(scene.add(cubes.instances[2], body), Status::kOk);
  EXPECT_TRUE(touches(first, at_end));
  PairFilter filter;
  const std::uint32_t worlds[] = {1, 2, 2};
  filter.world = worlds;
  ASSERT_EQ(scene.place(cubes.instances, filter), Status::kOk);
  EXPECT_FALSE(touches(first, at_start));
}

TYPED_TEST_P(ConfigurationsOn, WhatCannotBeAskedIsNamed) {
  Question question(0);
  TypeParam scene;
  ASSERT_EQ(scene.set_assets(question.scene.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(question.scene.instances), Status::kOk);
  ConfigurationQuery query;
  ConfigurationOptions options = question.options();
  const auto expect = [&](Status status, std::uint64_t where) {
    EXPECT_EQ(query.find(scene, options), status);
    EXPECT_EQ(scene.where(), where);
    EXPECT_TRUE(query.rows().empty());
    EXPECT_EQ(query.counters(), ConfigurationCounters());
    options = question.options();
  };
  const std::uint32_t twice[] = {3, 4, 3}, unknown[] = {3, 60};
  options.bodies = twice;
  expect(Status::kUnknownInstance, 2);
  options.bodies = unknown;
  expect(Status::kUnknownInstance, 1);
  options.poses = options.poses.first(7);
  expect(Status::kMotionMismatch, 7);
  options.within = -1;
  expect(Status::kBadReach, 0);
  options.within = HUGE_VAL;
  expect(Status::kBadReach, 0);
  options.find = ConfigurationPairs::nearest;
  options.tolerance.absolute = -1;
  expect(Status::kBadTolerance, 0);
  for (const std::uint32_t threads : {1u, 3u}) {
    ASSERT_EQ(scene.set_threads(threads), Status::kOk);
    const Pose kept[] = {question.poses[100], question.poses[300]};
    question.poses[300].translation[1] = 2e300;
    question.poses[100].rotation[0][0] = 3;
    expect(Status::kPoseNotRigid, 100);
    question.poses[100] = kept[0];
    expect(Status::kOutOfRange, 300);
    question.poses[300] = kept[1];
  }
  // None that move, or no configurations.
  options.bodies = {};
  options.poses = {};
  EXPECT_EQ(query.find(scene, options), Status::kOk);
  EXPECT_EQ(query.counters(), ConfigurationCounters());
  options = question.options();
  options.poses = {};
  EXPECT_EQ(query.find(scene, options), Status::kOk);
  EXPECT_TRUE(query.rows().empty());
}

REGISTER_TYPED_TEST_SUITE_P(ConfigurationsOn,
                            TouchWhereContactsOfTheMovedSceneDoWhateverTheFilterAndTheThreads,
                            AreAsNearAsTheNearestPairOfTheMovedSceneWhateverTheFilterAndTheThreads,
                            SeeWhatChangedBetweenTwoCalls, WhatCannotBeAskedIsNamed);

}  // namespace tandem
