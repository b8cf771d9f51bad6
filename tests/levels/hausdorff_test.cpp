// Surfaces whose Hausdorff distance is known.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/geometry/triangle_distance.h"
#include "kernels/query_scenes.h"
#include "kernels/solid_meshes.h"
#include "levels/hausdorff.h"
#include "levels/nearest_triangle.h"
#include "levels/stored_level.h"
#include "parallel/parallel.h"

namespace tandem::test {
namespace {

Mesh scaled(Mesh mesh, float factor) {
  for (auto& point : mesh.points)
    for (float& x : point) x *= factor;
  return mesh;
}

Mesh triangle(std::array<float, 3> a, std::array<float, 3> b, std::array<float, 3> c) {
  Mesh mesh;
  mesh.add(a, b, c);
  return mesh;
}

/// A rectangle with these corners, in order.
Mesh rectangle(std::array<float, 3> a, std::array<float, 3> b, std::array<float, 3> c,
               std::array<float, 3> d) {
  return joined(triangle(a, b, c), triangle(a, c, d));
}

HausdorffBound bound(const Mesh& a, const Mesh& b, const HausdorffOptions& options = {}) {
  return hausdorff_bound(StoredLevel(a).view(), StoredLevel(b).view(), options);
}

/// Whether the bounds of a and b, in either order, hold this distance and are as narrow as asked for.
void expect_distance(const Mesh& a, const Mesh& b, double distance) {
  for (const bool turned : {false, true}) {
    const HausdorffBound found = turned ? bound(b, a) : bound(a, b);
    EXPECT_LE(found.lower, distance) << turned;
    EXPECT_GE(found.upper, distance) << turned;
    EXPECT_TRUE(found.narrow);
    EXPECT_LE(found.upper, found.lower * (1 + HausdorffOptions().relative) * (1 + 1e-9)) << turned;
  }
}

TEST(Hausdorff, OfParallelSheetsIsTheirDistance) {
  expect_distance(sheet(4, 3), moved(sheet(4, 5), 0, 0, 0.25f), 0.25);
}

TEST(Hausdorff, OfASheetInALargerOneIsThatOfTheCorners) {
  expect_distance(sheet(4, 3), sheet(2, 7), std::sqrt(2.0));
}

TEST(Hausdorff, OfATentOverASheetIsItsHeight) {
  Mesh tent;
  tent.add({-1, -1, 0}, {1, -1, 0}, {0, 0, 0.5f});
  tent.add({1, -1, 0}, {1, 1, 0}, {0, 0, 0.5f});
  tent.add({1, 1, 0}, {-1, 1, 0}, {0, 0, 0.5f});
  tent.add({-1, 1, 0}, {-1, -1, 0}, {0, 0, 0.5f});
  expect_distance(tent, sheet(2, 6), 0.5);
}

TEST(Hausdorff, OfASpikeIsItsLength) {
  const Mesh spike = triangle({0.1f, 0, 0}, {0.11f, 0, 0}, {0.105f, 0, 30});
  expect_distance(joined(sheet(2, 6), spike), sheet(2, 6), 30);
}

/// No corner of any triangle is far from the other surface.
TEST(Hausdorff, IsFoundWithinFacesBetweenTwoSurfaces) {
  const float w = 0.125f;
  const auto strip = [&](float z) { return rectangle({-2, -w, z}, {2, -w, z}, {2, w, z}, {-2, w, z}); };
  const Mesh wall = rectangle({-2, 0, -1}, {2, 0, -1}, {2, 0, 1}, {-2, 0, 1});
  expect_distance(wall, joined(strip(-1), strip(1)), 1);
}

TEST(Hausdorff, IsFoundWhereManySurfacesAreEquallyNear) {
  const Mesh cube = box(2, 2, 2);
  expect_distance(joined(cube, sheet(2, 1)), cube, 1);
  expect_distance(joined(cube, scaled(sheet(2, 1), 0.9f)), cube, 1);
}

/// The wall's points are as far as they are from the seam of two sheets that meet at a right angle.
TEST(Hausdorff, IsFoundOnABisector) {
  const Mesh sheets = joined(rectangle({0, 0, -1}, {3, 0, -1}, {3, 0, 1}, {0, 0, 1}),
                             rectangle({0, 0, -1}, {0, 3, -1}, {0, 3, 1}, {0, 0, 1}));
  const Mesh across = triangle({0.5f, 0, 0}, {0, 0.5f, 0}, {0.5f, 0.5f, 0});
  expect_distance(joined(sheets, across), sheets, 0.5);
  const Mesh flat = triangle({1, 0, 0}, {0, 1, 0}, {0, 1, 0.5f});
  expect_distance(joined(sheets, flat), sheets, 0.5);
}

TEST(Hausdorff, OfPointsAndSegmentsIsThatOfTheHulls) {
  const Mesh point = triangle({1, 2, 3}, {1, 2, 3}, {1, 2, 3});
  const Mesh segment = triangle({0, 0, 0}, {4, 0, 0}, {1, 0, 0});
  expect_distance(point, moved(point, 3, 0, 4), 5);
  expect_distance(point, segment, std::sqrt(9.0 + 4 + 9));
  expect_distance(segment, moved(segment, 1, 0, 0), 1);
  expect_distance(
      segment, joined(triangle({0, 0, 0}, {0, 0, 0}, {0, 0, 0}), triangle({4, 0, 0}, {4, 0, 0}, {4, 0, 0})),
      2);
}

TEST(Hausdorff, OfOneSurfaceDividedTwiceIsNearlyNothing) {
  for (const float factor : {1.0f, 1e-30f, 1e30f}) {
    const Mesh a = scaled(sheet(2, 3), factor), b = scaled(sheet(2, 16), factor);
    const HausdorffBound found = bound(a, b);
    EXPECT_LE(found.upper, 0x1p-23 * factor);
    EXPECT_LT(found.lower, found.upper);
    EXPECT_TRUE(found.narrow);
    EXPECT_LT(found.pieces, 10'000u);
  }
}

TEST(Hausdorff, OfASurfaceFromItselfIsNearlyNothing) {
  const Mesh mesh = joined(random_mesh(500, 3), sphere(2, 3));
  const HausdorffBound found = bound(mesh, mesh);
  EXPECT_LE(found.upper, 2 * 0x1p-36);
  EXPECT_EQ(found.lower, 0);
}

/// Flat triangles that cover the same places again and again.
TEST(Hausdorff, OfOverlappingSegmentsTakesFewPieces) {
  Mesh mesh;
  mesh.add({40, 0, 0}, {35, 0, 0}, {49, 0, 0});
  mesh.add({45, 0, 0}, {54, 0, 0}, {53.9999619f, 0, 0});
  mesh.add({39, 0, 0}, {5, 0, 0}, {19, 0, 0});
  mesh.add({35, 0, 0}, {1, 0, 0}, {1, 0, 0});
  mesh.add({52, 0, 0}, {49.5f, 0, 0}, {51.5999985f, 0, 0});
  mesh.add({16, 0, 0}, {45, 0, 0}, {45, 0, 0});
  mesh.add({8, 0, 0}, {63, 0, 0}, {36, 0, 0});
  mesh.add({61, 0, 0}, {19, 0, 0}, {14, 0, 0});
  mesh.add({38, 0, 0}, {36.4000015f, 0, 0}, {36.9000015f, 0, 0});
  const HausdorffBound found = bound(mesh, mesh);
  EXPECT_LE(found.upper, 64 * 0x1p-36);
  EXPECT_TRUE(found.narrow);
  EXPECT_LT(found.pieces, 2'000u);
  EXPECT_GT(found.pieces, 0u);
}

TEST(Hausdorff, OfTrianglesAtTheOriginIsNothing) {
  const Mesh point = triangle({0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  const HausdorffBound found = bound(point, point);
  EXPECT_EQ(found.upper, 0);
  EXPECT_EQ(found.lower, 0);
  EXPECT_TRUE(found.narrow);
}

/// An icosahedron's kind of test: the middles of the coarse sphere's triangles are the farthest.
TEST(Hausdorff, OfSpheresIsTheHeightOfTheCoarseOnesCaps) {
  const Mesh coarse = sphere(1, 0), fine = sphere(1, 5);
  const HausdorffBound found = bound(coarse, fine);
  const double height = 1 - 1 / std::sqrt(3.0);  // of the octahedron
  EXPECT_LE(found.lower, height * (1 + 1e-6));
  EXPECT_NEAR(found.upper, height, 0.005);
}

/// Scaling by powers of two rounds nothing, down to denormal coordinates and up to the largest. Boxes are
/// rounded where coordinates are single steps of denormal numbers.
TEST(Hausdorff, ScalesWithItsSurfaces) {
  const Mesh a = scaled(sphere(1000, 2), 1), b = scaled(sphere(1000, 1), 1);
  const auto whole = [](Mesh mesh) {
    for (auto& point : mesh.points)
      for (float& x : point) x = std::round(x);
    return mesh;
  };
  const HausdorffBound found = bound(whole(a), whole(b));
  for (const int exponent : {-140, -60, 60, 117}) {
    const float factor = std::ldexp(1.0f, exponent);
    const HausdorffBound again = bound(scaled(whole(a), factor), scaled(whole(b), factor));
    EXPECT_EQ(again.upper, std::ldexp(found.upper, exponent)) << exponent;
    EXPECT_EQ(again.lower, std::ldexp(found.lower, exponent)) << exponent;
  }
  const HausdorffBound least = bound(scaled(whole(a), 0x1p-149f), scaled(whole(b), 0x1p-149f));
  EXPECT_LE(least.upper, found.upper * 0x1p-149 * 1.0021);
  EXPECT_GE(least.upper, found.lower * 0x1p-149);
  EXPECT_LE(least.lower, found.upper * 0x1p-149);
}

/// Coordinates have steps of 1 there, and so the surfaces do.
TEST(Hausdorff, HoldsFarFromTheOrigin) {
  const float far = 0x1p23f;
  expect_distance(moved(sheet(64, 4), far, far, far), moved(sheet(64, 8), far, far, far + 3), 3);
}

TEST(Hausdorff, IsTheSameWithoutTopology) {
  const StoredLevel a(sphere(1, 3)), b(sphere(1, 2));
  const HausdorffBound with = hausdorff_bound(a.view(), b.view());
  const HausdorffBound without = hausdorff_bound(a.triangles_only(), b.triangles_only());
  EXPECT_LE(without.lower, with.upper);
  EXPECT_LE(with.lower, without.upper);
  EXPECT_LE(without.upper, without.lower * 1.0021);
}

TEST(Hausdorff, DoesNotDependOnThreads) {
  const StoredLevel a(joined(sphere(1, 5), sphere(0.97, 4))), b(sphere(1, 3));
  HausdorffBound found[2];
  for (const int i : {0, 1}) {
    const parallel::ThreadLimit threads(i == 0 ? 1 : 4);
    found[i] = hausdorff_bound(a.view(), b.view());
  }
  EXPECT_EQ(found[0].upper, found[1].upper);
  EXPECT_EQ(found[0].lower, found[1].lower);
  EXPECT_EQ(found[0].pieces, found[1].pieces);
  EXPECT_GT(found[0].pieces, 0u);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(found[0].point[k], found[1].point[k]);
}

TEST(Hausdorff, HoldsWhenPiecesRunOutAndSaysSo) {
  const Mesh coarse = sphere(1, 0), fine = sphere(1, 4);
  HausdorffOptions options;
  const HausdorffBound narrow = bound(coarse, fine, options);
  options.most_pieces = 0;
  const HausdorffBound wide = bound(coarse, fine, options);
  EXPECT_TRUE(narrow.narrow);
  EXPECT_FALSE(wide.narrow);
  EXPECT_EQ(wide.pieces, 0u);
  EXPECT_LE(wide.lower, narrow.upper);
  EXPECT_GT(wide.upper, narrow.upper);
  EXPECT_LT(wide.upper, 2);
}

/// Triangles round an edge, whose boxes all hold the points near it.
Mesh spokes(int count) {
  Mesh mesh;
  for (int i = 0; i < count; ++i) {
    const double turn = 2 * 3.14159265358979 * i / count;
    const auto x = static_cast<float>(2 * std::cos(turn)), y = static_cast<float>(2 * std::sin(turn));
    mesh.add({0, 0, -5}, {0, 0, 5}, {x, y, 0});
  }
  return mesh;
}

/// A point of the ball is about as near to many spokes.
TEST(Hausdorff, OfABallInAFanTakesLooksInProportionToItsTriangles) {
  for (const int count : {1000, 8000}) {
    const Mesh fan = spokes(count);
    HausdorffOptions options;
    options.most_looks = 100u * static_cast<unsigned>(count);
    const HausdorffBound found = bound(joined(fan, sphere(1, 4)), fan, options);
    EXPECT_LE(found.looks, 1200u * static_cast<unsigned>(count)) << count;
    EXPECT_FALSE(found.narrow);
    EXPECT_GT(found.upper, found.lower);
  }
}

TEST(Hausdorff, HoldsWhenLooksRunOutAndSaysSo) {
  const Mesh coarse = sphere(1, 0), fine = sphere(1, 4);
  HausdorffOptions options;
  options.most_looks = 0;
  const HausdorffBound wide = bound(coarse, fine, options);
  EXPECT_FALSE(wide.narrow);
  EXPECT_EQ(wide.pieces, 0u);
  EXPECT_GT(wide.upper, bound(coarse, fine).upper);
}

/// Cubes of a grid whose coordinates are rounded, so that boxes of different trees end differently.
Mesh cubes_of_a_grid(float step, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Mesh mesh;
  for (int i = 0; i < 12; ++i) {
    float place[3];
    for (float& x : place) x = static_cast<float>(random() % 9) * step;
    mesh = joined(mesh, moved(box(step, step, step), place[0], place[1], place[2]));
  }
  return mesh;
}

/// Divides the triangles, without a change of the surface if all lie in planes of two axes and have edges
/// along both.
Mesh divided(const Mesh& mesh) {
  Mesh parts;
  for (const auto& triangle : mesh.triangles) {
    std::array<float, 3> corner[3], middle[3];
    for (std::size_t k = 0; k < 3; ++k) corner[k] = mesh.points[triangle[k]];
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        middle[k][axis] = std::midpoint(corner[k][axis], corner[(k + 1) % 3][axis]);
    for (std::size_t k = 0; k < 3; ++k) parts.add(middle[(k + 2) % 3], corner[k], middle[k]);
    parts.add(middle[0], middle[1], middle[2]);
  }
  return parts;
}

/// Such as bvhbuild's trees and those of the file: where the distance is nothing, the bound is rounding
/// alone.
TEST(Hausdorff, ABoundFoundWithSomeTreesIsProvedWithOthers) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const Mesh coarse = cubes_of_a_grid(1.0f / 3, seed), fine = divided(divided(coarse));
    const StoredLevel some[] = {StoredLevel(fine), StoredLevel(coarse)};
    const StoredLevel others[] = {StoredLevel(fine, build::Effort::standard),
                                  StoredLevel(coarse, build::Effort::standard)};
    HausdorffOptions options;
    options.wanted = hausdorff_bound(some[0].view(), some[1].view()).upper;
    EXPECT_LT(*options.wanted, 0x1p-36);
    const HausdorffBound decided = hausdorff_bound(others[0].view(), others[1].view(), options);
    EXPECT_TRUE(decided.narrow) << seed;
    EXPECT_LE(decided.upper, *options.wanted) << seed;
    options.wanted = hausdorff_bound(others[0].view(), others[1].view()).upper;
    EXPECT_TRUE(hausdorff_bound(some[0].view(), some[1].view(), options).narrow) << seed;
  }
}

TEST(Hausdorff, DecidesWhetherItIsWithinAWantedLength) {
  const StoredLevel coarse(sphere(1, 1)), fine(sphere(1, 5));
  const HausdorffBound found = hausdorff_bound(coarse.view(), fine.view());
  for (const double factor : {0.1, 0.5, 0.99, 1.001, 1.5, 10.0}) {
    HausdorffOptions options;
    options.wanted = factor * found.upper;
    const HausdorffBound decided = hausdorff_bound(coarse.view(), fine.view(), options);
    EXPECT_TRUE(decided.narrow);
    EXPECT_LE(decided.pieces, found.pieces);
    if (factor < 1) {
      EXPECT_GT(decided.lower, *options.wanted) << factor;
      EXPECT_EQ(decided.upper, INFINITY) << factor;
    } else {
      EXPECT_LE(decided.upper, *options.wanted) << factor;
      EXPECT_GE(decided.upper, found.lower) << factor;
    }
  }
}

// Random surfaces, of which any point must be as near to the other as the bound says.

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

/// Asked for with every triangle as the hint in turn, the search finds what trying all triangles finds.
TEST(NearestTriangle, IsTheNearestOfAll) {
  const StoredLevel stored(random_mesh(300, 7));
  const LevelView& level = stored.view();
  std::mt19937_64 random(1);
  const auto place = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 0.5; };
  for (std::uint32_t hint = 0; hint < level.triangle_count; ++hint) {
    const levels::Point p = {{place(), place(), place()}};
    double least = INFINITY, proved = INFINITY;
    for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
      TrianglePair pair;
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
          pair.a[i][k] = p.x[k];
          pair.b[i][k] = level.triangles[t].corner[i].position[k];
        }
      }
      const DistanceInterval interval = triangle_distance(pair).interval;
      least = std::min(least, interval.upper);
      proved = std::min(proved, interval.lower);
    }
    const levels::NearestTriangle found = levels::nearest_triangle(level, p, hint);
    EXPECT_NEAR(std::sqrt(found.square), least, 1e-14);
    const double lower = levels::proved_distance(level, p, hint);
    EXPECT_LE(lower, least);
    EXPECT_GE(lower, proved * (1 - 1e-9) - 1e-14);
  }
}

/// A needle of which float64 computes nothing right but its edges.
TEST(NearestTriangle, OfANeedleIsNearAnEdge) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0x1p-40f, 0}, {0.5f, 0x1p-41f, 0});
  const StoredLevel stored(mesh);
  const levels::Point p = {{0.75, 0, 1}};
  EXPECT_NEAR(levels::nearest_triangle(stored.view(), p, 0).square, 1, 1e-15);
  EXPECT_NEAR(levels::proved_distance(stored.view(), p, 0), 1, 1e-11);
}

}  // namespace
}  // namespace tandem::test
