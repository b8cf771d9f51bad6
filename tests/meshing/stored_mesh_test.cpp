#include "bvhbuild/meshing/meshing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tandem/formats/box.h"

namespace tandem::build {
namespace {

TriangleMesh strip(std::vector<Point> points) {
  TriangleMesh mesh;
  mesh.points = std::move(points);
  for (std::uint32_t i = 2; i < mesh.points.size(); ++i) {
    mesh.triangles.push_back({i - 2, i - 1, i});
    mesh.face.push_back(i - 2);
  }
  return mesh;
}

StoredMesh stored(TriangleMesh mesh) {
  CleanReport report;
  return to_single_precision(mesh, report);
}

std::vector<Point> random_points(std::uint32_t seed, const Point& centre, const Point& half,
                                 int count = 300) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Point> points(count);
  for (Point& p : points)
    for (int k = 0; k < 3; ++k) p[k] = centre[k] + half[k] * unit(random);
  return points;
}

/// The largest |origin + point - vertex|, in long double: 64 bits hold these sums well enough to compare
/// with.
double slow_largest_error(const std::vector<Point>& points, const StoredMesh& mesh) {
  long double largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const long double stored_at = static_cast<long double>(mesh.origin[k]) + mesh.points[i][k];
      largest = std::max(largest, std::abs(stored_at - points[i][k]));
    }
  return static_cast<double>(largest);
}

TEST(ToSinglePrecision, KeepsOriginZeroForFloat32CoordinatesHoweverFar) {
  std::vector<Point> points = random_points(1, {1e7, -2e7, 3e7}, {10, 10, 10});
  for (Point& p : points)
    for (double& x : p) x = static_cast<float>(x);
  const StoredMesh mesh = stored(strip(points));
  EXPECT_EQ(mesh.origin, (Point{0, 0, 0}));
  EXPECT_EQ(mesh.largest_rounding_error, 0);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int k = 0; k < 3; ++k) EXPECT_EQ(double{mesh.points[i][k]}, points[i][k]);
}

TEST(ToSinglePrecision, KeepsOriginZeroNearZero) {
  EXPECT_EQ(stored(strip(random_points(2, {0.3, 0, -0.9}, {1, 1, 1}))).origin, (Point{0, 0, 0}));
  // The third axis is short and lies aside, but no further than the longest axis reaches.
  EXPECT_EQ(stored(strip(random_points(3, {0, 0, 0.8}, {1, 1, 0.001}))).origin, (Point{0, 0, 0}));
}

TEST(ToSinglePrecision, MovesOnlyTheAxesThatLieFarOut) {
  const StoredMesh mesh = stored(strip(random_points(4, {500000.1, 4000000.2, 3.3}, {100, 100, 5})));
  EXPECT_NEAR(mesh.origin[0], 500000, 10);
  EXPECT_NEAR(mesh.origin[1], 4000000, 10);
  EXPECT_EQ(mesh.origin[2], 0);
}

TEST(ToSinglePrecision, KeepsTheDetailOfMapCoordinates) {
  const std::vector<Point> points = random_points(5, {432187.53, 5811430.07, 34.2}, {250, 250, 20});
  const StoredMesh mesh = stored(strip(points));
  // Half a last bit of a float32 number of the size of the half extent (and of the height, which stays where
  // it is).
  const double half_last_bit = (std::nextafter(256.0f, 512.0f) - 256.0) / 2;
  EXPECT_LE(mesh.largest_rounding_error, half_last_bit * 1.00001);
  EXPECT_GT(mesh.largest_rounding_error, 0);
}

TEST(ToSinglePrecision, ReportsTheLargestRoundingError) {
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    const double far = std::ldexp(1.0, static_cast<int>(seed));
    const std::vector<Point> points = random_points(seed, {far, -3 * far, 0.1 * far}, {7, 0.1, 3});
    const StoredMesh mesh = stored(strip(points));
    const double expected = slow_largest_error(points, mesh);
    EXPECT_NEAR(mesh.largest_rounding_error, expected, 1e-6 * expected) << seed;
  }
}

TEST(ToSinglePrecision, SubtractsTheOriginExactlyFromBinaryFractions) {
  // Multiples of 1/1024 around 40 million: too long for float32, but short once the origin is gone.
  std::vector<Point> points = random_points(6, {40e6, 41e6, 42e6}, {7, 7, 7});
  for (Point& p : points)
    for (double& x : p) x = std::nearbyint(x * 1024) / 1024;
  const StoredMesh mesh = stored(strip(points));
  EXPECT_NE(mesh.origin[0], 0);
  EXPECT_EQ(mesh.largest_rounding_error, 0);
}

TEST(ToSinglePrecision, PutsTheOriginOnACoarseGrid) {
  const StoredMesh mesh = stored(strip(random_points(7, {123456.789, 0, 0}, {3, 1, 1})));
  EXPECT_EQ(mesh.origin[0], std::nearbyint(mesh.origin[0] * 8) / 8);
}

TEST(ToSinglePrecision, MovesToTheCentreWhenTheBoxIsAFewLastBitsWide) {
  const double next = std::nextafter(1e9, 2e9);
  const StoredMesh mesh = stored(strip({{1e9, 1, 0}, {next, 1, 0}, {next, 1, 1e-7}}));
  EXPECT_LE(mesh.largest_rounding_error, 1e-14);
}

TEST(ToSinglePrecision, DoesNotOverflow) {
  const double huge = double{kMaxCoordinate};
  const double below = std::nextafter(huge, 0);
  for (const std::vector<Point>& points :
       {std::vector<Point>{{huge, -huge, below}, {-huge, huge, 0}, {below, 0.1, huge}},
        std::vector<Point>{{huge, -huge, below}, {0.9 * huge, -0.8 * huge, huge}, {below, -0.9 * huge, huge}},
        std::vector<Point>{{huge, 1, 2}, {below, 3, 1}, {0.4 * huge, 2, 2}}}) {
    const StoredMesh mesh = stored(strip(points));
    for (const auto& p : mesh.points)
      for (const float x : p) EXPECT_TRUE(std::isfinite(x) && std::abs(x) <= kMaxCoordinate);
  }
}

TEST(ToSinglePrecision, CountsTrianglesThatOnlyTheRoundingMakesFlatAndKeepsThem) {
  CleanReport report;
  TriangleMesh mesh = strip({{0, 0, 0}, {1, 0.1, 0}, {2, 0.2 + 1e-12, 0}, {3, 5, 0}});
  const StoredMesh result = to_single_precision(mesh, report);
  EXPECT_EQ(result.triangles.size(), 2u);
  EXPECT_EQ(report.triangles_flattened, 1u);
  EXPECT_TRUE(mesh.points.empty());
  EXPECT_TRUE(mesh.triangles.empty());
}

TEST(ToSinglePrecision, TakesAnEmptyMesh) {
  const StoredMesh mesh = stored({});
  EXPECT_EQ(mesh.origin, (Point{0, 0, 0}));
  EXPECT_TRUE(mesh.points.empty());
}

}  // namespace
}  // namespace tandem::build
