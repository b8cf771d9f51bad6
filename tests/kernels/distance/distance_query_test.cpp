#include "tandem/kernels/distance_query.h"
#include "kernels/asked.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "kernels/distance/distance_scenes.h"
#include "kernels/distance/nearest_phase.h"
#include "kernels/geometry/triangle_distance.h"
#include "kernels/scene/scene_state.h"
#include "kernels/solid_meshes.h"

// Whole distance queries against all pairs of triangles, and every way to compute them against the others.
namespace tandem {
namespace {

using test::PosedTriangle;

std::vector<std::vector<PosedTriangle>> posed(const BodyScene& scene) {
  std::vector<std::vector<PosedTriangle>> out;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) out.push_back(posed_triangles(scene, i));
  return out;
}

/// The least interval over all pairs of triangles.
DistanceInterval least_distance(const std::vector<PosedTriangle>& a, const std::vector<PosedTriangle>& b) {
  DistanceInterval least = {INFINITY, INFINITY};
  for (const PosedTriangle& x : a) {
    for (const PosedTriangle& y : b) {
      const DistanceInterval next = triangle_distance(test::pair_of(x, y), {0, 1e-12}).interval;
      least.lower = std::min(least.lower, next.lower);
      least.upper = std::min(least.upper, next.upper);
      if (least.upper == 0) return least;
    }
  }
  return least;
}

double between(const double* p, const double* q) {
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

std::vector<ObjectDistance> distances_of(const test::Asked<DistanceQuery>& query) {
  return {query.rows().begin(), query.rows().end()};
}

class DistanceScenes : public testing::TestWithParam<test::SceneFamily> {
 protected:
  template <class Check>
  void for_scenes(int count, Check check) {
    for_spread_scenes(GetParam(), 4711, count, check);
  }
};

INSTANTIATE_TEST_SUITE_P(All, DistanceScenes, testing::ValuesIn(test::scene_families()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(DistanceScenes, EveryIntervalHoldsTheLeastOfAllTriangles) {
  test::Asked<DistanceQuery> query;
  for_scenes(test::trials(24, 20), [&](const BodyScene& scene, int seed) {
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    const DistanceTolerance tolerance = {seed % 3 == 1 ? 0.01 : 0, seed % 3 == 2 ? 0.1 : 1e-6};
    ASSERT_EQ(query.find(scene.instances, {.tolerance = tolerance}), Status::kOk);
    const auto triangles = posed(scene);
    const std::size_t n = scene.instances.size();
    ASSERT_EQ(query.pairs().size(), n * (n - 1) / 2);
    for (std::size_t i = 0; i < query.pairs().size(); ++i) {
      const auto [a, b] = query.pairs()[i];
      const ObjectDistance& found = query.rows()[i];
      const DistanceInterval truth = least_distance(triangles[a], triangles[b]);
      EXPECT_LE(found.lower, truth.upper) << a << " " << b;
      EXPECT_GE(found.upper, truth.lower) << a << " " << b;
      EXPECT_EQ(found.upper == 0, truth.upper == 0) << a << " " << b;
      EXPECT_LE(found.upper - found.lower, allowed_width(tolerance, found.upper)) << a << " " << b;
      ASSERT_NE(found.triangle_a, kNoIndex);
      const auto& asset = [&](std::uint32_t of) {
        return scene.assets.views()[scene.instances[of].asset].level();
      };
      EXPECT_EQ(found.face_a, asset(a).triangles[found.triangle_a].source_face());
      EXPECT_EQ(found.face_b, asset(b).triangles[found.triangle_b].source_face());
      // The triangles named are as near as told; faces are numbered as the mesh's triangles are.
      const DistanceInterval named =
          triangle_distance(test::pair_of(triangles[a][found.face_a], triangles[b][found.face_b]), {0, 1e-12})
              .interval;
      EXPECT_LE(named.lower, found.upper);
      EXPECT_GE(named.upper, found.lower);
    }
  });
}

TEST_P(DistanceScenes, TouchingPairsAreThoseWithContacts) {
  test::Asked<DistanceQuery> query;
  test::Asked<ContactQuery> contacts;
  for_scenes(test::trials(20, 10), [&](const BodyScene& scene, int) {
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(contacts.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(contacts.find(scene.instances, {.first_contact_only = true}), Status::kOk);
    ASSERT_EQ(query.find(scene.instances, contacts.pairs(), {.reach = 0}), Status::kOk);
    std::vector<bool> touch(contacts.pairs().size());
    for (const Contact& contact : contacts.rows()) touch[contact.pair] = true;
    for (std::size_t i = 0; i < touch.size(); ++i)
      EXPECT_EQ(query.rows()[i].upper == 0, touch[i]) << query.pairs()[i].a << " " << query.pairs()[i].b;
    EXPECT_EQ(query.counters().touching,
              static_cast<std::uint64_t>(std::count(touch.begin(), touch.end(), true)));
  });
}

/// Returns what one variant makes of a pair, without the query around it.
std::vector<double> walk(NearestPhase phase, const NearestTask& task, DistanceCounters& counters) {
  NearestSoFar state;
  state.reset(INFINITY);
  const BoundedBlockPair roots = {0, 0, 0, 0xFFFF};
  phase(task, &roots, 1, state);
  if (!state.touches()) settle_candidates(task, state);
  counters = state.counters;
  return {state.upper, state.floor, static_cast<double>(state.triangle_a),
          static_cast<double>(state.triangle_b)};
}

TEST_P(DistanceScenes, EveryVariantDoesTheSame) {
  for_scenes(test::trials(12, 10), [&](const BodyScene& scene, int) {
    std::vector<PosedTree> trees;
    for (const Instance& instance : scene.instances) {
      const AssetView& asset = scene.assets.views()[instance.asset];
      const LevelView level = asset.level();
      trees.push_back({level, extent_of(level.blocks[0]), 0,
                       for_stored_coordinates(instance.pose, asset.header->origin)});
    }
    for (std::size_t a = 0; a < trees.size(); ++a) {
      for (std::size_t b = a + 1; b < trees.size(); ++b) {
        const NearestTask task = nearest_task(trees[a], trees[b], {});
        if (!task.in_frame) continue;
        DistanceCounters expected, counters;
        const std::vector<double> answer = walk(nearest_phase(BlockPairVariant::scalar), task, expected);
        for (const BlockPairVariant variant : kBlockPairVariants) {
          if (nearest_phase(variant) == nullptr) continue;
          EXPECT_EQ(walk(nearest_phase(variant), task, counters), answer) << static_cast<int>(variant);
          EXPECT_EQ(counters, expected) << static_cast<int>(variant);
        }
      }
    }
  });
}

TEST_P(DistanceScenes, WhatIsBeyondReachIsToldAsSuch) {
  test::Asked<DistanceQuery> query, all;
  for_scenes(test::trials(8, 10), [&](const BodyScene& scene, int) {
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(all.set_assets(scene.assets.views()), Status::kOk);
    ASSERT_EQ(all.find(scene.instances), Status::kOk);
    if (all.pairs().empty()) return;
    const double reach = all.rows()[all.pairs().size() / 2].lower;
    ASSERT_EQ(query.find(scene.instances, {.reach = reach}), Status::kOk);
    std::size_t next = 0;
    for (std::size_t i = 0; i < all.pairs().size(); ++i) {
      const auto [a, b] = all.pairs()[i];
      const bool there =
          next < query.pairs().size() && query.pairs()[next].a == a && query.pairs()[next].b == b;
      if (all.rows()[i].upper <= reach) {
        ASSERT_TRUE(there);
      }
      if (!there) continue;
      const ObjectDistance& found = query.rows()[next++];
      EXPECT_LE(found.lower, all.rows()[i].upper);
      EXPECT_GE(found.upper, all.rows()[i].lower);
      if (all.rows()[i].upper <= reach) {
        EXPECT_NE(found.triangle_a, kNoIndex);
      }
      if (found.triangle_a == kNoIndex) {
        EXPECT_GE(found.lower, reach);
      }
    }
  });
}

/// Expects the rows and counters of calls about one pair each.
void expect_rows_of_single_calls(test::Asked<DistanceQuery>& query, const BodyScene& scene,
                                 const std::vector<ObjectPair>& pairs, const std::vector<double>& reaches) {
  ASSERT_EQ(query.find(scene.instances, pairs, {.reach_of_pair = reaches}), Status::kOk);
  const std::vector<ObjectDistance> together = distances_of(query);
  const DistanceCounters counters = query.counters();
  DistanceCounters sum;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    ASSERT_EQ(query.find(scene.instances, std::span(&pairs[i], 1), {.reach = reaches[i]}), Status::kOk);
    EXPECT_TRUE(same_bytes(query.rows(), std::span(&together[i], 1))) << i << " within " << reaches[i];
    add_to(sum, query.counters(),
           {&DistanceCounters::object_pairs, &DistanceCounters::block_pairs, &DistanceCounters::by_float32,
            &DistanceCounters::by_float64, &DistanceCounters::touching});
  }
  EXPECT_EQ(counters, sum);
}

TEST_P(DistanceScenes, ReachesOfPairsFindWhatSingleCallsFind) {
  test::Asked<DistanceQuery> query;
  for_scenes(test::trials(12, 10), [&](const BodyScene& scene, int seed) {
    ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
    EXPECT_EQ(query.scene.set_threads(1 + static_cast<std::uint32_t>(seed % 3)), Status::kOk);
    ASSERT_EQ(query.find(scene.instances), Status::kOk);
    const std::vector<ObjectPair> pairs(query.pairs().begin(), query.pairs().end());
    expect_rows_of_single_calls(query, scene, pairs, mixed_reaches(query.rows()));
  });
}

TEST(DistanceQuery, ThreadsAndFormerNearestDoNotMatter) {
  const BodyScene scene = spread_out(crowd(3, 60), 4);
  test::Asked<DistanceQuery> query;
  ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(query.find(scene.instances, {.reach = 3}), Status::kOk);
  const std::vector<ObjectDistance> expected = distances_of(query);
  const DistanceCounters counters = query.counters();
  ASSERT_GT(expected.size(), 50u);
  std::vector<FormerNearest> former;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto [a, b] = query.pairs()[i];
    former.push_back({a, b, expected[i].triangle_a, expected[i].triangle_b});
  }
  for (const std::uint32_t threads : {2u, 3u, 16u}) {
    EXPECT_EQ(query.scene.set_threads(threads), Status::kOk);
    ASSERT_EQ(query.find(scene.instances, {.reach = 3}), Status::kOk);
    EXPECT_EQ(distances_of(query), expected) << threads;
    EXPECT_EQ(query.counters(), counters) << threads;
  }
  ASSERT_EQ(query.find(scene.instances, {.reach = 3, .former = former}), Status::kOk);
  EXPECT_LT(query.counters().block_pairs, counters.block_pairs);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_LE(query.rows()[i].lower, expected[i].upper);
    EXPECT_GE(query.rows()[i].upper, expected[i].lower);
  }
}

TEST(DistanceQuery, OneLargePairIsSpreadOverThreadsAlike) {
  RandomPoses random(8);
  BodyScene scene;
  scene.assets.add(test::cube(0.5f, 120));  // 172,800 triangles
  scene.assets.add(test::soup(random, 100'000, 0.01));
  scene.instances = {{0, at(0, 0, 0)}, {1, at(1.52, 0.3, -0.2)}, {0, at(3.5, 0, 0)}};
  test::Asked<DistanceQuery> query;
  ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  const std::vector<ObjectPair> pairs = {{0, 1}, {2, 0}, {1, 1}};
  ASSERT_EQ(query.find(scene.instances, pairs, {}), Status::kOk);
  const std::vector<ObjectDistance> expected = distances_of(query);
  EXPECT_LE(expected[1].lower, 2.5);
  EXPECT_GE(expected[1].upper, 2.5);
  EXPECT_EQ(expected[2].upper, 0);
  for (const std::uint32_t threads : {2u, 5u}) {
    EXPECT_EQ(query.scene.set_threads(threads), Status::kOk);
    ASSERT_EQ(query.find(scene.instances, pairs, {}), Status::kOk);
    EXPECT_EQ(distances_of(query), expected);
  }
  expect_rows_of_single_calls(query, scene, pairs, {1, 2, 0});
  // The least over all triangles of the soup is that to the face at x = 0.5, found one by one.
  double least = HUGE_VAL;
  for (const PosedTriangle& triangle : posed_triangles(scene, 1)) {
    for (const auto& corner : triangle) {
      const double outside[3] = {corner[0] - 0.5, std::max(std::fabs(corner[1]) - 0.5, 0.0),
                                 std::max(std::fabs(corner[2]) - 0.5, 0.0)};
      const double none[3] = {};
      least = std::min(least, between(outside, none));
    }
  }
  EXPECT_NEAR(expected[0].upper, least, 1e-6 * least);
}

TEST(NearnessBelow, IsNoFartherBelowThanTheToleranceAllows) {
  test::RandomPoses random(17);
  const int count = test::trials(200000, 10);
  for (int i = 0; i < count; ++i) {
    const double upper = std::pow(2, random.uniform(-1000, 900));
    DistanceTolerance tolerance = {0, i % 5 == 0 ? 0 : std::pow(2, random.uniform(-50, -20))};
    if (i % 3 == 0) tolerance.absolute = upper * std::pow(2, random.uniform(-54, -20));
    const double near = nearness_below(tolerance, upper);
    // Such a difference is exact.
    ASSERT_LE(upper - near, allowed_width(tolerance, upper)) << upper;
    ASSERT_GE(upper - near, allowed_width(tolerance, upper) - 0x1p-51 * upper) << upper;
    ASSERT_GT(near, 0);
  }
}

// Many pairs of triangles of two blocks that face each other are at the same distance but for rounding, so
// what the walk passes over is all but as near as the tolerance allows.
TEST(Distance, IntervalsAreAsNarrowAsAskedWhereTheToleranceIsNearRounding) {
  test::RandomPoses random(18);
  BodyScene scene;
  scene.assets.add(test::cube(0.5f, 3));
  scene.instances.assign(2, {0, kIdentityPose});
  test::Asked<DistanceQuery> query;
  ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
  const int count = test::trials(20000, 10);
  int wide = 0, wider = 0;
  for (int i = 0; i < count; ++i) {
    const Pose turned = test::any_rotation(random);
    const double apart[3] = {random.symmetric(0.5), random.symmetric(0.5), 1 + random.uniform(0.01, 2)};
    for (Instance& body : scene.instances) body.pose = turned;
    for (int k = 0; k < 3; ++k) {
      scene.instances[1].pose.translation[k] += turned.rotation[k][0] * apart[0] +
                                                turned.rotation[k][1] * apart[1] +
                                                turned.rotation[k][2] * apart[2];
    }
    const DistanceTolerance tolerance = {0, i % 4 == 0 ? 0 : std::pow(10, random.uniform(-15, -14))};
    ASSERT_EQ(query.find(scene.instances, {.tolerance = tolerance}), Status::kOk);
    const ObjectDistance& found = query.rows()[0];
    const double width = found.upper - found.lower, allowed = allowed_width(tolerance, found.upper);
    wide += width > 0.9 * allowed;
    wider += width > allowed;
  }
  EXPECT_EQ(wider, 0);
  RecordProperty("wide", wide);
}

/// A cylinder whose caps are cut from their centres.
test::Mesh centre_fans(int sectors, float height) {
  test::Mesh mesh;
  const auto point = [&](int i, float z) {
    const double angle = 2 * std::numbers::pi * (i % sectors) / sectors;
    return std::array<float, 3>{static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), z};
  };
  const float top = height / 2;
  for (int i = 0; i < sectors; ++i) {
    mesh.add(point(i, -top), point(i + 1, -top), point(i + 1, top));
    mesh.add(point(i, -top), point(i + 1, top), point(i, top));
    mesh.add({0, 0, top}, point(i, top), point(i + 1, top));
    mesh.add({0, 0, -top}, point(i + 1, -top), point(i, -top));
  }
  return mesh;
}

/// The second of two bodies of one mesh, turned about z and moved.
Pose turned(double angle, double x, double z) {
  Pose pose = at(x, 0, z);
  pose.rotation[0][0] = pose.rotation[1][1] = std::cos(angle);
  pose.rotation[0][1] = -(pose.rotation[1][0] = std::sin(angle));
  return pose;
}

/// Turns a scene as a whole, and returns it.
BodyScene& turn(BodyScene& scene) {
  RandomPoses random(1);
  const Pose whole = any_rotation(random);
  for (Instance& instance : scene.instances) {
    const Pose own = instance.pose;
    for (int i = 0; i < 3; ++i) {
      const double* const r = whole.rotation[i];
      for (int j = 0; j < 3; ++j)
        instance.pose.rotation[i][j] =
            r[0] * own.rotation[0][j] + r[1] * own.rotation[1][j] + r[2] * own.rotation[2][j];
      instance.pose.translation[i] =
          r[0] * own.translation[0] + r[1] * own.translation[1] + r[2] * own.translation[2];
    }
  }
  return scene;
}

// A million pairs of triangles are the nearest: each looks at few.
TEST(DistanceQuery, StackedCylindersLookAtFewPairsHoweverTheirCapsAreCut) {
  test::Asked<DistanceQuery> query;
  for (const bool from_the_centre : {true, false}) {
    for (const double gap : {0x1p-40, 0x1p-30, 0x1p-10, 0.125}) {
      for (const double angle : {0.0, 0.3}) {
        BodyScene scene;
        scene.assets.add(from_the_centre ? centre_fans(1024, 2) : test::regular_prism(1024, 1, 2));
        scene.instances = {{0, kIdentityPose}, {0, turned(angle, 0, 2 + gap)}};
        for (const bool anyhow : {false, true}) {
          if (anyhow && gap < 0x1p-30) continue;  // posed vertices are rounded by more than the tolerance
          ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
          ASSERT_EQ(query.find(anyhow ? turn(scene).instances : scene.instances), Status::kOk);
          const ObjectDistance& found = query.rows()[0];
          EXPECT_NEAR(found.upper, gap, (anyhow ? 1e-15 : 0) + 1e-6 * gap);
          EXPECT_LE(found.upper - found.lower, 1e-6 * found.upper);
          EXPECT_LT(query.counters().block_pairs, 1000u) << from_the_centre << gap << angle;
          EXPECT_LT(query.counters().by_float32, 5000u) << from_the_centre << gap << angle;
          EXPECT_LT(query.counters().by_float64, 100u) << from_the_centre << gap << angle;
        }
      }
    }
  }
}

TEST(DistanceQuery, FlushPlatesLookAtFewPairsHoweverNearTheyAre) {
  test::Asked<DistanceQuery> query;
  for (const int cells : {100, 260}) {  // the larger ones are spread over threads
    for (const double gap : {0x1p-40, 0x1p-30, 0x1p-10, 0.125}) {
      BodyScene scene;
      scene.assets.add(test::sheet(2, cells));
      scene.instances = {{0, kIdentityPose}, {0, turned(0.3, 0.01, gap)}};
      ASSERT_EQ(query.scene.set_threads(2), Status::kOk);
      ASSERT_EQ(query.set_assets(scene.assets.views()), Status::kOk);
      ASSERT_EQ(query.find(scene.instances), Status::kOk);
      const ObjectDistance& found = query.rows()[0];
      EXPECT_LE(found.lower, gap);
      EXPECT_GE(found.upper, gap);
      EXPECT_LE(found.upper - found.lower, 1e-6 * found.upper);
      const std::uint64_t triangles = 4 * cells * cells;
      EXPECT_LT(query.counters().by_float32, triangles) << cells << gap;
      EXPECT_LT(query.counters().by_float64, 200u) << cells << gap;
    }
  }
}

}  // namespace
}  // namespace tandem
