#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "build/sample_asset.h"
#include "kernels/common/block_pair.h"
#include "kernels/common/plain_boxes.h"
#include "kernels/common/traversal.h"
#include "kernels/geometry/box_test.h"
#include "kernels/random_pose.h"
#include "plain_boxes.h"

namespace tandem::test {
namespace {

// Boxes of one frame: a test that is exact and monotone, so that the candidates are known without a tree.
std::uint32_t aligned_mask(const Block& a, const Block& b) {
  std::uint32_t mask = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    for (int j = 0; j < kNodesPerBlock; ++j) {
      if (overlap_aligned(box_of(a, i), box_of(b, j))) mask |= 1u << (4 * i + j);
    }
  }
  return mask;
}

using Candidates =
    std::map<std::pair<std::uint32_t, std::uint32_t>, int>;  // pairs of source faces, how often met

Candidates walk(const LevelView& a, const LevelView& b) {
  Candidates candidates;
  traverse(a.blocks, b.blocks, aligned_mask,
           [&](const Block& block_a, const Block& block_b, std::uint32_t mask) {
             for (int i = 0; i < kNodesPerBlock; ++i) {
               for (int j = 0; j < kNodesPerBlock; ++j) {
                 if ((mask >> (4 * i + j) & 1) == 0) continue;
                 const Triangle& triangle_a = a.triangles[block_a.index[i]];
                 const Triangle& triangle_b = b.triangles[block_b.index[j]];
                 ++candidates[{triangle_a.source_face(), triangle_b.source_face()}];
               }
             }
             return true;
           });
  return candidates;
}

Candidates brute_force(const LevelView& a, const LevelView& b) {
  Candidates candidates;
  for (std::uint32_t x = 0; x < a.block_count; ++x) {
    for (std::uint32_t y = 0; y < b.block_count; ++y) {
      const Block &block_a = a.blocks[x], &block_b = b.blocks[y];
      if (!block_a.is_leaf_block() || !block_b.is_leaf_block()) continue;
      const std::uint32_t mask = aligned_mask(block_a, block_b);
      for (int bit = 0; bit < 16; ++bit) {
        if ((mask >> bit & 1) == 0) continue;
        const std::uint32_t face_a = a.triangles[block_a.index[bit / 4]].source_face();
        candidates[{face_a, b.triangles[block_b.index[bit % 4]].source_face()}] = 1;
      }
    }
  }
  return candidates;
}

TEST(Traversal, MeetsEveryCandidateOnceWhateverTheSizesOfTheTrees) {
  std::size_t met = 0;
  for (const std::uint32_t n : {1u, 3u, 4u, 5u, 17u, 64u, 300u}) {
    for (const std::uint32_t m : {1u, 2u, 4u, 7u, 33u, 100u, 500u}) {
      for (const auto imaginary : {build::Imaginary::minimal, build::Imaginary::free}) {
        const Bytes file_a(make_file(random_mesh(n, n), imaginary));
        const Bytes file_b(make_file(random_mesh(m, 1000 + m), build::Imaginary::minimal));
        const AssetView a = file_a.check().asset, b = file_b.check().asset;
        const Candidates candidates = walk(a.level(), b.level());
        EXPECT_EQ(candidates, brute_force(a.level(), b.level())) << n << " against " << m;
        met += candidates.size();
      }
    }
  }
  EXPECT_GT(met, 1000u);
}

TEST(Traversal, IsTheSameFromBothSides) {
  const Bytes file_a(make_file(random_mesh(400, 1))), file_b(make_file(random_mesh(50, 2)));
  const AssetView a = file_a.check().asset, b = file_b.check().asset;
  Candidates swapped;
  for (const auto& [faces, times] : walk(b.level(), a.level())) swapped[{faces.second, faces.first}] = times;
  EXPECT_EQ(walk(a.level(), b.level()), swapped);
}

TEST(Traversal, StopsWhenAsked) {
  const Bytes file(make_file(random_mesh(400, 1)));
  const LevelView tree = file.check().asset.level();
  int calls = 0;
  const auto once = [&](const Block&, const Block&, std::uint32_t) { return ++calls < 1; };
  const std::uint64_t until_first = traverse(tree.blocks, tree.blocks, aligned_mask, once);
  EXPECT_EQ(calls, 1);
  const auto all = [](const Block&, const Block&, std::uint32_t) { return true; };
  EXPECT_LT(until_first, traverse(tree.blocks, tree.blocks, aligned_mask, all));
}

// Two trees of the greatest depth in which every internal block has three leaf blocks and one internal one,
// the first to be descended, so that the stack grows as far as it ever can.
struct DeepTree {
  std::vector<Block> blocks;
  std::vector<Triangle> triangles;

  explicit DeepTree(std::uint32_t depth) {
    const Box box = {{0, 0, 0}, {1, 1, 1}};
    for (std::uint32_t level = 1; level < depth; ++level) {
      const auto first_child = static_cast<std::uint32_t>(blocks.size()) + 1;
      Block block;
      for (std::uint32_t i = 0; i < 3; ++i)
        set_node(block, static_cast<int>(i), box, first_child + i, NodeKind::internal);
      set_node(block, 3, box, first_child + 3, NodeKind::internal);
      blocks.push_back(block);
      for (int i = 0; i < 3; ++i) add_leaf_block(box);
    }
    add_leaf_block(box);
  }

  void add_leaf_block(const Box& box) {
    Block block;
    for (int i = 0; i < kNodesPerBlock; ++i) {
      set_node(block, i, box, static_cast<std::uint32_t>(triangles.size()), NodeKind::leaf);
      triangles.push_back({});
    }
    blocks.push_back(block);
  }

  LevelView view() const {
    LevelView view;
    view.blocks = blocks.data();
    view.triangles = triangles.data();
    view.block_count = static_cast<std::uint32_t>(blocks.size());
    view.triangle_count = static_cast<std::uint32_t>(triangles.size());
    return view;
  }
};

TEST(Traversal, TheStackHoldsTheDeepestTrees) {
  const DeepTree tree(kMaxDepth);
  std::uint64_t leaf_pairs = 0;
  traverse(tree.view().blocks, tree.view().blocks, aligned_mask,
           [&](const Block&, const Block&, std::uint32_t mask) {
             leaf_pairs += static_cast<std::uint64_t>(__builtin_popcount(mask));
             return true;
           });
  EXPECT_EQ(leaf_pairs, tree.triangles.size() * tree.triangles.size());
}

/// Records how high it ever was.
class RecordingStack : public BlockPairStack {
 public:
  static inline std::uint32_t highest = 0;

  BlockPair pop() {
    --height_;
    return BlockPairStack::pop();
  }
  void push(const BlockPair& pair) {
    highest = std::max(highest, ++height_);
    ASSERT_LE(height_, kTraversalStackSize);
    BlockPairStack::push(pair);
  }
  void push_children(const Block& a, const Block& b, std::uint32_t hits) {
    for (; hits != 0; hits &= hits - 1) {
      const int bit = lowest_bit(hits);
      push({a.index[bit / 4], b.index[bit % 4], kAllNodePairs});
    }
  }

 private:
  std::uint32_t height_ = 0;
};

// All children of a block are one block: no tree, but as deep, and full everywhere.
TEST(Traversal, TheStackHoldsWhatFullTreesOfTheGreatestDepthPutOn) {
  std::vector<Block> blocks(kMaxDepth);
  for (std::uint32_t level = 0; level < kMaxDepth; ++level) {
    const NodeKind kind = level + 1 < kMaxDepth ? NodeKind::internal : NodeKind::leaf;
    for (int i = 0; i < kNodesPerBlock; ++i) {
      set_node(blocks[level], i, {{0, 0, 0}, {1, 1, 1}}, kind == NodeKind::internal ? level + 1 : 0, kind);
    }
  }
  LevelView view;
  view.blocks = blocks.data();
  view.block_count = kMaxDepth;
  RecordingStack::highest = 0;
  const auto stop = [](const Block&, const Block&, std::uint32_t) { return false; };
  traverse<RecordingStack>(view.blocks, view.blocks, aligned_mask, stop);
  EXPECT_GT(RecordingStack::highest, 63u * 15u * 3u);
  EXPECT_LE(RecordingStack::highest, kTraversalStackSize);
}

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
      spoil(random, &a.centre[0][0], 24);
      spoil(random, &b.centre[0][0], 24);
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
  const RelativePose same = without_slack(kIdentityPose.rotation, kIdentityPose.translation);
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
}  // namespace tandem::test
