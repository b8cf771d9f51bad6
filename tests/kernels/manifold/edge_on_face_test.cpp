#include <cmath>

#include "manifold_scene.h"

/// Manifolds of bodies of which one has an edge along a face of the other.
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

}  // namespace
}  // namespace tandem::test
