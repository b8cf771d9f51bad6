// Random surfaces, of which any point must be as near to the other as the bound says.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/geometry/triangle_distance.h"
#include "kernels/query_scenes.h"
#include "levels/hausdorff.h"
#include "levels/stored_level.h"

namespace tandem {
namespace {

using test::Mesh;
using test::StoredLevel;
using Random = std::mt19937_64;
using Position = std::array<double, 3>;

double uniform(Random& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// A corner of the families below.
using MakeCorner = std::array<float, 3> (*)(Random&);

std::array<float, 3> anywhere(Random& random) {
  return {static_cast<float>(uniform(random)), static_cast<float>(uniform(random)),
          static_cast<float>(uniform(random))};
}
std::array<float, 3> on_a_grid(Random& random) {
  const auto place = [&] { return static_cast<float>(random() % 4); };
  return {place(), place(), place()};
}
std::array<float, 3> in_a_plane(Random& random) {
  return {static_cast<float>(uniform(random)), static_cast<float>(uniform(random)), 0.5f};
}
std::array<float, 3> near_a_plane(Random& random) {
  return {static_cast<float>(uniform(random)), static_cast<float>(uniform(random)),
          static_cast<float>(1e-3 * uniform(random))};
}
std::array<float, 3> on_a_line(Random& random) {
  return {static_cast<float>(random() % 64), 0, 0};
}
std::array<float, 3> far_away(Random& random) {
  const auto place = [&] { return 0x1p20f + static_cast<float>(random() % 64) / 8; };
  return {place(), place(), place()};
}
std::array<float, 3> of_any_magnitude(Random& random) {
  const auto place = [&] {
    return static_cast<float>(std::ldexp(uniform(random) - 0.5, static_cast<int>(random() % 270) - 144));
  };
  return {place(), place(), place()};
}

struct Family {
  const char* name;
  MakeCorner make;
};

constexpr Family kFamilies[] = {{"Anywhere", anywhere},
                                {"OnAGrid", on_a_grid},
                                {"InAPlane", in_a_plane},
                                {"NearAPlane", near_a_plane},
                                {"OnALine", on_a_line},
                                {"FarAway", far_away},
                                {"OfAnyMagnitude", of_any_magnitude}};

/// Triangles with corners of a family: large ones, small ones, needles, segments and points.
Mesh make_mesh(const Family& family, Random& random) {
  Mesh mesh;
  const int count = 1 + static_cast<int>(random() % 12);
  for (int t = 0; t < count; ++t) {
    const std::array<float, 3> a = family.make(random), b = family.make(random), c = family.make(random);
    const auto near = [&](const std::array<float, 3>& p, const std::array<float, 3>& q, float share) {
      std::array<float, 3> out;
      for (int k = 0; k < 3; ++k) out[k] = p[k] + share * (q[k] - p[k]);
      return out;
    };
    switch (random() % 8) {
      case 0:
        mesh.add(a, near(a, b, 0.1f), near(a, c, 0.1f));
        break;
      case 1:
        mesh.add(a, b, near(b, c, 1e-6f));
        break;
      case 2:
        mesh.add(a, b, b);
        break;
      case 3:
        mesh.add(a, a, a);
        break;
      default:
        mesh.add(a, b, c);
    }
  }
  return mesh;
}

Position point_on(const Mesh& mesh, Random& random) {
  const auto& triangle = mesh.triangles[random() % mesh.triangles.size()];
  double x = uniform(random), y = uniform(random);
  if (random() % 4 == 0) y = 0;
  if (x + y > 1) {
    x = 1 - x;
    y = 1 - y;
  }
  Position out;
  for (int k = 0; k < 3; ++k) {
    const double a = mesh.points[triangle[0]][k], b = mesh.points[triangle[1]][k],
                 c = mesh.points[triangle[2]][k];
    out[k] = a + (x * (b - a) + y * (c - a));
  }
  return out;
}

/// A proved interval of the distance of a point from the mesh.
DistanceInterval distance_from(const Mesh& mesh, const Position& p) {
  DistanceInterval least = {INFINITY, INFINITY};
  for (const auto& triangle : mesh.triangles) {
    TrianglePair pair;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        pair.a[i][k] = p[k];
        pair.b[i][k] = mesh.points[triangle[i]][k];
      }
    }
    const DistanceInterval interval = triangle_distance(pair).interval;
    least.lower = std::min(least.lower, interval.lower);
    least.upper = std::min(least.upper, interval.upper);
  }
  return least;
}

double largest_coordinate(const Mesh& a, const Mesh& b) {
  double largest = 0;
  for (const Mesh* mesh : {&a, &b})
    for (const auto& point : mesh->points)
      for (const float x : point) largest = std::max(largest, double{std::fabs(x)});
  return largest;
}

class RandomSurfaces : public ::testing::TestWithParam<Family> {};

/// Samples are computed, so they may be beside the surface by the rounding of float64.
TEST_P(RandomSurfaces, AreAsNearAsTheBoundSays) {
  const int trials = test::trials(60, 50);
  int narrow = 0;
  for (int trial = 0; trial < trials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial));
    const Mesh a = make_mesh(GetParam(), random);
    const Mesh b = random() % 4 == 0 ? a : make_mesh(GetParam(), random);
    const HausdorffBound found = hausdorff_bound(StoredLevel(a).view(), StoredLevel(b).view());
    const double rounding = 0x1p-50 * largest_coordinate(a, b);
    double farthest = 0;
    for (int sample = 0; sample < 400; ++sample) {
      const DistanceInterval near_b = distance_from(b, point_on(a, random)),
                             near_a = distance_from(a, point_on(b, random));
      ASSERT_LE(near_b.lower, found.upper + rounding) << "trial " << trial;
      ASSERT_LE(near_a.lower, found.upper + rounding) << "trial " << trial;
      farthest = std::max({farthest, near_a.upper, near_b.upper});
    }
    const Position point = {found.point[0], found.point[1], found.point[2]};
    EXPECT_LE(distance_from(found.point_on_a ? a : b, point).lower, 0x1p-40 * largest_coordinate(a, b));
    EXPECT_GE(distance_from(found.point_on_a ? b : a, point).upper, found.lower) << "trial " << trial;
    EXPECT_LE(farthest, found.upper + rounding) << "trial " << trial;
    EXPECT_TRUE(found.narrow) << "trial " << trial;
    narrow += found.upper <= found.lower * 1.0021 ||
              found.upper <= found.lower + 0x1p-35 * largest_coordinate(a, b);
  }
  EXPECT_EQ(narrow, trials);
}

INSTANTIATE_TEST_SUITE_P(Of, RandomSurfaces, ::testing::ValuesIn(kFamilies),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace tandem
