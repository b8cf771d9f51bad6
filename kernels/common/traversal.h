#pragma once
#include <bit>
#include <cstdint>

#include "tandem/formats/platform.h"
#include "tandem/formats/view.h"

/// Tandem traversal of two trees on one thread of a CPU, and the rules of it that the walk on a GPU shares.
/// Source: Damkjaer and Erleben 2009, section 2; from a stack instead of level by level.
namespace tandem {

/// A unit of tandem work: up to 4 x 4 node pairs of two blocks. Bit 4 i + j of `mask` stands for node i of
/// block a against node j of block b.
struct BlockPair {
  std::uint32_t a, b;
  std::uint32_t mask;
};

inline constexpr std::uint32_t kAllNodePairs = 0xFFFF;

/// The node pairs that count where a block meets itself in a pair of an instance with itself: each pair i < j
/// once, and i = j where there is something below that node. No leaf meets itself.
TANDEM_HD constexpr std::uint32_t own_node_pairs(bool leaf_block) {
  constexpr std::uint32_t kAbove = 0x08CE, kEqual = 0x8421;
  return leaf_block ? kAbove : kAbove | kEqual;
}

/// Block pairs that are taken off the stack together: their tests do not wait for each other, so a processor
/// overlaps them. 4 take 11 % less time than 1, and 8 no less than 4 (docs/decisions/box-tests.md).
inline constexpr std::uint32_t kTakenAtOnce = 4;

/// The most entries that a traversal's stack ever holds.
///
/// Proof. Let the level of a block be 1 for the root, and of a pair the sum of both. A round takes up to
/// kTakenAtOnce pairs off the top and puts at most 16 on for each, whose levels are higher by at least 1: a
/// group. The lowest level in a group is higher than that in each group below: a round takes from groups at
/// the top, the lowest of which it may leave some of, and every pair that it takes has at least that group's
/// lowest level, by induction; so what it puts on top lies higher. Pairs that put others on have levels from
/// 2 to depth_a + depth_b - 1, so lowest levels of groups are 3 to depth_a + depth_b: that many groups, each
/// of at most 16 kTakenAtOnce pairs. Before the first round there is one pair.
constexpr std::uint32_t traversal_stack_size(std::uint32_t depth_a, std::uint32_t depth_b) {
  return 16 * kTakenAtOnce * (depth_a + depth_b - 2) + 1;
}
inline constexpr std::uint32_t kTraversalStackSize = traversal_stack_size(kMaxDepth, kMaxDepth);

/// Position of the lowest set bit. Condition: bits != 0.
TANDEM_HD inline int lowest_bit(std::uint32_t bits) {
#ifdef __CUDA_ARCH__
  return __ffs(static_cast<int>(bits)) - 1;
#else
  return std::countr_zero(bits);
#endif
}

/// The number of the block below a node of an internal block. A number means a block of its own kind.
TANDEM_HD inline std::uint32_t child_of(const Block& block, int node) {
  return block.index[node];
}
TANDEM_HD inline std::uint32_t child_of(const OrientedBlock& block, int node) {
  return block.first_below + static_cast<std::uint32_t>(node);
}

/// The block pairs that wait. A CPU has faster ones, with the same order.
class BlockPairStack {
 public:
  bool empty() const { return height_ == 0; }
  BlockPair pop() { return pairs_[--height_]; }
  void push(const BlockPair& pair) { pairs_[height_++] = pair; }

  /// A pair of child blocks for each hit, two internal blocks given.
  template <typename AnyBlock>
  void push_children(const AnyBlock& a, const AnyBlock& b, std::uint32_t hits) {
    for (; hits != 0; hits &= hits - 1) {
      const int bit = lowest_bit(hits);
      push({child_of(a, bit / 4), child_of(b, bit % 4), kAllNodePairs});
    }
  }

 private:
  BlockPair pairs_[kTraversalStackSize];
  std::uint32_t height_ = 0;
};

/// Returns how large the contents of a block may be: the sum of half-extents of the largest node.
TANDEM_HD inline float size_of(const Block& block) {
  float size = 0;  // imaginary nodes have -infinity
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const float sum = (block.half_extent[0][i] + block.half_extent[1][i]) + block.half_extent[2][i];
    if (sum > size) size = sum;
  }
  return size;
}

TANDEM_HD inline float size_of(const OrientedBlock& block) {
  return block.size;
}

/// Says which of the two blocks of a pair that hits are replaced by their children.
enum class Descent : std::uint32_t { both, b_alone, a_alone };

/// If a leaf block meets an internal one, the internal one descends.
TANDEM_HD constexpr Descent descent_beside_leaves(bool leaf_a) {
  return leaf_a ? Descent::b_alone : Descent::a_alone;
}

/// An internal block must be this many times larger than the other one to descend alone. For bodies on a
/// ground that leaves a third of the block pairs. Any factor from 1.5 to 4 does about as well
/// (docs/decisions/box-tests.md).
inline constexpr float kDescendsAlone = 2;
/// The factor for sizes by oriented_size() (docs/decisions/gpu-blocks.md).
inline constexpr float kOrientedDescendsAlone = 1.75f;

TANDEM_HD constexpr float descends_alone(const Block&) {
  return kDescendsAlone;
}
TANDEM_HD constexpr float descends_alone(const OrientedBlock&) {
  return kOrientedDescendsAlone;
}

/// If one of two internal blocks is so many times larger, it descends alone.
TANDEM_HD constexpr Descent descent_by_size(float size_a, float size_b, float times) {
  if (size_a > times * size_b) return Descent::a_alone;
  return size_b > times * size_a ? Descent::b_alone : Descent::both;
}

/// A leaf block must be this many times larger than an internal one for its triangles' planes to be tried,
/// see drop_beyond_planes(). A plane tells more than a box where the other mesh's nodes are much smaller:
/// under bodies of 24,000 triangles on a ground it spares 40 % of the block pairs and 60 % of the candidates
/// (docs/decisions/box-tests.md).
inline constexpr float kTimesLarger = 4;

/// Returns whether it is that much larger. The other of the two is an internal block.
TANDEM_HD constexpr bool worth_planes(bool leaf_a, float size_a, float size_b) {
  return descent_by_size(size_a, size_b, kTimesLarger) == (leaf_a ? Descent::a_alone : Descent::b_alone);
}

/// Pairs of the children of a with b. hits: of a and b.
template <typename Stack, typename AnyBlock>
void descend_a(Stack& stack, const BlockPair& pair, const AnyBlock& a, std::uint32_t hits) {
  for (int i = 0; i < kNodesPerBlock; ++i) {
    // Nodes of b that node i hits: the new pair's columns.
    const std::uint32_t row = hits >> 4 * i & 0xFu;
    if (row != 0) stack.push({child_of(a, i), pair.b, row * 0x1111u});
  }
}

/// Pairs of a with the children of b.
template <typename Stack, typename AnyBlock>
void descend_b(Stack& stack, const BlockPair& pair, const AnyBlock& b, std::uint32_t hits) {
  for (int j = 0; j < kNodesPerBlock; ++j) {
    // Nodes of a that node j hits: the new pair's rows.
    const std::uint32_t column = hits >> j & 0x1111u;
    if (column != 0) stack.push({pair.a, child_of(b, j), column * 0xFu});
  }
}

/// The block pairs below one that hits, not both of whose blocks are leaf blocks. Compilers are told to
/// inline it: GCC stops doing so by itself where a file has several walks, which takes 2 % more instructions.
template <typename Stack, typename AnyBlock>
[[gnu::always_inline]] inline void descend(Stack& stack, const BlockPair& pair, const AnyBlock& a,
                                           const AnyBlock& b, std::uint32_t hits) {
  const bool leaf_a = a.is_leaf_block();
  const Descent descent = leaf_a != b.is_leaf_block()
                              ? descent_beside_leaves(leaf_a)
                              : descent_by_size(size_of(a), size_of(b), descends_alone(a));
  if (descent == Descent::a_alone) return descend_a(stack, pair, a, hits);
  if (descent == Descent::b_alone) return descend_b(stack, pair, b, hits);
  stack.push_children(a, b, hits);
}

/// Drops no hit.
struct KeepHits {
  template <typename AnyBlock>
  std::uint32_t operator()(const AnyBlock&, const AnyBlock&, std::uint32_t hits) const {
    return hits;
  }
};

/// Visits every block pair that the test leads to, each once, and hands leaf pairs on. Takes the blocks of
/// two trees, both Block or both OrientedBlock.
///
/// Two leaf blocks: on_leaves gets the hits. Two internal blocks: one new pair for each hit, both sides
/// descend; unless one is larger by kDescendsAlone. Then, and where the other is a leaf block, it descends
/// alone, one new pair for each of its nodes that hits at all, and the mask keeps which nodes it hit. So a
/// node pair is tested again only against nodes further down, and no leaf pair is met twice (the paper's
/// figures 3 and 4).
///
/// test(block_a, block_b) -> mask of node pairs whose boxes may overlap; imaginary nodes never do.
/// on_leaves(block_a, block_b, mask) -> bool: two leaf blocks, mask is not 0; false ends the traversal.
/// narrow(block_a, block_b, mask) -> mask: of a leaf block and an internal one, less hits that lead nowhere.
/// Result: the number of block pairs tested. Order: deeper ones first; the same on every run and machine.
template <typename Stack = BlockPairStack, typename AnyBlock, typename Test, typename OnLeaves,
          typename Narrow = KeepHits>
std::uint64_t traverse(const AnyBlock* blocks_a, const AnyBlock* blocks_b, const Test& test,
                       const OnLeaves& on_leaves, const Narrow& narrow = {}) {
  Stack stack;
  stack.push({0, 0, kAllNodePairs});
  std::uint64_t tested = 0;
  while (!stack.empty()) {
    BlockPair taken[kTakenAtOnce];
    std::uint32_t hits[kTakenAtOnce], count = 0;
    while (count < kTakenAtOnce && !stack.empty()) taken[count++] = stack.pop();
    for (std::uint32_t i = 0; i < count; ++i) {
      hits[i] = test(blocks_a[taken[i].a], blocks_b[taken[i].b]) & taken[i].mask;
    }
    tested += count;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (hits[i] == 0) continue;
      const AnyBlock &a = blocks_a[taken[i].a], &b = blocks_b[taken[i].b];
      const bool leaves_a = a.is_leaf_block(), leaves_b = b.is_leaf_block();
      if (leaves_a && leaves_b) {
        if (!on_leaves(a, b, hits[i])) return tested;
      } else {
        descend(stack, taken[i], a, b, leaves_a == leaves_b ? hits[i] : narrow(a, b, hits[i]));
      }
    }
  }
  return tested;
}

}  // namespace tandem
