// World boxes of oriented nodes contain every posed vertex, as apply() rounds it.
#include "kernels/geometry/oriented_world_box.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "kernels/random_rotation.h"
#include "kernels/tolerance/sure_verdicts.h"
#include "tandem/formats/oriented_block.h"

namespace tandem::test {
namespace {

/// An oriented block with few vertices below its first node, as bvhbuild would make it.
struct OrientedBody {
  std::vector<std::array<float, 3>> vertices;
  TreeExtent extent;
  OrientedBlock block;  ///< nodes 1 to 3 are imaginary
};

void set_imaginary(OrientedBlock& block, int node) {
  for (int k = 0; k < 3; ++k) {
    block.centre[k][node] = kImaginaryCentre;
    block.half_extent[k][node] = kImaginaryHalfExtent;
  }
}

/// The box of node 0 around the vertices, and a tree that reaches as far as they do.
void enclose_vertices(OrientedBody& body, const BlockRotation& rotation) {
  Position lo, hi;
  for (int k = 0; k < 3; ++k) {
    lo[k] = hi[k] = body.vertices[0][k];
    for (const auto& vertex : body.vertices)
      lo[k] = std::min(lo[k], vertex[k]), hi[k] = std::max(hi[k], vertex[k]);
  }
  Block root;
  set_node(root, 0, enclose(lo, hi), 0, NodeKind::leaf);
  for (int node = 1; node < kNodesPerBlock; ++node) set_imaginary(root, node);
  body.extent = extent_of(root);
  double squared = 0;
  for (const double reach : body.extent.reach) squared += reach * reach;
  const ScaledRotation scaled = scaled_rotation(rotation);
  body.block = {};
  for (int node = 1; node < kNodesPerBlock; ++node) set_imaginary(body.block, node);
  for (int k = 0; k < 3; ++k) {
    double lowest = HUGE_VAL, highest = -HUGE_VAL;
    for (const auto& vertex : body.vertices) {
      const float x[3] = {vertex[0], vertex[1], vertex[2]};
      const double at = along_axis(scaled, k, x);
      lowest = std::min(lowest, at), highest = std::max(highest, at);
    }
    box_along(lowest, highest, std::sqrt(squared), body.block.centre[k][0], body.block.half_extent[k][0]);
  }
  body.block.rotation = rotation;
  body.block.size = oriented_size(body.block);
}

bool contains(const WorldBox& box, const double (&point)[3]) {
  bool inside = true;
  for (int k = 0; k < 3; ++k) inside = inside && box.lo[k] <= point[k] && point[k] <= box.hi[k];
  return inside;
}

BlockRotation any_rotation(RandomPoses& random) {
  return packed(random_quaternion(random));
}

OrientedBody any_body(RandomPoses& random, const Scale& scale) {
  OrientedBody body;
  std::array<double, 3> centre;
  for (double& x : centre) x = random.symmetric(scale.centre);
  for (auto count = 1 + random.below(4); count > 0; --count) {
    auto& vertex = body.vertices.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      vertex[k] = static_cast<float>(centre[k] + (random.below(4) == 0 ? 0 : random.symmetric(scale.size)));
  }
  enclose_vertices(body, any_rotation(random));
  return body;
}

TEST(OrientedWorldBox, ContainsEveryPosedVertexAtAnyDistance) {
  constexpr double kFar[] = {0, 1, 1e4, 1e7, 1e12, 1e52, 1e150, 1e299};
  RandomPoses random(1);
  for (std::uint64_t trial = hundredth_of(30'000'000); trial > 0; --trial) {
    Scale scale = any_scale(random);
    const OrientedBody body = any_body(random, scale);
    scale.translation =
        std::min(kFar[random.below(std::size(kFar))] * (random.below(2) == 0 ? 1 : scale.size), 1e299);
    const Pose pose = random.pose(scale);
    const WorldBox box = node_world_box(pose, body.block, 0, farthest_of(body.extent));
    for (const auto& vertex : body.vertices) {
      double at[3];
      apply(pose, vertex[0], vertex[1], vertex[2], at);
      ASSERT_TRUE(contains(box, at)) << "trial " << trial;
    }
  }
}

/// A box whose corners are vertices, with nothing to spare: frames that turn float32 numbers into such.
TEST(OrientedWorldBox, NeedsItsMarginAndNoMore) {
  constexpr Quaternion kExact[] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {1, 1, 1, 1}, {1, -1, 1, -1}};
  RandomPoses random(2);
  double worst = 0;
  for (std::uint64_t trial = hundredth_of(30'000'000); trial > 0; --trial) {
    const BlockRotation rotation = packed(kExact[random.below(std::size(kExact))]);
    const ScaledRotation scaled = scaled_rotation(rotation);
    OrientedBlock block = {};
    block.rotation = rotation;
    double corner[3], squared = 0;
    for (int k = 0; k < 3; ++k) {
      const double size = std::exp2(random.uniform(-3, 3));
      const double c = std::floor(random.symmetric(0x1p10 * size)), h = std::floor(random.uniform(0, 0x1p10));
      block.centre[k][0] = static_cast<float>(c);
      block.half_extent[k][0] = static_cast<float>(h);
      corner[k] = random.below(2) == 0 ? c - h : c + h;
      squared += (std::fabs(c) + h) * (std::fabs(c) + h);
    }
    double vertex[3];
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += static_cast<double>(scaled.scaled[i][k]) * corner[k];
      vertex[i] = sum / static_cast<double>(scaled.squared_length);  // exact: one of them, with a sign
    }
    const Pose pose = random.pose({1, 1, 0, random.below(2) == 0 ? 1e-7 : 0, 4});
    const double farthest = std::sqrt(squared);
    double at[3];
    apply(pose, vertex[0], vertex[1], vertex[2], at);
    ASSERT_TRUE(contains(node_world_box(pose, block, 0, farthest), at)) << "trial " << trial;
    const WorldBox without = node_world_box(pose, block, 0, 0);
    for (int i = 0; i < 3; ++i) {
      double size = 0;
      for (const double r : pose.rotation[i]) size += std::fabs(r);
      const double outside = std::max(without.lo[i] - at[i], at[i] - without.hi[i]);
      worst = std::max(worst, outside / (0x1p-48 * size * farthest));
    }
  }
  std::printf("largest share of the margin that was needed: %.3f\n", worst);
  EXPECT_GT(worst, 0.01);
  EXPECT_LT(worst, 1);
}

TEST(OrientedWorldBox, TheMaskHasWhatMeetsAndNothingFarApart) {
  RandomPoses random(3);
  for (int trial = 0; trial < 100'000; ++trial) {
    const Scale scale = {1, 1, random.below(2) == 0 ? 1 : 1e52, 0, 4};
    const OrientedBody a = any_body(random, scale);
    OrientedBody b = any_body(random, scale);
    const Pose pose_a = random.pose(scale);
    Pose pose_b = random.pose(scale);
    // A vertex of b comes to lie where one of a is, unless rounding keeps it away.
    double at_a[3], at_b[3];
    apply(pose_a, a.vertices[0][0], a.vertices[0][1], a.vertices[0][2], at_a);
    const double far_a = farthest_of(a.extent), far_b = farthest_of(b.extent);
    for (int k = 0; k < 3; ++k) pose_b.translation[k] = 0;
    apply(pose_b, b.vertices[0][0], b.vertices[0][1], b.vertices[0][2], at_b);
    for (int k = 0; k < 3; ++k) pose_b.translation[k] = at_a[k] - at_b[k];
    apply(pose_b, b.vertices[0][0], b.vertices[0][1], b.vertices[0][2], at_b);
    if (std::equal(at_a, at_a + 3, at_b)) {
      ASSERT_EQ(world_block_pair_mask(pose_a, a.block, far_a, pose_b, b.block, far_b), 1u) << trial;
      ASSERT_EQ(world_block_pair_mask(pose_b, b.block, far_b, pose_a, a.block, far_a), 1u) << trial;
    }
    pose_b.translation[random.below(3)] += scale.translation == 1 ? 20 : 1e53;
    ASSERT_EQ(world_block_pair_mask(pose_a, a.block, far_a, pose_b, b.block, far_b), 0u) << trial;
  }
}

}  // namespace
}  // namespace tandem::test
