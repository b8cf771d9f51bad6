// Oriented nodes that are dropped for lying beyond the plane of a leaf's triangle do so, in exact arithmetic.
#include "tandem/kernels/detail/oriented_planes.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "oriented_body.h"
#include "sure_verdicts.h"

namespace tandem {
namespace {

using test::any_scale;
using test::Direction;
using test::OrientedBody;
using test::Point;
using test::RandomPoses;
using test::Real;
using test::Scale;

std::vector<Point> posed(const Pose& pose, const OrientedBody& body) {
  std::vector<Point> out(body.vertices.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    apply(pose, body.vertices[i][0], body.vertices[i][1], body.vertices[i][2], out[i].data());
  return out;
}

Direction normal_of(const std::vector<Point>& triangle) {
  Direction u, v;
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = static_cast<Real>(triangle[1][k]) - triangle[0][k];
    v[k] = static_cast<Real>(triangle[2][k]) - triangle[0][k];
  }
  return test::cross(u, v);
}

struct Trial {
  OrientedBody leaf, other;  // the vertices of `leaf` are a triangle
  Pose pose_leaf, pose_other;
  float slack;
};

/// The corners of a leaf's triangle far from each other, the others' vertices within a small box.
void make_bodies(RandomPoses& random, const Scale& scale, Trial& trial) {
  for (OrientedBody* body : {&trial.leaf, &trial.other}) {
    const double size = body == &trial.leaf ? scale.size : scale.size * std::exp2(-random.uniform(0, 10));
    std::array<double, 3> center;
    for (double& x : center) x = random.symmetric(scale.center);
    body->vertices.resize(body == &trial.leaf ? 3 : 1 + random.below(5));
    for (auto& vertex : body->vertices) {
      for (std::size_t k = 0; k < 3; ++k) vertex[k] = static_cast<float>(center[k] + random.symmetric(size));
    }
    enclose_vertices(*body, test::packed(test::random_quaternion(random)));
  }
  trial.leaf.block.first_below = OrientedBlock::kIsLeafBlock;
  trial.pose_leaf = random.pose(scale);
  trial.pose_other = random.pose(scale);
}

/// Moves the other body so that the nearest of its vertices is `gap` away from the plane.
void place(Trial& trial, Real gap) {
  const std::vector<Point> triangle = posed(trial.pose_leaf, trial.leaf);
  Direction normal = normal_of(triangle);
  const Real length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
  Real nearest = HUGE_VALL;
  for (const Point& p : posed(trial.pose_other, trial.other)) {
    Real at = 0;
    for (std::size_t k = 0; k < 3; ++k) at += normal[k] / length * (static_cast<Real>(p[k]) - triangle[0][k]);
    nearest = std::min(nearest, at);
  }
  for (std::size_t k = 0; k < 3; ++k)
    trial.pose_other.translation[k] += static_cast<double>((gap - nearest) * normal[k] / length);
}

/// Whether the node of the other body is dropped; leaf_first: the leaf is body a.
bool dropped(Trial& trial, bool leaf_first) {
  const OrientedBody &a = leaf_first ? trial.leaf : trial.other, &b = leaf_first ? trial.other : trial.leaf;
  const Pose &pose_a = leaf_first ? trial.pose_leaf : trial.pose_other,
             &pose_b = leaf_first ? trial.pose_other : trial.pose_leaf;
  RelativePose b_in_a;
  if (relative_pose(pose_a, a.extent, pose_b, b.extent, b_in_a) != RelativePoseStatus::kOk) return false;
  trial.slack = oriented_slack(b_in_a, a.extent, b.extent);
  Triangle triangle = {};
  for (int c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < 3; ++k)
      triangle.corner[c].position[k] = trial.leaf.vertices[static_cast<std::size_t>(c)][k];
  }
  return drop_beyond_planes(a.block, b.block, 1u, &triangle, &triangle, b_in_a,
                            frame_error(b_in_a, a.extent, b.extent), trial.slack) == 0;
}

/// Strictly on one side of the plane: products of differences of float64 points, each off by little.
bool surely_on_one_side(const Trial& trial) {
  const std::vector<Point> triangle = posed(trial.pose_leaf, trial.leaf);
  return test::plane_separates(posed(trial.pose_other, trial.other), triangle, normal_of(triangle));
}

TEST(OrientedPlanes, DropOnlyWhatLiesBeyond) {
  RandomPoses random(1);
  std::uint64_t made = 0, drops[2] = {};
  const std::uint64_t count = test::hundredth_of(30'000'000);
  for (std::uint64_t i = 0; i < count; ++i) {
    Trial trial;
    Scale scale = any_scale(random);
    if (scale.size > 0x1p20 || scale.size < 0x1p-20) scale.size = scale.center = scale.translation = 1;
    make_bodies(random, scale, trial);
    const bool leaf_first = random.below(2) == 0;
    place(trial, 0);
    if (trial.leaf.vertices[0] == trial.leaf.vertices[1] || !std::isfinite(trial.pose_other.translation[0]))
      continue;
    dropped(trial, leaf_first);  // tells the slack
    place(trial, trial.slack * random.uniform(-1, 4) * (random.below(2) == 0 ? 1 : 1000));
    ++made;
    if (!dropped(trial, leaf_first)) continue;
    ++drops[leaf_first];
    ASSERT_TRUE(surely_on_one_side(trial)) << "trial " << i;
  }
  std::printf("%llu trials, dropped %llu of b and %llu of a\n", static_cast<unsigned long long>(made),
              static_cast<unsigned long long>(drops[1]), static_cast<unsigned long long>(drops[0]));
  EXPECT_GT(made, count / 2);
  EXPECT_GT(drops[0], made / 20);
  EXPECT_GT(drops[1], made / 20);
}

TEST(OrientedPlanes, DropNothingWhereTheStageDecidesNothing) {
  RandomPoses random(2);
  Trial trial;
  make_bodies(random, {1, 1, 1, 0, 4}, trial);
  place(trial, 1);
  ASSERT_TRUE(dropped(trial, true));
  for (auto& vertex : trial.leaf.vertices) vertex[0] += 0x1p29f;  // beyond kLargestInFrame / 4
  enclose_vertices(trial.leaf, kNoRotation);
  trial.leaf.block.first_below = OrientedBlock::kIsLeafBlock;
  place(trial, 1);
  EXPECT_FALSE(dropped(trial, true));
}

}  // namespace
}  // namespace tandem
