#include "levels/nearest_triangle.h"

#include <gtest/gtest.h>

#include <random>

#include "kernels/geometry/triangle_distance.h"
#include "levels/stored_level.h"

namespace tandem {
namespace {

/// Asked for with every triangle as the hint in turn, the search finds what trying all triangles finds.
TEST(NearestTriangle, IsTheNearestOfAll) {
  const test::StoredLevel stored(test::random_mesh(300, 7));
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
  test::Mesh mesh;
  mesh.add({0, 0, 0}, {1, 0x1p-40f, 0}, {0.5f, 0x1p-41f, 0});
  const test::StoredLevel stored(mesh);
  const levels::Point p = {{0.75, 0, 1}};
  EXPECT_NEAR(levels::nearest_triangle(stored.view(), p, 0).square, 1, 1e-15);
  EXPECT_NEAR(levels::proved_distance(stored.view(), p, 0), 1, 1e-11);
}

}  // namespace
}  // namespace tandem
