// Surfaces whose Hausdorff distance is known.
#include "levels/hausdorff.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/solid_meshes.h"
#include "levels/stored_level.h"
#include "parallel/parallel.h"

namespace tandem {
namespace {

using test::joined;
using test::Mesh;
using test::moved;
using test::StoredLevel;

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
  expect_distance(test::sheet(4, 3), moved(test::sheet(4, 5), 0, 0, 0.25f), 0.25);
}

TEST(Hausdorff, OfASheetInALargerOneIsThatOfTheCorners) {
  expect_distance(test::sheet(4, 3), test::sheet(2, 7), std::sqrt(2.0));
}

TEST(Hausdorff, OfATentOverASheetIsItsHeight) {
  Mesh tent;
  tent.add({-1, -1, 0}, {1, -1, 0}, {0, 0, 0.5f});
  tent.add({1, -1, 0}, {1, 1, 0}, {0, 0, 0.5f});
  tent.add({1, 1, 0}, {-1, 1, 0}, {0, 0, 0.5f});
  tent.add({-1, 1, 0}, {-1, -1, 0}, {0, 0, 0.5f});
  expect_distance(tent, test::sheet(2, 6), 0.5);
}

TEST(Hausdorff, OfASpikeIsItsLength) {
  const Mesh spike = triangle({0.1f, 0, 0}, {0.11f, 0, 0}, {0.105f, 0, 30});
  expect_distance(joined(test::sheet(2, 6), spike), test::sheet(2, 6), 30);
}

/// No corner of any triangle is far from the other surface.
TEST(Hausdorff, IsFoundWithinFacesBetweenTwoSurfaces) {
  const float w = 0.125f;
  const auto strip = [&](float z) { return rectangle({-2, -w, z}, {2, -w, z}, {2, w, z}, {-2, w, z}); };
  const Mesh wall = rectangle({-2, 0, -1}, {2, 0, -1}, {2, 0, 1}, {-2, 0, 1});
  expect_distance(wall, joined(strip(-1), strip(1)), 1);
}

TEST(Hausdorff, IsFoundWhereManySurfacesAreEquallyNear) {
  const Mesh cube = test::box(2, 2, 2);
  expect_distance(joined(cube, test::sheet(2, 1)), cube, 1);
  expect_distance(joined(cube, scaled(test::sheet(2, 1), 0.9f)), cube, 1);
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
    const Mesh a = scaled(test::sheet(2, 3), factor), b = scaled(test::sheet(2, 16), factor);
    const HausdorffBound found = bound(a, b);
    EXPECT_LE(found.upper, 0x1p-23 * factor);
    EXPECT_LT(found.lower, found.upper);
    EXPECT_TRUE(found.narrow);
    EXPECT_LT(found.pieces, 10'000u);
  }
}

TEST(Hausdorff, OfASurfaceFromItselfIsNearlyNothing) {
  const Mesh mesh = joined(test::random_mesh(500, 3), test::sphere(2, 3));
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
  const Mesh coarse = test::sphere(1, 0), fine = test::sphere(1, 5);
  const HausdorffBound found = bound(coarse, fine);
  const double height = 1 - 1 / std::sqrt(3.0);  // of the octahedron
  EXPECT_LE(found.lower, height * (1 + 1e-6));
  EXPECT_NEAR(found.upper, height, 0.005);
}

/// Scaling by powers of two rounds nothing, down to denormal coordinates and up to the largest. Boxes are
/// rounded where coordinates are single steps of denormal numbers.
TEST(Hausdorff, ScalesWithItsSurfaces) {
  const Mesh a = scaled(test::sphere(1000, 2), 1), b = scaled(test::sphere(1000, 1), 1);
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
  expect_distance(moved(test::sheet(64, 4), far, far, far), moved(test::sheet(64, 8), far, far, far + 3), 3);
}

TEST(Hausdorff, IsTheSameWithoutTopology) {
  const StoredLevel a(test::sphere(1, 3)), b(test::sphere(1, 2));
  const HausdorffBound with = hausdorff_bound(a.view(), b.view());
  const HausdorffBound without = hausdorff_bound(a.triangles_only(), b.triangles_only());
  EXPECT_LE(without.lower, with.upper);
  EXPECT_LE(with.lower, without.upper);
  EXPECT_LE(without.upper, without.lower * 1.0021);
}

TEST(Hausdorff, DoesNotDependOnThreads) {
  const StoredLevel a(joined(test::sphere(1, 5), test::sphere(0.97, 4))), b(test::sphere(1, 3));
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
  const Mesh coarse = test::sphere(1, 0), fine = test::sphere(1, 4);
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

/// Cubes of a grid whose coordinates are rounded, so that boxes of different trees end differently.
Mesh cubes_of_a_grid(float step, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Mesh mesh;
  for (int i = 0; i < 12; ++i) {
    float place[3];
    for (float& x : place) x = static_cast<float>(random() % 9) * step;
    mesh = joined(mesh, moved(test::box(step, step, step), place[0], place[1], place[2]));
  }
  return mesh;
}

/// The same surface where all triangles lie in planes of two axes and have edges along both.
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
  const StoredLevel coarse(test::sphere(1, 1)), fine(test::sphere(1, 5));
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

}  // namespace
}  // namespace tandem
