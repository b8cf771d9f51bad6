#include "tandem/kernels/closest_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "kernels/contact/contact_query_fixture.h"
#include "kernels/geometry/triangle_distance.h"
#include "kernels/points_and_rays/hostile_probes.h"
#include "kernels/points_and_rays/probe_ways.h"
#include "kernels/points_and_rays/ray_oracle.h"
#include "kernels/points_and_rays/scene_probe.h"
#include "kernels/solid_meshes.h"
#include "kernels/triangle_oracle.h"

// Closest points against rational numbers, and sides against rays in directions that meet no edge.
namespace tandem {
namespace {

using test::hostile_points;
using test::PosedTriangle;
using Vector = test::Place;

std::vector<std::vector<PosedTriangle>> posed(const BodyScene& scene) {
  std::vector<std::vector<PosedTriangle>> out;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) out.push_back(posed_triangles(scene, i));
  return out;
}

TrianglePair pair_of(const PosedTriangle& t, const Vector& point) {
  return test::pair_of(t, {point, point, point});
}

/// Returns a bound of the distance of a point and a triangle, near it from below. For any n, no point of the
/// triangle is nearer than the least n . (p - corner) / |n|. n leads from the nearest of some points of the
/// triangle, which are as near as float64 makes them: their errors cost nearness alone. The rest of the
/// roundings is below 2^-44 of the largest |p - corner|.
double least_distance(const PosedTriangle& t, const Vector& p) {
  const auto minus = [](const Vector& x, const Vector& y) {
    return Vector{x[0] - y[0], x[1] - y[1], x[2] - y[2]};
  };
  const auto dot = [](const Vector& x, const Vector& y) { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; };
  const Vector e = minus(t[1], t[0]), f = minus(t[2], t[0]), q = minus(p, t[0]);
  const double ee = dot(e, e), ef = dot(e, f), ff = dot(f, f), eq = dot(e, q), fq = dot(f, q);
  const double area = ee * ff - ef * ef;
  const double b = (ff * eq - ef * fq) / area, c = (ee * fq - ef * eq) / area;
  double best = std::numeric_limits<double>::infinity();
  Vector n = q;
  const auto offer = [&](double of_e, double of_f) {
    Vector from;
    for (std::size_t k = 0; k < 3; ++k) from[k] = q[k] - (of_e * e[k] + of_f * f[k]);
    if (dot(from, from) < best) best = dot(from, from), n = from;
  };
  const auto share = [](double x) { return x > 0 ? std::min(x, 1.0) : 0; };
  if (b > 0 && c > 0 && b + c < 1) offer(b, c);
  offer(share(eq / ee), 0);
  offer(0, share(fq / ff));
  const double along = share((fq - eq + ee - ef) / (ee - 2 * ef + ff));
  offer(1 - along, along);
  double least = std::numeric_limits<double>::infinity(), size = 0;
  for (const Vector& corner : t) {
    const Vector to = minus(p, corner);
    least = std::min(least, dot(n, to));
    size = std::max(size, std::sqrt(dot(to, to)));
  }
  const double length = std::sqrt(dot(n, n));
  return length > 0 ? least / length - 0x1p-44 * size : 0;
}

void expect_closest(const ClosestPoint& row, const Vector& point,
                    const std::vector<std::vector<PosedTriangle>>& bodies, const BodyScene& scene,
                    const DistanceTolerance& tolerance) {
  EXPECT_LE(row.upper - row.lower, allowed_width(tolerance, row.upper));
  const LevelView level = scene.assets.views()[scene.instances[row.body].asset].level();
  ASSERT_EQ(level.triangles[row.triangle].source_face(), row.face);
  for (std::uint32_t body = 0; body < bodies.size(); ++body) {
    for (std::uint32_t face = 0; face < bodies[body].size(); ++face) {
      const bool is_named = body == row.body && face == row.face;
      if (!is_named && least_distance(bodies[body][face], point) > row.upper) continue;
      const TrianglePair pair = pair_of(bodies[body][face], point);
      const DistanceOracle oracle(pair);
      const bool not_nearer = row.lower == 0 || oracle.is_in(row.lower, HUGE_VAL);
      EXPECT_TRUE(not_nearer) << oracle.rounded() << " below " << row.lower;
      if (is_named) {
        EXPECT_TRUE(oracle.is_in(row.lower, row.upper)) << oracle.rounded() << ' ' << row.upper;
        EXPECT_EQ(row.upper == 0, oracle.meet());
      }
      if (oracle.meet()) {
        EXPECT_EQ(row.upper, 0);
      }
    }
  }
}

class ClosestScenes : public testing::TestWithParam<test::SceneFamily> {};

INSTANTIATE_TEST_SUITE_P(All, ClosestScenes, testing::ValuesIn(test::scene_families()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(ClosestScenes, IntervalsContainTheDistancesOfRationalNumbers) {
  for (int trial = 0; trial < test::trials(3, 50) && !HasFailure(); ++trial) {
    RandomPoses random(17 + static_cast<std::uint64_t>(trial));
    const BodyScene bodies = GetParam().make(random);
    const auto triangles = posed(bodies);
    if (triangles.empty()) continue;
    const std::vector<Vector> points = hostile_points(random, triangles, 40);
    Scene scene;
    ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
    ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
    ClosestQuery query;
    for (const double relative : {1e-6, 0x1p-48}) {
      const ClosestOptions options = {.points = points, .tolerance = {0, relative}};
      ASSERT_EQ(query.find(scene, options), Status::kOk);
      ASSERT_EQ(query.rows().size(), points.size());
      for (std::size_t i = 0; i < points.size() && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "trial " << trial << " point " << i);
        expect_closest(query.rows()[i], points[i], triangles, bodies, options.tolerance);
      }
    }
    // Within a reach the rows are those that are found without, beyond it there is no body.
    ClosestOptions options = {.points = points};
    ClosestQuery within;
    options.reach = query.rows()[7].upper;
    ASSERT_EQ(within.find(scene, options), Status::kOk);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ClosestPoint &free = query.rows()[i], &row = within.rows()[i];
      if (free.lower > options.reach) {
        EXPECT_EQ(row.body, kNoIndex);
        EXPECT_GE(row.lower, options.reach);
        EXPECT_EQ(row.upper, HUGE_VAL);
      } else if (free.upper <= options.reach) {
        EXPECT_TRUE(row.body != kNoIndex && row.lower <= free.upper && free.lower <= row.upper);
      }
    }
  }
}

/// How often surfaces wind around a point, by a ray that meets no edge; nothing where it is on one.
struct Around {
  std::int32_t winding;
  std::uint32_t crossings;
};
std::optional<Around> around(const std::vector<PosedTriangle>& triangles, const LevelView& level,
                             const Vector& point, RandomPoses& random) {
  for (int trial = 0; trial < 100; ++trial) {
    const Vector along = {random.symmetric(1), random.symmetric(1), random.symmetric(1)};
    Around out = {0, 0};
    bool plain = true;
    for (std::uint32_t t = 0; t < level.triangle_count && plain; ++t) {
      const PosedTriangle& triangle = triangles[level.triangles[t].source_face()];
      double corner[3][3];
      for (int c = 0; c < 3; ++c) std::copy_n(triangle[c].data(), 3, corner[c]);
      if (surely_passes_by(point.data(), along.data(), corner)) continue;
      const RayOracle oracle(point.data(), along.data(), corner);
      if (oracle.meets() && oracle.is_at_most(0)) return std::nullopt;
      if (!oracle.meets()) continue;
      plain = oracle.is_plain();
      const double end[3] = {corner[0][0] + along[0], corner[0][1] + along[1], corner[0][2] + along[2]};
      const int side = oracle_volume_sign(corner[0], corner[1], corner[2], end);
      out.winding += is_turned(level.topology[t].flags) ? -side : side;
      ++out.crossings;
    }
    if (plain) return out;
  }
  return std::nullopt;
}

// One mesh of 6,000 triangles, as it is stored and posed: 100,000 points where TANDEM_LONG is set.
TEST(ClosestPoints, OfAMeshAreThoseOfRationalNumbers) {
  BodyScene bodies;
  bodies.assets.add(test::project_mesh("cow.obj"));
  bodies.instances.push_back({0, kIdentityPose});
  RandomPoses random(12);
  std::size_t inside = 0, on_surface = 0;
  for (int turn = 0; turn < 2; ++turn) {
    if (turn != 0) bodies.instances[0].pose = test::any_rotation(random);
    const auto triangles = posed(bodies);
    const std::vector<Vector> points = hostile_points(random, triangles, test::trials(1000, 50));
    const LevelView level = bodies.assets.views()[0].level();
    Scene scene;
    ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
    ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
    ClosestQuery query;
    const ClosestOptions options = {.points = points, .sides = true};
    ASSERT_EQ(query.find(scene, options), Status::kOk);
    for (std::size_t i = 0; i < points.size() && !HasFailure(); ++i) {
      SCOPED_TRACE(testing::Message() << "turn " << turn << " point " << i);
      const ClosestPoint& row = query.rows()[i];
      expect_closest(row, points[i], triangles, bodies, options.tolerance);
      on_surface += row.upper == 0;
      const auto expected = around(triangles[0], level, points[i], random);
      if (!expected.has_value()) continue;
      EXPECT_EQ(row.winding, expected->winding);
      EXPECT_EQ(row.within != kNoIndex, expected->crossings % 2 != 0);
      inside += row.within != kNoIndex;
    }
  }
  EXPECT_GT(inside, 100u);
  EXPECT_GT(on_surface, 100u);
}

TEST(ClosestPoints, RowsOfEachBodyAreThoseOfASceneWithThatBodyAlone) {
  BodyScene bodies = crowd(5, 40);
  RandomPoses random(6);
  const std::vector<Vector> points = hostile_points(random, posed(bodies), 600);
  const std::vector<std::uint32_t> asked = {7, 0, 39, 7};
  Scene scene;
  ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
  for (const std::uint32_t threads : {1u, 3u}) {
    ASSERT_EQ(scene.set_threads(threads), Status::kOk);
    ClosestQuery query;
    ASSERT_EQ(query.find(scene, {.points = points, .bodies = asked, .sides = true}), Status::kOk);
    ASSERT_EQ(query.rows().size(), points.size() * asked.size());
    for (std::size_t k = 0; k < asked.size(); ++k) {
      Scene alone;
      ASSERT_EQ(alone.set_assets(bodies.assets.views()), Status::kOk);
      ASSERT_EQ(alone.place({&bodies.instances[asked[k]], 1}), Status::kOk);
      ClosestQuery of_one;
      ASSERT_EQ(of_one.find(alone, {.points = points, .sides = true}), Status::kOk);
      for (std::size_t i = 0; i < points.size(); ++i) {
        ClosestPoint row = of_one.rows()[i];
        row.body = asked[k];
        if (row.within != kNoIndex) row.within = asked[k];
        EXPECT_EQ(query.rows()[i * asked.size() + k], row) << i << ' ' << k;
      }
    }
  }
  ASSERT_EQ(scene.remove(7), Status::kOk);
  ClosestQuery query;
  EXPECT_EQ(query.find(scene, {.points = points, .bodies = {asked.data() + 1, 3}}), Status::kUnknownInstance);
  EXPECT_EQ(scene.where(), 2u);
}

TEST(ClosestPoints, SidesAreThoseOfRaysInOtherDirections) {
  BodyScene bodies;
  test::SampleAssets& assets = bodies.assets;
  assets.add(test::cube(1, 2));
  assets.add(test::joined(test::box(2, 2, 2), test::box(1, 1, 1)));
  assets.add(test::joined(test::box(1, 2, 1), test::sheet(1, 2)));
  assets.add(test::ring(7, 2, 5, 0.5));
  assets.add(test::sheet(2, 3));
  for (int turn = 0; turn < 4; ++turn) {
    RandomPoses random(31 + static_cast<std::uint64_t>(turn));
    std::vector<Instance>& instances = bodies.instances;
    instances.clear();
    for (std::uint32_t i = 0; i < assets.size(); ++i)
      instances.push_back({i, turn == 0 ? kIdentityPose : test::any_rotation(random)});
    Scene scene;
    ASSERT_EQ(scene.set_assets(assets.views()), Status::kOk);
    ASSERT_EQ(scene.place(instances), Status::kOk);
    const std::vector<std::vector<PosedTriangle>> triangles = posed(bodies);
    const std::vector<Vector> points = hostile_points(random, triangles, test::trials(150, 20));
    ClosestQuery query;
    ASSERT_EQ(query.find(scene, {.points = points, .sides = true}), Status::kOk);
    std::size_t inside = 0, several = 0;
    for (std::size_t p = 0; p < points.size(); ++p) {
      std::int32_t winding = 0;
      std::uint32_t within = kNoIndex;
      bool known = true;
      for (std::uint32_t i = 0; i < instances.size() && known; ++i) {
        const LevelView level = assets.views()[i].level();
        if (i == 4) continue;  // open
        std::vector<PosedTriangle> of = triangles[i];
        if (i == 2) {
          // Of the sheet within the box there is no inside: it is one point, which nothing crosses.
          for (std::size_t t = 0; t < of.size(); ++t) {
            if (t >= 12) of[t] = {of[0][0], of[0][0], of[0][0]};
          }
        }
        const auto expected = around(of, level, points[p], random);
        known = expected.has_value();
        if (!known) break;
        winding += expected->winding;
        if (expected->crossings % 2 != 0) within = std::min(within, i);
      }
      if (!known) continue;
      EXPECT_EQ(query.rows()[p].winding, winding) << turn << ' ' << p;
      EXPECT_EQ(query.rows()[p].within, within) << turn << ' ' << p;
      inside += within != kNoIndex;
      several += winding > 1 || winding < -1;
    }
    EXPECT_GT(inside, 10u);
    EXPECT_GT(several, 5u);
  }
}

TEST(ClosestPoints, RowsAreTheSameWhateverTheThreads) {
  const BodyScene bodies = crowd(5, 80);
  RandomPoses random(8);
  const std::vector<Vector> points = hostile_points(random, posed(bodies), 5000);
  Scene scene;
  ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
  const ClosestOptions options = {.points = points, .sides = true};
  ClosestQuery alone;
  ASSERT_EQ(alone.find(scene, options), Status::kOk);
  for (const std::uint32_t threads : {2u, 3u, 8u}) {
    ClosestQuery query;
    ASSERT_EQ(scene.set_threads(threads), Status::kOk);
    ASSERT_EQ(query.find(scene, options), Status::kOk);
    EXPECT_TRUE(std::ranges::equal(query.rows(), alone.rows()));
    EXPECT_EQ(query.counters(), alone.counters());
  }
}

TEST(ClosestPoints, EveryWayOffersTheSameCandidates) {
  test::SampleAssets assets;
  RandomPoses random(4);
  assets.add(test::soup(random, 300, 0.2));
  const LevelView level = assets.views()[0].level();
  const FileHeader& header = *assets.views()[0].header;
  const LocalFrame frame = local_frame(kIdentityPose, extent_of(level.blocks[0]), header.lower, header.upper);
  using Offered = std::vector<std::pair<float, std::uint32_t>>;
  const auto offered_by = [&](PointWalk walk, const Vector& point, Offered& out) {
    PointTask task;
    const double p[3] = {point[0], point[1], point[2]};
    ASSERT_TRUE(local_point(frame, p, task.point));
    task.tree = &level;
    task.lengths = &frame;
    task.upper = HUGE_VAL;
    task.context = &out;
    task.take = [](PointTask& of, const ClosestCandidate* candidates, std::uint32_t count) {
      for (std::uint32_t i = 0; i < count; ++i)
        static_cast<Offered*>(of.context)->push_back({candidates[i].lower, candidates[i].triangle});
    };
    walk(task);
    out.push_back({0, static_cast<std::uint32_t>(task.blocks)});
  };
  for (int i = 0; i < 2000; ++i) {
    const Vector point = {random.symmetric(2), random.symmetric(2), random.symmetric(2)};
    Offered plain;
    offered_by(point_walk(BlockPairVariant::scalar), point, plain);
    for (const BlockPairVariant variant : kBlockPairVariants) {
      if (point_walk(variant) == nullptr) continue;
      Offered offered;
      offered_by(point_walk(variant), point, offered);
      ASSERT_EQ(offered, plain);
    }
  }
}

TEST(ClosestPoints, WhatIsNoPointIsNamed) {
  const BodyScene cubes = row_of_cubes(2);
  Scene scene;
  ASSERT_EQ(scene.set_assets(cubes.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(cubes.instances), Status::kOk);
  ClosestQuery query;
  std::vector<Vector> points = {{0, 0, 0}, {0, std::nan(""), 0}};
  EXPECT_EQ(query.find(scene, {.points = points}), Status::kOutOfRange);
  EXPECT_EQ(scene.where(), 1u);
  EXPECT_TRUE(query.rows().empty());
  points[1] = {0, 0, 1e300};
  EXPECT_EQ(query.find(scene, {.points = points, .tolerance = {-1, 0}}), Status::kBadTolerance);
  EXPECT_EQ(query.find(scene, {.points = points, .reach = -1}), Status::kBadReach);
  ASSERT_EQ(query.find(scene, {.points = points, .sides = true}), Status::kOk);
  EXPECT_EQ(query.rows()[0].within, 0u);
  EXPECT_NEAR(query.rows()[1].upper / 1e300, 1, 1e-6);
  ASSERT_EQ(query.find(scene, {}), Status::kOk);
  EXPECT_TRUE(query.rows().empty());
  ASSERT_EQ(scene.place({}), Status::kOk);
  ASSERT_EQ(query.find(scene, {.points = points, .sides = true}), Status::kOk);
  EXPECT_EQ(query.rows()[0].body, kNoIndex);
  EXPECT_EQ(query.rows()[0].lower, HUGE_VAL);
  EXPECT_EQ(query.rows()[0].within, kNoIndex);
}

}  // namespace
}  // namespace tandem
