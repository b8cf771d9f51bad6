#pragma once
#include "kernels/contact/narrow_phase_walk.h"

// The step down of walks that know a bound of each node pair. Included by files that are compiled for
// different machines: internal linkage, see lanes.h.
namespace tandem {
namespace {

/// Hands on the pairs of blocks below a pair that is not of two leaf blocks: emit(bound, child of a, child of
/// b, mask), where no child means that this side stays.
template <typename Bound, typename Emit>
void each_pair_below(const Block& a, const Block& b, std::uint32_t hits, const Bound* bound,
                     const Emit& emit) {
  const bool leaves_a = a.is_leaf_block(), leaves_b = b.is_leaf_block();
  const Descent descent = leaves_a != leaves_b ? descent_beside_leaves(leaves_a)
                                               : descent_by_size(size_of(a), size_of(b), descends_alone(a));
  if (descent == Descent::both) {
    for (; hits != 0; hits &= hits - 1) {
      const int bit = lowest_bit(hits);
      emit(bound[bit], &a.index[bit / 4], &b.index[bit % 4], kAllNodePairs);
    }
    return;
  }
  const bool a_alone = descent == Descent::a_alone;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const std::uint32_t own =
        hits & (a_alone ? row(0xF, i) : column(0xF, i));  // hits of the node that descends
    if (own == 0) continue;
    Bound least = bound[lowest_bit(own)];
    for (std::uint32_t bits = own & (own - 1); bits != 0; bits &= bits - 1) {
      const Bound next = bound[lowest_bit(bits)];
      if (next < least) least = next;
    }
    if (a_alone)
      emit(least, &a.index[i], nullptr, (own >> 4 * i) * 0x1111u);
    else
      emit(least, nullptr, &b.index[i], (own >> i) * 0xFu);
  }
}

}  // namespace
}  // namespace tandem
