#include "tandem/kernels/ray_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "kernels/contact/contact_query_fixture.h"
#include "kernels/geometry/ray_triangle.h"
#include "kernels/points_and_rays/hostile_probes.h"
#include "kernels/points_and_rays/probe_ways.h"
#include "kernels/points_and_rays/ray_oracle.h"
#include "kernels/points_and_rays/scene_probe.h"
#include "kernels/solid_meshes.h"

// Rays against rational numbers, and those that are aimed at edges, corners and planes on purpose.
namespace tandem {
namespace {

using test::all_of;
using test::hostile_rays;
using test::in_leaf_order;
using test::PosedTriangle;
using test::Rays;
using test::size_of;
using Vector = test::Place;

/// All triangles that a ray meets, by the oracle: by ascending parameter, body and triangle.
struct OracleHit {
  std::uint32_t body, triangle;
  RayOracle oracle;
};
std::vector<OracleHit> oracle_hits(const Vector& origin, const Vector& direction,
                                   const std::vector<std::vector<PosedTriangle>>& bodies) {
  std::vector<OracleHit> hits;
  for (std::uint32_t body = 0; body < bodies.size(); ++body) {
    for (std::uint32_t i = 0; i < bodies[body].size(); ++i) {
      double corner[3][3];
      for (int c = 0; c < 3; ++c) std::copy_n(bodies[body][i][c].data(), 3, corner[c]);
      if (surely_passes_by(origin.data(), direction.data(), corner)) continue;
      RayOracle oracle(origin.data(), direction.data(), corner);
      if (oracle.meets()) hits.push_back({body, i, std::move(oracle)});
    }
  }
  std::stable_sort(hits.begin(), hits.end(), [](const OracleHit& x, const OracleHit& y) {
    return RayOracle::compare(x.oracle, y.oracle) < 0;
  });
  return hits;
}

void expect_hit(const RayHit& row, const OracleHit& expected) {
  EXPECT_EQ(row.body, expected.body);
  EXPECT_EQ(row.triangle, expected.triangle);
  EXPECT_TRUE(expected.oracle.is_near(row.t, kRayTimeError)) << row.t;
  if (expected.oracle.is_plain()) {
    EXPECT_TRUE(expected.oracle.has_weights(row.weight, kRayWeightError))
        << row.weight[0] << ' ' << row.weight[1];
  }
}

class RayScenes : public testing::TestWithParam<test::SceneFamily> {};

INSTANTIATE_TEST_SUITE_P(All, RayScenes, testing::ValuesIn(test::scene_families()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(RayScenes, HitsAreThoseOfRationalNumbers) {
  std::size_t hits_there = 0;
  for (int trial = 0; trial < test::trials(4, 50) && !HasFailure(); ++trial) {
    RandomPoses random(91 + static_cast<std::uint64_t>(trial));
    const BodyScene bodies = GetParam().make(random);
    const auto triangles = in_leaf_order(bodies);
    const auto flat = all_of(triangles);
    if (flat.empty()) continue;
    const Rays rays = hostile_rays(random, flat, size_of(flat), 60);
    Scene scene;
    ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
    ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
    RayQuery first, any, all, near;
    ASSERT_EQ(first.find(scene, rays.options(RayHits::first)), Status::kOk);
    ASSERT_EQ(any.find(scene, rays.options(RayHits::any)), Status::kOk);
    ASSERT_EQ(all.find(scene, rays.options(RayHits::all)), Status::kOk);
    RayOptions to_reach = rays.options(RayHits::first);
    to_reach.reach = 1;
    ASSERT_EQ(near.find(scene, to_reach), Status::kOk);
    std::size_t next = 0;
    for (std::uint32_t i = 0; i < rays.origins.size() && !HasFailure(); ++i) {
      SCOPED_TRACE(testing::Message() << "trial " << trial << " ray " << i);
      const auto expected = oracle_hits(rays.origins[i], rays.directions[i], triangles);
      hits_there += expected.size();
      ASSERT_EQ(first.rows()[i].body == kNoIndex, expected.empty());
      ASSERT_EQ(any.rows()[i].body == kNoIndex, expected.empty());
      if (!expected.empty()) expect_hit(first.rows()[i], expected[0]);
      const bool is_near = !expected.empty() && expected[0].oracle.is_at_most(1);
      EXPECT_EQ(near.rows()[i].body, is_near ? expected[0].body : kNoIndex);
      for (const OracleHit& hit : expected) {
        ASSERT_LT(next, all.rows().size());
        EXPECT_EQ(all.rows()[next].ray, i);
        expect_hit(all.rows()[next++], hit);
      }
    }
    EXPECT_EQ(next, all.rows().size());
  }
  EXPECT_GT(hits_there, 100u);
}

// This asks it of one mesh of 6,000 triangles, stored and posed: 100,000 rays where TANDEM_LONG is set.
TEST(Rays, FirstHitsOfAMeshAreThoseOfRationalNumbers) {
  BodyScene bodies;
  bodies.assets.add(test::project_mesh("cow.obj"));
  bodies.instances.push_back({0, kIdentityPose});
  RandomPoses random(12);
  std::size_t on_edges = 0;
  for (int turn = 0; turn < 2; ++turn) {
    if (turn != 0) bodies.instances[0].pose = test::any_rotation(random);
    const auto triangles = in_leaf_order(bodies);
    const Rays rays = hostile_rays(random, triangles[0], size_of(triangles[0]), test::trials(1000, 50));
    Scene scene;
    ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
    ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
    RayQuery query;
    ASSERT_EQ(query.find(scene, rays.options(RayHits::first)), Status::kOk);
    for (std::size_t i = 0; i < rays.origins.size() && !HasFailure(); ++i) {
      SCOPED_TRACE(testing::Message() << "turn " << turn << " ray " << i);
      const auto expected = oracle_hits(rays.origins[i], rays.directions[i], triangles);
      ASSERT_EQ(query.rows()[i].body == kNoIndex, expected.empty());
      if (expected.empty()) continue;
      expect_hit(query.rows()[i], expected[0]);
      on_edges += !expected[0].oracle.is_plain();
    }
  }
  EXPECT_GT(on_edges, 100u);
}

// A closed surface has no gap: each ray from inside hits it, at the edges and corners too.
TEST(Rays, NoneSlipsThroughAnEdgeOrACorner) {
  BodyScene bodies;
  bodies.assets.add(test::cube(1, 8));
  bodies.instances.push_back({0, kIdentityPose});
  RandomPoses random(3);
  for (int turn = 0; turn < 3; ++turn) {
    if (turn != 0) bodies.instances[0].pose = test::any_rotation(random);
    const auto triangles = in_leaf_order(bodies)[0];
    const Rays rays = test::rays_from_inside(random, triangles, test::trials(20000, 20));
    Scene scene;
    ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
    ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
    RayQuery query;
    ASSERT_EQ(query.find(scene, rays.options(RayHits::first)), Status::kOk);
    EXPECT_EQ(query.counters().hits, rays.origins.size());
  }
}

TEST(Rays, RowsAreTheSameWhateverTheThreadsAndTheLanes) {
  const BodyScene bodies = crowd(5, 80);
  const auto flat = all_of(in_leaf_order(bodies));
  RandomPoses random(8);
  const Rays rays = hostile_rays(random, flat, size_of(flat), 5000);
  Scene scene;
  ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
  for (const RayHits hits : {RayHits::first, RayHits::any, RayHits::all}) {
    RayQuery alone;
    ASSERT_EQ(scene.set_threads(1), Status::kOk);
    ASSERT_EQ(alone.find(scene, rays.options(hits)), Status::kOk);
    EXPECT_GT(alone.counters().hits, 1000u);
    for (const std::uint32_t threads : {2u, 3u, 8u}) {
      RayQuery query;
      ASSERT_EQ(scene.set_threads(threads), Status::kOk);
      ASSERT_EQ(query.find(scene, rays.options(hits)), Status::kOk);
      EXPECT_TRUE(std::ranges::equal(query.rows(), alone.rows()));
      EXPECT_EQ(query.counters(), alone.counters());
    }
  }
}

TEST(Rays, EveryWayNamesTheSameTriangles) {
  test::SampleAssets assets;
  RandomPoses random(4);
  assets.add(test::soup(random, 300, 0.2));
  const LevelView level = assets.views()[0].level();
  const FileHeader& header = *assets.views()[0].header;
  const LocalFrame frame = local_frame(kIdentityPose, extent_of(level.blocks[0]), header.lower, header.upper);
  const auto named_by = [&](RayWalk walk, const WorldRay& ray, std::vector<std::uint32_t>& out) {
    RayTask task;
    if (local_ray(frame, ray, HUGE_VAL, task.ray) != RayReach::in_frame) return;
    task.tree = &level;
    task.limit = task.ray.length;
    task.context = &out;
    task.take = [](void* context, std::uint32_t triangle) {
      static_cast<std::vector<std::uint32_t>*>(context)->push_back(triangle);
      return HUGE_VALF;
    };
    walk(task);
    out.push_back(static_cast<std::uint32_t>(task.blocks));
  };
  for (int i = 0; i < 2000; ++i) {
    const Vector from = test::random_place(random, 2), along = test::random_place(random, 1);
    const WorldRay ray = world_ray(from.data(), along.data(), HUGE_VAL);
    std::vector<std::uint32_t> plain;
    named_by(ray_walk(BlockPairVariant::scalar), ray, plain);
    for (const BlockPairVariant variant : kBlockPairVariants) {
      if (ray_walk(variant) == nullptr) continue;
      std::vector<std::uint32_t> named;
      named_by(ray_walk(variant), ray, named);
      ASSERT_EQ(named, plain);
    }
  }
}

// The rays of a test of streams, and what is named of each.
struct NamedByStream {
  struct Ray {
    RayTask task;
    std::vector<std::uint32_t> named;
  };
  std::vector<Ray> rays;
  std::size_t begun = 0;
  Ray* of_walk[kRaysAtOnce] = {};

  static bool next(void* context, std::uint32_t walk, RayTask& task) {
    NamedByStream& stream = *static_cast<NamedByStream*>(context);
    Ray*& ray = stream.of_walk[walk];
    if (ray != nullptr) ray->named.push_back(static_cast<std::uint32_t>(task.blocks));
    ray = stream.begun < stream.rays.size() ? &stream.rays[stream.begun++] : nullptr;
    if (ray != nullptr) task = ray->task;
    return ray != nullptr;
  }
};

// Walks that share a vector do not see each other: streams of fewer and more rays than walks.
TEST(Rays, EveryStreamNamesTheTrianglesOfSingleWalks) {
  test::SampleAssets assets;
  RandomPoses random(6);
  assets.add(test::soup(random, 300, 0.2));
  const LevelView level = assets.views()[0].level();
  const FileHeader& header = *assets.views()[0].header;
  const LocalFrame frame = local_frame(kIdentityPose, extent_of(level.blocks[0]), header.lower, header.upper);
  for (const std::size_t count : {1, 2, 3, 5, 8, 9, 500}) {
    NamedByStream stream;
    while (stream.rays.size() < count) {
      const Vector from = test::random_place(random, 2), along = test::random_place(random, 1);
      const WorldRay ray = world_ray(from.data(), along.data(), HUGE_VAL);
      NamedByStream::Ray& next = stream.rays.emplace_back();
      if (local_ray(frame, ray, HUGE_VAL, next.task.ray) != RayReach::in_frame) stream.rays.pop_back();
    }
    std::vector<std::vector<std::uint32_t>> alone;
    for (NamedByStream::Ray& ray : stream.rays) {
      ray.task.tree = &level;
      ray.task.limit = ray.task.ray.length;
      ray.task.context = &ray.named;
      // Every other triangle makes the limit less, and some end the search.
      ray.task.take = [](void* context, std::uint32_t triangle) {
        static_cast<std::vector<std::uint32_t>*>(context)->push_back(triangle);
        return triangle % 16 == 3 ? -1 : triangle % 2 == 0 ? 1.5f : HUGE_VALF;
      };
      RayTask task = ray.task;
      ray_walk(BlockPairVariant::scalar)(task);
      alone.push_back(std::exchange(ray.named, {}));
      alone.back().push_back(static_cast<std::uint32_t>(task.blocks));
    }
    for (const BlockPairVariant variant : kBlockPairVariants) {
      if (ray_stream_walk(variant) == nullptr) continue;
      stream.begun = 0;
      for (NamedByStream::Ray& ray : stream.rays) ray.named.clear();
      ray_stream_walk(variant)({NamedByStream::next, &stream});
      for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(stream.rays[i].named, alone[i]);
    }
  }
}

// Rays with coordinates that are 0, tiny and large, in frames near and far.
TEST(Rays, EveryWayTakesAGroupOfRaysIntoAFrameAsOneByOne) {
  RandomPoses random(8);
  const float lower[3] = {-1, -1, -1}, upper[3] = {1, 1, 1};
  const double sizes[] = {0, 5e-324, 1e-310, 1e-200, 1, 1, 1, 1, 1, 1e30, 1e100, 1e290};
  const auto coordinate = [&] { return sizes[random.below(std::size(sizes))] * random.symmetric(1); };
  const TreeExtent extent = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  int of_reach[3] = {};
  for (int i = 0; i < 3000; ++i) {
    RayGroup group;
    group.reach = i % 3 == 0 ? HUGE_VAL : i % 3 == 1 ? 2 : 1e-3;
    const Pose pose = random.pose({.translation = i % 2 == 0 ? 1.0 : 1e6});
    const LocalFrame frame = local_frame(pose, extent, lower, upper);
    for (std::uint32_t r = 0; r < kRaysOfGroup; ++r) {
      for (int k = 0; k < 3; ++k) {
        group.origin[k][r] = coordinate() + (r % 2 == 0 ? 0 : frame.translation[k]);
        group.direction[k][r] = coordinate();
      }
      if (group.direction[0][r] == 0 && group.direction[1][r] == 0) group.direction[2][r] = 1;
    }
    const WorldBox bounds = {{-1, -2, 0}, {1, 2, 0}};
    for (const BlockPairVariant variant : kBlockPairVariants) {
      const RayGroupWays* const ways = ray_group_ways(variant);
      if (ways == nullptr) continue;
      ways->make_ready(group);
      double place[3][kRaysOfGroup];
      LocalRayGroup local;
      const unsigned placed = ways->place(group, bounds, place);
      const RayGroupReach reach = ways->take_into_frame(group, frame, local);
      for (std::uint32_t r = 0; r < kRaysOfGroup; ++r) {
        const double origin[3] = {group.origin[0][r], group.origin[1][r], group.origin[2][r]};
        const double direction[3] = {group.direction[0][r], group.direction[1][r], group.direction[2][r]};
        const WorldRay ray = world_ray(origin, direction, group.reach);
        double begin = 0, end = HUGE_VAL;
        ASSERT_EQ((placed >> r & 1) != 0, meets_box(ray, bounds.lo, bounds.hi, begin, end));
        LocalRay alone;
        const RayReach expected = local_ray(frame, ray, group.reach, alone);
        ++of_reach[static_cast<int>(expected)];
        ASSERT_EQ((reach.misses >> r & 1) != 0, expected == RayReach::misses);
        ASSERT_EQ((reach.in_frame >> r & 1) != 0, expected == RayReach::in_frame);
        ASSERT_EQ(group.factor[r], ray.factor);
        for (int k = 0; k < 3; ++k) {
          ASSERT_EQ(group.scaled[k][r], ray.scaled[k]);
          ASSERT_EQ(group.inverse[k][r], ray.inverse[k]);
          if (expected != RayReach::in_frame) continue;
          ASSERT_EQ(local.o[k][r], alone.o[k]);
          ASSERT_EQ(local.d[k][r], alone.d[k]);
          ASSERT_EQ(local.inverse[k][r], alone.inverse[k]);
        }
        if (expected != RayReach::in_frame) continue;
        ASSERT_EQ(local.start[r], alone.start);
        ASSERT_EQ(local.slack[r], alone.slack);
        ASSERT_EQ(local.length[r], alone.length);
        ASSERT_EQ(local.edge_factor[r], alone.edge_factor);
        ASSERT_EQ(local.least_bound[r], alone.least_bound);
      }
    }
  }
  for (const int count : of_reach) EXPECT_GT(count, 100);
}

TEST(Rays, WhatIsNoRayIsNamed) {
  const BodyScene cubes = row_of_cubes(2);
  Scene scene;
  ASSERT_EQ(scene.set_assets(cubes.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(cubes.instances), Status::kOk);
  RayQuery query;
  Rays rays;
  rays.add({0, 0, 5}, {0, 0, -1});
  rays.add({0, 0, 5}, {0, 0, -1});
  const auto expect = [&](Status status, std::uint64_t where, const RayOptions& options) {
    EXPECT_EQ(query.find(scene, options), status);
    EXPECT_EQ(scene.where(), where);
    EXPECT_TRUE(query.rows().empty());
  };
  rays.directions[1] = {0, -0.0, 0};
  expect(Status::kNoDirection, 1, rays.options(RayHits::first));
  rays.directions[1] = {0, std::nan(""), 0};
  expect(Status::kOutOfRange, 1, rays.options(RayHits::first));
  rays.directions[1] = {0, 0, 1};
  rays.origins[1] = {0, 0, 2e300};
  expect(Status::kOutOfRange, 1, rays.options(RayHits::first));
  rays.origins[1] = {0, 0, 5};
  RayOptions options = rays.options(static_cast<RayHits>(3));
  expect(Status::kBadOption, 0, options);
  options.hits = RayHits::all;
  options.reach = -1;
  expect(Status::kBadReach, 0, options);
  options.reach = std::nan("");
  expect(Status::kBadReach, 0, options);
  options.reach = 1;
  options.directions = options.directions.first(1);
  expect(Status::kBadOption, 0, options);
  ASSERT_EQ(query.find(scene, {}), Status::kOk);
  EXPECT_TRUE(query.rows().empty());
  ASSERT_EQ(scene.place({}), Status::kOk);
  ASSERT_EQ(query.find(scene, rays.options(RayHits::first)), Status::kOk);
  EXPECT_EQ(query.rows()[1].body, kNoIndex);
  EXPECT_EQ(query.rows()[1].t, HUGE_VAL);
}

TEST(Rays, ParametersThatFloat64CannotScaleAreRight) {
  test::SampleAssets assets;
  assets.add(test::cube(1));
  Scene scene;
  ASSERT_EQ(scene.set_assets(assets.views()), Status::kOk);
  RayQuery query;
  for (const double size : {1e-300, 1e-310, 5e-324, 1e-30, 1.0, 1e30, 1e300}) {
    for (const double far : {3.0, 1e20, 1e290}) {
      const Instance instance = {0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}};
      ASSERT_EQ(scene.place({&instance, 1}), Status::kOk);
      Rays rays;
      rays.add({0.25, 0.125, far}, {0, 0, -size});
      rays.add({0.25, 0.125, far}, {0, 0, size});
      ASSERT_EQ(query.find(scene, rays.options(RayHits::first)), Status::kOk);
      EXPECT_EQ(query.rows()[0].body, 0u) << size << ' ' << far;
      EXPECT_EQ(query.rows()[1].body, kNoIndex) << size << ' ' << far;
      const double expected = (far - 1) / size;
      if (expected < 1e300 && expected > 1e-300) {
        EXPECT_NEAR(query.rows()[0].t / expected, 1, 1e-11) << size << ' ' << far;
      }
    }
  }
}

}  // namespace
}  // namespace tandem
