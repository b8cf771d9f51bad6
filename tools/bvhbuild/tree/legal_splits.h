#pragma once
#include <cstdint>

namespace tandem::build {

/// Leaf blocks that n triangles need.
constexpr std::uint32_t leaf_blocks_for(std::uint32_t n) {
  return n / 4 + (n % 4 != 0);
}

/// Internal blocks that a group of `leaf_blocks` leaf blocks needs below the `slots` nodes that it may take
/// in one block.
constexpr std::uint32_t internal_blocks_for(std::uint32_t leaf_blocks, std::uint32_t slots) {
  return leaf_blocks <= slots ? 0 : (leaf_blocks - slots + 2) / 3;
}

/// Blocks of the smallest tree over n triangles.
constexpr std::uint32_t blocks_for(std::uint32_t n) {
  return leaf_blocks_for(n) + internal_blocks_for(leaf_blocks_for(n), 1);
}

/// Splits of n triangles, which may take `slots` nodes of one block, that keep the number of blocks at its
/// minimum: leaf blocks and internal blocks of both sides must add up to those of the whole. Then imaginary
/// nodes stay at the minimum, since the number of nodes that are not imaginary is fixed: triangles, and
/// blocks less the root.
///
/// There always is one for at least 2 slots and 2 leaf blocks, L. If L <= slots: 1 leaf block of four
/// triangles in 1 slot against the rest in the others. If L > slots: a side of La = ka full leaf blocks in ka
/// slots needs no internal block, and the other side needs ceil((L - ka - kb) / 3), as many as the whole.
class LegalSplits {
 public:
  constexpr LegalSplits(std::uint32_t n, std::uint32_t slots)
      : n_(n),
        slots_(slots),
        leaf_blocks_(leaf_blocks_for(n)),
        internal_blocks_(internal_blocks_for(leaf_blocks_, slots)) {}

  /// Returns a number of which all legal splits are multiples: full leaf blocks stay full.
  constexpr std::uint32_t step() const { return n_ % 4 == 0 ? 4 : 1; }

  /// Returns how many slots the first `left` triangles should take, 0 if the split is not legal. Where
  /// several numbers are legal: the one that shares slots most nearly as leaf blocks are shared.
  constexpr std::uint32_t left_slots(std::uint32_t left) const {
    const std::uint32_t l = leaf_blocks_for(left), r = leaf_blocks_for(n_ - left);
    if (l + r != leaf_blocks_) return 0;
    std::uint32_t best = 0;
    std::uint64_t best_skew = ~std::uint64_t{0};
    for (std::uint32_t k = 1; k < slots_; ++k) {
      if (internal_blocks_for(l, k) + internal_blocks_for(r, slots_ - k) != internal_blocks_) continue;
      const std::uint64_t mine = std::uint64_t{l} * (slots_ - k), other = std::uint64_t{r} * k;
      const std::uint64_t skew = mine > other ? mine - other : other - mine;
      if (skew < best_skew) {
        best = k;
        best_skew = skew;
      }
    }
    return best;
  }

 private:
  std::uint32_t n_, slots_, leaf_blocks_, internal_blocks_;
};

}  // namespace tandem::build
