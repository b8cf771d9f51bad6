#include "bvhbuild/tree/legal_splits.h"

#include <gtest/gtest.h>

namespace tandem::build {
namespace {

TEST(LegalSplits, ThereIsAlwaysOneForTwoLeafBlocksAndTwoSlots) {
  for (std::uint32_t n = 5; n <= 3000; ++n) {
    for (std::uint32_t slots = 2; slots <= 4; ++slots) {
      const LegalSplits splits(n, slots);
      bool found = false;
      for (std::uint32_t left = 1; left < n && !found; ++left) found = splits.left_slots(left) != 0;
      EXPECT_TRUE(found) << n << " triangles in " << slots << " slots";
    }
  }
}

TEST(LegalSplits, LieDenselyAroundTheMiddle) {
  for (std::uint32_t n = 100; n <= 3000; ++n) {
    const LegalSplits splits(n, 4);
    std::uint32_t distance = 0;
    while (splits.left_slots(n / 2 - distance) == 0 && splits.left_slots(n / 2 + distance) == 0) ++distance;
    EXPECT_LE(distance, 12u) << n;
  }
}

TEST(LegalSplits, KeepTheNumberOfBlocks) {
  for (std::uint32_t n = 5; n <= 400; ++n) {
    const LegalSplits splits(n, 4);
    for (std::uint32_t left = 1; left < n; ++left) {
      const std::uint32_t slots = splits.left_slots(left);
      if (slots == 0) continue;
      const auto blocks = [](std::uint32_t triangles, std::uint32_t k) {
        return leaf_blocks_for(triangles) + internal_blocks_for(leaf_blocks_for(triangles), k);
      };
      EXPECT_EQ(blocks(left, slots) + blocks(n - left, 4 - slots), blocks(n, 4)) << n << " at " << left;
    }
  }
}

}  // namespace
}  // namespace tandem::build
