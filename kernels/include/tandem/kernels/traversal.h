#pragma once
#include <cstdint>

#include "tandem/formats/platform.h"
#include "tandem/formats/view.h"

/// Tandem traversal of two trees, on one thread: CPU, or one thread of a GPU.
/// Source: Damkjaer and Erleben 2009, section 2; depth first instead of level by level.
namespace tandem {

/// One unit of tandem work: up to 4 x 4 node pairs of two blocks. Bit 4 i + j of `mask` stands for node i of
/// block a against node j of block b.
struct BlockPair {
  std::uint32_t a, b;
  std::uint32_t mask;
};

inline constexpr std::uint32_t kAllNodePairs = 0xFFFF;

/// The most entries that a traversal's stack ever holds. Each block pair that is taken off puts at most 16
/// on, whose blocks lie one level deeper on at least one side. A pair whose levels (root: 1) add up to s has
/// s - 2 pairs above it, and of each of those at most 15 others wait; the largest sum that still puts pairs
/// on is depth_a + depth_b - 1.
TANDEM_HD constexpr std::uint32_t traversal_stack_size(std::uint32_t depth_a, std::uint32_t depth_b) {
  return 15 * (depth_a + depth_b - 2) + 1;
}
inline constexpr std::uint32_t kTraversalStackSize = traversal_stack_size(kMaxDepth, kMaxDepth);

/// Visits every block pair that the test leads to, each once, and hands leaf pairs on.
///
/// Two internal blocks: one new pair for each hit, both sides descend. Two leaf blocks: on_leaves gets the
/// hits. An internal block against a leaf block: the internal side descends alone, one new pair for each of
/// its nodes that hits at all, and the mask keeps which leaves it hit. So a node pair is tested again only
/// against nodes further down, and no leaf pair is met twice (the paper's figures 3 and 4).
///
/// test(block_a, block_b) -> mask of node pairs whose boxes may overlap; imaginary nodes never do.
/// on_leaves(a, b, mask) -> bool: blocks a and b are leaf blocks, mask is not 0; false ends the traversal.
/// Result: the number of block pairs tested. Order: depth first, later nodes first; the same on every run.
template <typename Test, typename OnLeaves>
TANDEM_HD std::uint64_t traverse(const LevelView& tree_a, const LevelView& tree_b, const Test& test,
                                 const OnLeaves& on_leaves) {
  BlockPair stack[kTraversalStackSize];
  std::uint32_t height = 0;
  stack[height++] = {0, 0, kAllNodePairs};
  std::uint64_t tested = 0;
  while (height > 0) {
    const BlockPair pair = stack[--height];
    const Block &block_a = tree_a.blocks[pair.a], &block_b = tree_b.blocks[pair.b];
    const std::uint32_t hits = test(block_a, block_b) & pair.mask;
    ++tested;
    if (hits == 0) continue;
    const bool leaves_a = block_a.is_leaf_block(), leaves_b = block_b.is_leaf_block();
    if (leaves_a && leaves_b) {
      if (!on_leaves(pair.a, pair.b, hits)) break;
    } else if (leaves_b) {
      for (int i = 0; i < kNodesPerBlock; ++i) {
        const std::uint32_t row =
            hits >> 4 * i & 0xFu;  // leaves of b that node i hits: the new pair's columns
        if (row != 0) stack[height++] = {block_a.index[i], pair.b, row * 0x1111u};
      }
    } else if (leaves_a) {
      for (int j = 0; j < kNodesPerBlock; ++j) {
        const std::uint32_t column =
            hits >> j & 0x1111u;  // leaves of a that node j hits: the new pair's rows
        if (column != 0) stack[height++] = {pair.a, block_b.index[j], column * 0xFu};
      }
    } else {
      for (int i = 0; i < kNodesPerBlock; ++i) {
        for (int j = 0; j < kNodesPerBlock; ++j) {
          if ((hits >> (4 * i + j) & 1u) != 0)
            stack[height++] = {block_a.index[i], block_b.index[j], kAllNodePairs};
        }
      }
    }
  }
  return tested;
}

}  // namespace tandem
