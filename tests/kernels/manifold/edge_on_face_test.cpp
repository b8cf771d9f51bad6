#include <cmath>

#include "manifold_scene.h"

/// Manifolds of bodies of which one has an edge along a face of the other, or lies in a corner of it.
namespace tandem::test {
namespace {

// A plate that leans on an edge of another one, and is turned a little along the edge: the two ends of the
// edge are not equally deep, and each has a point.
TEST(EdgeOnFace, BothEndsOfTheEdgeHaveAPointOfTheirDepth) {
  constexpr double kLean = 8.4 * kDegree, kDepth = 2e-3;
  constexpr float kThick = 0.02f, kSide = 0.5f;
  RandomPoses random(1);
  ManifoldScene scene;
  const std::uint32_t plate = scene.add_shape(box(kSide, kSide, kThick));
  scene.add_body(plate, shift(0, -kSide / 2, -kThick / 2));  // its edge is the x axis
  scene.add_body(plate, kIdentityPose);
  for (int trial = 0; trial < trials(100, 20); ++trial) {
    const double turned = (trial % 2 == 0 ? 1 : -1) * random.uniform(1e-5, 1e-3);
    const Pose lying = after(turn(1, turned), turn(0, -kLean));
    const Vector3 down = rotate(lying, {0, 0, -1});
    const Vector3 middle = rotate(lying, {random.uniform(0.02, 0.1), random.symmetric(0.1), kThick / 2});
    const Vector3 at = middle + kDepth * down;
    scene.bodies[1].pose = after(shift(at.x, at.y, at.z), lying);
    const Pose motion = any_motion(random, 3);
    scene.find(motion);
    ASSERT_EQ(scene.manifolds().size(), 1u);
    EXPECT_LT(angle_between(vector_of(scene.manifolds()[0].normal), rotate(motion, Vector3{} - down)),
              0.1 * kDegree);
    for (const double end : {at.x - kSide / 2, 0.5 * kSide}) {
      const Vector3 place = apply(motion, {end, 0, 0});
      const double depth = kDepth + dot(down, Vector3{-end, 0, 0});
      double nearest = 0.02;
      for (const ManifoldPoint& point : scene.points())
        nearest = std::fabs(point.depth - depth) < 0.03 * depth
                      ? std::min(nearest, norm(vector_of(point.position) - place))
                      : nearest;
      EXPECT_LT(nearest, 0.01) << "end at " << end << ", turned by " << turned;
    }
  }
}

// A box lies on the ground of a cup, and an edge of it, or only its lower end, cuts into the wall a little.
// Neither away from the ground nor away from the wall does it come free soon, but between the two.
TEST(BoxInCorner, IsPushedAwayFromBothFaces) {
  constexpr int kSectors = 32;
  constexpr float kSide = 0.25f, kWall = 0.1f;
  constexpr double kDepth = 5e-3, kHalfTurn = 180 * kDegree;
  RandomPoses random(2);
  ManifoldScene scene;
  scene.add_body(scene.add_shape(cup(kSectors, 1, 2, kWall)), kIdentityPose);
  scene.add_body(scene.add_shape(box(kSide, kSide, kSide)), kIdentityPose);
  for (int trial = 0; trial < trials(100, 20); ++trial) {
    const double towards = (2 * static_cast<double>(random.below(kSectors)) + 1) * kHalfTurn / kSectors;
    const double beside = random.symmetric(0.15), cuts = random.uniform(1e-5, 1e-3);
    const double leans = trial % 2 == 0 ? 0 : random.uniform(0, 0.02);
    // The edge lies on the diagonal, half a turn's eighth from the sides.
    const double to_edge = std::sqrt(0.5) * kSide * std::cos(beside);
    const double from_axis = 0.9 * std::cos(kHalfTurn / kSectors) - to_edge + cuts;
    // It leans away from the wall about its lower end.
    const Pose leaning =
        after(after(shift(to_edge, 0, -0.5 * kSide), turn(1, -leans)), shift(-to_edge, 0, 0.5 * kSide));
    const Pose beside_wall = after(shift(from_axis, 0, kWall + 0.5 * kSide - kDepth), leaning);
    scene.bodies[1].pose = after(after(turn(2, towards), beside_wall), turn(2, kHalfTurn / 4 + beside));
    const Pose motion = any_motion(random, 3);
    scene.find(motion);
    ASSERT_EQ(scene.manifolds().size(), 1u);
    const Manifold& manifold = scene.manifolds()[0];
    EXPECT_LT(manifold.depth, 3 * kDepth) << "cuts by " << cuts << ", turned by " << beside;
    EXPECT_GT(manifold.depth, 0.99 * kDepth);
    EXPECT_LT(angle_between(vector_of(manifold.normal), rotate(motion, {0, 0, 1})), 60 * kDegree);
  }
}

}  // namespace
}  // namespace tandem::test
