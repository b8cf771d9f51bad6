#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernels/contact/contact_query_fixture.h"
#include "tandem/kernels/bodies_at_query.h"

namespace tandem {
namespace {

/// How far a point is inside the box of a body's posed bounds; negative outside.
double depth_in_box(const AssetView& asset, const Pose& pose, const std::array<double, 3>& point) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    double lo = pose.translation[k], hi = lo;
    for (int j = 0; j < 3; ++j) {
      const FileHeader& header = *asset.header;
      const double x = pose.rotation[k][j] * (header.origin[j] + double{header.lower[j]});
      const double y = pose.rotation[k][j] * (header.origin[j] + double{header.upper[j]});
      lo += std::min(x, y);
      hi += std::max(x, y);
    }
    least = std::min({least, point[k] - lo, hi - point[k]});
  }
  return least;
}

TEST(BodiesAt, AreThoseWhoseBoxesContainThePoint) {
  const BodyScene bodies = crowd(5, 80);
  Scene scene;
  ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
  ASSERT_EQ(scene.remove(17), Status::kOk);
  RandomPoses random(1);
  std::array<std::array<double, 3>, 200> points;
  for (auto& point : points) {
    for (double& x : point) x = random.symmetric(4);
  }
  BodiesAtQuery query;
  ASSERT_EQ(query.find(scene, {.points = points}), Status::kOk);
  EXPECT_EQ(query.counters().points, 200u);
  EXPECT_LT(query.counters().boxes, 200u * 80u);
  std::vector<BodyAt> expected;
  for (std::uint32_t p = 0; p < 200; ++p) {
    for (std::uint32_t body = 0; body < 80; ++body) {
      const Instance& instance = bodies.instances[body];
      const double depth = depth_in_box(bodies.assets.views()[instance.asset], instance.pose, points[p]);
      ASSERT_GT(std::abs(depth), 1e-6);
      if (depth > 0 && body != 17) expected.push_back({p, body});
    }
  }
  EXPECT_TRUE(std::ranges::equal(query.rows(), expected));
  EXPECT_GT(expected.size(), 100u);
}

TEST(BodiesAt, BordersCountAndWhatIsNoPointIsNamed) {
  const BodyScene cubes = row_of_cubes(2);  // from -0.5 to 0.5, and to 1.5
  Scene scene;
  ASSERT_EQ(scene.set_assets(cubes.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(cubes.instances), Status::kOk);
  BodiesAtQuery query;
  const std::array<double, 3> points[] = {{0.5, 0.5, -0.5}, {0.25, 0, 0}, {1.25, 0, 0.75}};
  ASSERT_EQ(query.find(scene, {.points = points}), Status::kOk);
  EXPECT_TRUE(std::ranges::equal(query.rows(), std::vector<BodyAt>{{0, 0}, {0, 1}, {1, 0}}));
  const std::array<double, 3> wrong[] = {{0, 0, 0}, {0, std::nan(""), 0}};
  EXPECT_EQ(query.find(scene, {.points = wrong}), Status::kOutOfRange);
  EXPECT_EQ(scene.where(), 1u);
  EXPECT_TRUE(query.rows().empty());
  ASSERT_EQ(query.find(scene, {}), Status::kOk);
  EXPECT_TRUE(query.rows().empty());
}

}  // namespace
}  // namespace tandem
