#include "tandem/formats/block.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

#include "kernels/common/plain_boxes.h"
#include "kernels/geometry/box_test.h"
#include "tandem/formats/box.h"

namespace tandem {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kLargest = std::numeric_limits<float>::max();

// Everything that arithmetic can trip over.
const std::vector<float> kSpecial = {0.0f,     -0.0f,     1e-45f, -1e-45f,   1.0f,       -1.0f, 0.5f,
                                     kLargest, -kLargest, 3e38f,  kInfinity, -kInfinity, kNan};

Box imaginary_box() {
  Block block{};
  set_imaginary(block, 2);
  return box_of(block, 2);
}

float pick(std::mt19937_64& random) {
  if (random() % 4 == 0) return std::uniform_real_distribution<float>(-10, 10)(random);
  return kSpecial[random() % kSpecial.size()];
}

Box any_box(std::mt19937_64& random) {
  if (random() % 8 == 0) return imaginary_box();
  Box box;
  for (int k = 0; k < 3; ++k) {
    box.center[k] = pick(random);
    box.half_extent[k] = pick(random);
  }
  return box;
}

RelativePose any_pose(std::mt19937_64& random) {
  RelativePose pose;
  const bool axis_aligned = random() % 3 == 0;  // zeros in the rotation: 0 * infinity
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      pose.rotation[i][j] = axis_aligned ? static_cast<float>(i == j) : pick(random);
    for (int j = 0; j < 3; ++j) pose.abs_rotation[i][j] = std::fabs(pose.rotation[i][j]);
    pose.translation[i] = pick(random);
    pose.slack_a[i] = random() % 2 == 0 ? 0 : pick(random);
    pose.slack_b[i] = random() % 2 == 0 ? 0 : pick(random);
  }
  return pose;
}

TEST(ImaginaryNode, IsRejectedByEveryBoxTestAgainstEveryOtherBox) {
  std::mt19937_64 random(2);
  const Box imaginary = imaginary_box();
  for (int i = 0; i < 500000; ++i) {
    const Box other = any_box(random);
    const RelativePose pose = any_pose(random);
    ASSERT_FALSE(overlap_6_axes(imaginary, other, pose)) << i;
    ASSERT_FALSE(overlap_6_axes(other, imaginary, pose)) << i;
    ASSERT_FALSE(overlap_15_axes(imaginary, other, pose)) << i;
    ASSERT_FALSE(overlap_15_axes(other, imaginary, pose)) << i;
    ASSERT_FALSE(test::overlap_aligned(imaginary, other)) << i;
    ASSERT_FALSE(test::overlap_aligned(other, imaginary)) << i;
  }
}

TEST(ImaginaryNode, IsRejectedOnEachAxisAlone) {
  std::mt19937_64 random(3);
  const Box imaginary = imaginary_box();
  for (int i = 0; i < 200000; ++i) {
    const Box other = any_box(random);
    const RelativePose pose = any_pose(random);
    const auto there = detail::distance(imaginary, other, pose),
               back = detail::distance(other, imaginary, pose);
    ASSERT_FALSE(detail::overlap_on_face_axes(there, pose)) << i;
    ASSERT_FALSE(detail::overlap_on_face_axes(back, pose)) << i;
    ASSERT_FALSE(detail::overlap_on_edge_axes(there, pose)) << i;
    ASSERT_FALSE(detail::overlap_on_edge_axes(back, pose)) << i;
  }
}

TEST(ImaginaryNode, IsTheNeutralElementOfAUnion) {
  const Box box = imaginary_box();
  EXPECT_EQ(std::min(1.0f, box.center[0] - box.half_extent[0]), 1.0f);
  EXPECT_EQ(std::max(-1.0f, box.center[0] + box.half_extent[0]), -1.0f);
}

// The tests above would pass if nothing ever overlapped.
TEST(BoxTest, RealBoxesThatTouchOverlap) {
  const Box unit = {{0, 0, 0}, {1, 1, 1}}, beside = {{2, 0, 0}, {1, 1, 1}}, apart = {{2.5f, 0, 0}, {1, 1, 1}};
  const RelativePose same = test::without_slack(kIdentityPose.rotation, kIdentityPose.translation);
  EXPECT_TRUE(overlap_15_axes(unit, beside, same));
  EXPECT_TRUE(test::overlap_aligned(unit, beside));
  EXPECT_FALSE(overlap_15_axes(unit, apart, same));
  EXPECT_FALSE(test::overlap_aligned(unit, apart));
}

// Two long rods crossing at a right angle, rolled by 45 degrees: only the cross product of their edges
// separates them.
TEST(BoxTest, EdgeAxesSeparateWhatFacesDoNot) {
  const double s = std::sqrt(0.5);
  const Box rod = {{0, 0, 0}, {10, 1, 1}};
  // b's axes in a's frame: turned by 45 degrees about x for both, then across.
  const RelativePose crossed =
      test::without_slack({{0, s, -s}, {s, 0.5, 0.5}, {-s, 0.5, 0.5}}, {0, 2.1, 2.1});
  EXPECT_TRUE(overlap_6_axes(rod, rod, crossed));
  EXPECT_FALSE(overlap_15_axes(rod, rod, crossed));
}

TEST(ImaginaryMinimum, IsTheBruteForceMinimumOverAllTrees) {
  // least[n]: fewest blocks of a pure tree over n leaves, by trying all ways to fill a block.
  constexpr int kLargestTree = 200;
  constexpr int kNever = 1 << 20;
  std::vector<int> least(kLargestTree + 1, kNever);
  for (int n = 1; n <= kLargestTree; ++n) {
    if (n <= 4) least[n] = 1;
    std::vector<std::vector<int>> ways(5, std::vector<int>(n + 1, kNever));
    ways[0][0] = 0;
    for (int slot = 1; slot <= 4; ++slot) {
      for (int sum = 0; sum <= n; ++sum) {
        ways[slot][sum] = ways[slot - 1][sum];  // an imaginary node
        for (int child = 1; child <= sum && child < n; ++child) {
          ways[slot][sum] = std::min(ways[slot][sum], ways[slot - 1][sum - child] + least[child]);
        }
      }
    }
    least[n] = std::min(least[n], 1 + ways[4][n]);
    const int imaginary = 4 * least[n] - n - (least[n] - 1);
    EXPECT_EQ(minimal_imaginary_nodes(n), imaginary) << n;
  }
}

}  // namespace
}  // namespace tandem
