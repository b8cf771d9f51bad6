#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "kernels/contact/contact_query_fixture.h"
#include "kernels/geometry/point_distance.h"
#include "kernels/geometry/ray_triangle.h"
#include "kernels/points_and_rays/hostile_probes.h"
#include "kernels/points_and_rays/ray_oracle.h"

// A GPU takes the stages of a decision apart: float64 first, then exact arithmetic of a few words, then of
// the most. What one of them is sure of is what the last one says, and rational numbers.
namespace tandem {
namespace {

using test::Place;
using test::PosedTriangle;

void copy(const PosedTriangle& t, double (&corner)[3][3]) {
  for (int c = 0; c < 3; ++c) std::copy_n(t[c].data(), 3, corner[c]);
}

TEST(Stages, WhatFloat64IsSureOfOfRaysIsTrue) {
  std::size_t sure = 0, unsure = 0, ordered = 0;
  for (const test::SceneFamily& family : test::scene_families()) {
    RandomPoses random(7);
    const auto triangles = test::all_of(test::in_leaf_order(family.make(random)));
    if (triangles.empty()) continue;
    const test::Rays rays = test::hostile_rays(random, triangles, test::size_of(triangles), 60);
    for (std::size_t i = 0; i < rays.origins.size(); ++i) {
      double origin[3], direction[3];
      std::copy_n(rays.origins[i].data(), 3, origin);
      std::copy_n(rays.directions[i].data(), 3, direction);
      bool any = false;
      ray::FoundHit before = {};
      double of_before[3][3];
      for (std::size_t t = 0; t < std::min<std::size_t>(triangles.size(), 40); ++t) {
        double corner[3][3];
        copy(triangles[t], corner);
        const RayOracle oracle(origin, direction, corner);
        ray::FoundHit hit = {};
        hit.triangle = static_cast<std::uint32_t>(t);
        const ray::Answer answer =
            ray::find_by_float64(ray::volumes_of(origin, direction, corner), hit.meeting);
        (answer == ray::Answer::unsure ? unsure : sure) += 1;
        ASSERT_TRUE(answer == ray::Answer::unsure || (answer == ray::Answer::yes) == oracle.meets());
        if (ray::words_of(origin, direction, corner, corner) <= ray::kFewWords) {
          ray::Meeting few = {}, most = {};
          ASSERT_EQ(ray::find_meeting<ray::kFewWords>(origin, direction, corner, few), oracle.meets());
          ASSERT_EQ(ray::find_meeting(origin, direction, corner, most), oracle.meets());
          if (oracle.meets()) {
            EXPECT_EQ(few.t.lower, most.t.lower);
            EXPECT_EQ(few.t.upper, most.t.upper);
            EXPECT_EQ(few.weight[0], most.weight[0]);
            EXPECT_EQ(few.weight[1], most.weight[1]);
          }
        }
        if (!ray::find_meeting(origin, direction, corner, hit.meeting)) continue;
        if (any) {
          const ray::Answer first = ray::comes_before_by_float64(hit, before);
          const bool is_first = ray::comes_before_exactly(origin, direction, hit, corner, before, of_before);
          ASSERT_TRUE(first == ray::Answer::unsure || (first == ray::Answer::yes) == is_first);
          ordered += first != ray::Answer::unsure;
        }
        any = true;
        before = hit;
        std::copy_n(&corner[0][0], 9, &of_before[0][0]);
      }
    }
  }
  EXPECT_GT(sure, 1000u);
  EXPECT_GT(unsure, 100u);
  EXPECT_GT(ordered, 100u);
}

TEST(Stages, WhatFloat64IsSureOfOfPointsIsTrue) {
  std::size_t sure = 0, unsure = 0;
  for (const test::SceneFamily& family : test::scene_families()) {
    RandomPoses random(8);
    const auto bodies = test::in_leaf_order(family.make(random));
    const auto triangles = test::all_of(bodies);
    if (triangles.empty()) continue;
    for (const Place& point : test::hostile_points(random, bodies, 60)) {
      for (std::size_t t = 0; t < std::min<std::size_t>(triangles.size(), 40); ++t) {
        const TrianglePair pair = test::pair_of(triangles[t], {point, point, point});
        TriangleDistance found;
        const bool is_sure = point_distance_by_float64(pair, {}, found);
        (is_sure ? sure : unsure) += 1;
        if (!is_sure) continue;
        const TriangleDistance exact = triangle_distance(pair, {0, kFinestRelative});
        EXPECT_LE(found.interval.lower, exact.interval.upper);
        EXPECT_LE(exact.interval.lower, found.interval.upper);
        EXPECT_LE(found.interval.upper - found.interval.lower, allowed_width({}, found.interval.upper));
        EXPECT_GT(exact.interval.upper, 0);
      }
    }
  }
  EXPECT_GT(sure, 1000u);
  EXPECT_GT(unsure, 100u);
}

}  // namespace
}  // namespace tandem
