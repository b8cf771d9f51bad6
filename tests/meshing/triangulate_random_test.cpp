#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "bvhbuild/meshing/meshing.h"
#include "polygons.h"

namespace tandem::build {
namespace {

int sign(std::int64_t x) {
  return (x > 0) - (x < 0);
}

bool within(const GridPoint& a, const GridPoint& b, const GridPoint& p) {
  return std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) && std::min(a.y, b.y) <= p.y &&
         p.y <= std::max(a.y, b.y);
}

/// Whether the closed segments ab and cd meet.
bool meet(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d) {
  const int abc = sign(twice_area(a, b, c));
  const int abd = sign(twice_area(a, b, d));
  const int cda = sign(twice_area(c, d, a));
  const int cdb = sign(twice_area(c, d, b));
  if (abc * abd < 0 && cda * cdb < 0) return true;
  return (abc == 0 && within(a, b, c)) || (abd == 0 && within(a, b, d)) || (cda == 0 && within(c, d, a)) ||
         (cdb == 0 && within(c, d, b));
}

/// The first two edges that cross or touch where they should not; {0, 0} in a simple polygon.
std::array<std::size_t, 2> first_crossing(const GridPolygon& p) {
  const std::size_t n = p.size();
  for (std::size_t i = 0; i < n; ++i) {
    const GridPoint& a = p[i];
    const GridPoint& b = p[(i + 1) % n];
    if (twice_area(a, b, p[(i + 2) % n]) == 0 && !within(a, p[(i + 2) % n], b)) return {i, (i + 1) % n};
    for (std::size_t j = i + 2; j < n; ++j)
      if ((j + 1) % n != i && meet(a, b, p[j], p[(j + 1) % n])) return {i, j};
  }
  return {0, 0};
}

/// Random points joined at random, then untangled by reversing the stretch between two crossing edges. Empty
/// when that does not end soon.
GridPolygon random_polygon(std::mt19937& random, std::size_t corners, int grid) {
  std::uniform_int_distribution<int> coordinate(0, grid);
  GridPolygon polygon;
  while (polygon.size() < corners) {
    const GridPoint p{coordinate(random), coordinate(random)};
    if (std::find(polygon.begin(), polygon.end(), p) == polygon.end()) polygon.push_back(p);
  }
  for (int attempt = 0; attempt < 300; ++attempt) {
    auto [i, j] = first_crossing(polygon);
    if (i == j) return polygon;
    if (i > j) std::swap(i, j);
    std::reverse(polygon.begin() + static_cast<std::ptrdiff_t>(i + 1),
                 polygon.begin() + static_cast<std::ptrdiff_t>(j + 1));
    if (j == i + 1) std::swap(polygon[i], polygon[(j + 1) % corners]);
  }
  return {};
}

/// The polygon in a steep plane through integer points: still exact, and x, y and z take turns as the main
/// axis.
PolygonMesh tilted_face(const GridPolygon& polygon, std::int64_t a, std::int64_t b) {
  PolygonMesh mesh = flat_face(polygon);
  for (std::size_t i = 0; i < polygon.size(); ++i)
    mesh.points[i][2] = static_cast<double>(a * polygon[i].x + b * polygon[i].y);
  return mesh;
}

int expect_random_polygons_tiled(std::uint32_t seed, int count, std::size_t most_corners, int grid) {
  std::mt19937 random(seed);
  int tested = 0;
  for (int i = 0; i < count; ++i) {
    const std::size_t corners = 4 + random() % (most_corners - 3);
    const GridPolygon polygon = random_polygon(random, corners, grid);
    if (polygon.empty() || twice_area(polygon) == 0) continue;
    const auto a = static_cast<std::int64_t>(random() % 7) - 3;
    const auto b = static_cast<std::int64_t>(random() % 7) - 3;
    PolygonMesh mesh = tilted_face(polygon, a, b);
    CleanReport report;
    const TriangleMesh result = triangulate(mesh, report);
    EXPECT_EQ(result.triangles.size(), corners - 2) << "seed " << seed << " polygon " << i;
    EXPECT_TRUE(tiles(result.triangles, polygon)) << "seed " << seed << " polygon " << i;
    EXPECT_EQ(report.faces_not_simple, 0u);
    ++tested;
    if (::testing::Test::HasFailure()) break;
  }
  return tested;
}

TEST(TriangulateRandom, TilesSimplePolygons) {
  EXPECT_GT(expect_random_polygons_tiled(1, 3000, 40, 1000), 2000);
}

TEST(TriangulateRandom, TilesSimplePolygonsWithManyAlignedCorners) {
  EXPECT_GT(expect_random_polygons_tiled(2, 6000, 14, 6), 2000);
}

TEST(TriangulateRandom, TilesSimpleQuads) {
  EXPECT_GT(expect_random_polygons_tiled(3, 5000, 4, 4), 2000);
}

}  // namespace
}  // namespace tandem::build
