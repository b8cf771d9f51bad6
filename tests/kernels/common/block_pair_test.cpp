#include "kernels/common/block_pair.h"

#include <gtest/gtest.h>

#include "plain_boxes.h"

#include <limits>

#include "kernels/random_pose.h"

namespace tandem {
namespace {

using test::RandomPoses;
using test::Scale;

Block any_block(RandomPoses& random, const Scale& scale) {
  Block block;
  const int real = static_cast<int>(random.below(4)) + 1;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    Position lo, hi;
    if (i < real)
      set_node(block, i, random.box(scale, lo, hi), 0, NodeKind::leaf);
    else
      set_imaginary(block, i);
  }
  return block;
}

constexpr float kSpecial[] = {0.0f,
                              -0.0f,
                              1e-45f,
                              1.0f,
                              -1.0f,
                              3.4e38f,
                              -3.4e38f,
                              std::numeric_limits<float>::infinity(),
                              -std::numeric_limits<float>::infinity(),
                              std::numeric_limits<float>::quiet_NaN()};

void spoil(RandomPoses& random, float* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (random.below(8) == 0) values[i] = kSpecial[random.below(std::size(kSpecial))];
  }
}

TEST(BlockPair, EveryWayGivesTheSameMask) {
  RandomPoses random(1);
  std::uint64_t hits = 0, ways = 0;
  for (const BlockPairVariant variant : kBlockPairVariants) ways += block_pair_test(variant) != nullptr;
  for (int i = 0; i < 1'000'000; ++i) {
    Scale scale;
    scale.size = random.below(2) == 0 ? 1 : 0.3;
    scale.turn = random.below(4) == 0 ? 0 : 4;
    Block a = any_block(random, scale), b = any_block(random, scale);
    scale.translation = 0.5;
    RelativePose pose;
    ASSERT_EQ(relative_pose(random.pose(scale), extent_of(a), random.pose(scale), extent_of(b), pose),
              RelativePoseStatus::kOk);
    if (i % 4 == 0) {  // what no checked file holds, too
      spoil(random, &a.center[0][0], 24);
      spoil(random, &b.center[0][0], 24);
      spoil(random, &pose.rotation[0][0], sizeof pose / sizeof(float));
    }
    const unsigned expected = block_pair_mask(a, b, pose);
    hits += expected != 0;
    for (const BlockPairVariant variant : kBlockPairVariants) {
      const BlockPairTest test = block_pair_test(variant);
      if (test == nullptr) continue;
      ASSERT_EQ(test(a, b, pose), expected) << static_cast<int>(variant) << " " << i;
    }
    ASSERT_EQ(block_pair_test()(a, b, pose), expected);
  }
  EXPECT_GT(hits, 100'000u);
  RecordProperty("ways", static_cast<int>(ways));
}

TEST(BlockPair, ImaginaryNodesNeverOverlap) {
  RandomPoses random(2);
  for (int i = 0; i < 100'000; ++i) {
    const Block a = any_block(random, {}), b = any_block(random, {});
    RelativePose pose;
    ASSERT_EQ(relative_pose(random.pose({}), extent_of(a), random.pose({}), extent_of(b), pose),
              RelativePoseStatus::kOk);
    const unsigned mask = block_pair_test()(a, b, pose);
    for (int bit = 0; bit < 16; ++bit) {
      if ((mask >> bit & 1) == 0) continue;
      ASSERT_EQ(a.kind[bit / 4], NodeKind::leaf);
      ASSERT_EQ(b.kind[bit % 4], NodeKind::leaf);
    }
  }
}

TEST(BlockPair, BitsStandForTheNodesTheyShould) {
  Block a, b;
  for (int i = 0; i < 4; ++i) {
    const auto at = static_cast<float>(10 * i);
    set_node(a, i, {{at, 0, 0}, {1, 1, 1}}, 0, NodeKind::leaf);
    set_node(b, i, {{30 - at, 0, 0}, {1, 1, 1}}, 0, NodeKind::leaf);
  }
  const RelativePose same = test::without_slack(kIdentityPose.rotation, kIdentityPose.translation);
  for (const BlockPairVariant variant : kBlockPairVariants) {
    const BlockPairTest test = block_pair_test(variant);
    if (test == nullptr) continue;
    EXPECT_EQ(test(a, b, same), 1u << 3 | 1u << 6 | 1u << 9 | 1u << 12);
    Block first = b;
    for (int i = 1; i < 4; ++i) set_imaginary(first, i);  // b's node 0 lies at a's node 3
    EXPECT_EQ(test(a, first, same), 1u << 12);
  }
}

}  // namespace
}  // namespace tandem
