#pragma once
#include <algorithm>

#include "narrow_phase_walk.h"
#include "nearest_phase.h"
#include "tandem/kernels/detail/traversal.h"

// The walk that all variants of the nearest phase share. Included by files that are compiled for different
// machines: internal linkage, see lanes.h.
namespace tandem {
namespace {

constexpr std::uint32_t kNearBatch = 16;

/// Pairs of triangles that wait to be bounded. The room above is for one more pair of leaf blocks.
struct NearBatch {
  alignas(64) std::uint32_t a[2 * kNearBatch];
  alignas(64) std::uint32_t b[2 * kNearBatch];
  std::uint32_t count = 0;
};

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

/// The means of a variant are made of a task and bring: Bound, a number type; bounds(a, b, limit, out): the
/// bounds of all node pairs, and the mask of those below the limit, imaginary nodes never; limit(distance),
/// distance(bound), see box_distance.h; and intervals(batch, lower, upper): the distances of the first
/// kNearBatch pairs of triangles in the world, any where there are fewer.
template <typename Means>
class NearestWalk {
 public:
  NearestWalk(const NearestTask& task, NearestSoFar& state) : task_(task), state_(state), means_(task) {}

  void run(const BoundedBlockPair* from, std::uint32_t count) {
    take_limits();
    for (std::uint32_t i = 0; i < count && goes_on(); ++i) {
      stack_[height_++] = {static_cast<Bound>(from[i].bound), from[i].a, from[i].b, from[i].mask};
      while (height_ > 0 && goes_on()) visit(stack_[--height_]);
    }
    if (batch_.count > 0 && goes_on()) bound_triangles();
  }

 private:
  using Bound = typename Means::Bound;

  struct Waiting {
    Bound bound;
    std::uint32_t a, b, mask;
  };

  bool goes_on() const { return !state_.touches() && state_.enough_memory; }

  void take_limits() {
    limit_ = means_.limit(nearness(task_, state_));
    limit_without_tolerance_ = means_.limit(state_.upper);
  }

  /// What has this bound counts no longer.
  void pass_over(Bound bound) {
    if (bound < limit_without_tolerance_) state_.floor = std::min(state_.floor, means_.distance(bound));
  }

  void visit(const Waiting& pair) {
    if (!(pair.bound < limit_)) return pass_over(pair.bound);
    const Block &a = task_.a->tree.blocks[pair.a], &b = task_.b->tree.blocks[pair.b];
    alignas(64) Bound bound[16];
    const std::uint32_t open = means_.bounds(a, b, limit_without_tolerance_, bound) & pair.mask;
    ++state_.counters.block_pairs;
    std::uint32_t hits = 0;
    for (std::uint32_t bits = open; bits != 0; bits &= bits - 1) {
      const int bit = lowest_bit(bits);
      if (bound[bit] < limit_)
        hits |= 1u << bit;
      else
        pass_over(bound[bit]);
    }
    if (hits == 0) return;
    const bool leaves_a = a.is_leaf_block(), leaves_b = b.is_leaf_block();
    if (leaves_a && leaves_b) return take_leaves(a, b, hits);
    const std::uint32_t bottom = height_;
    each_pair_below(
        a, b, hits, bound,
        [&](Bound least, const std::uint32_t* child_a, const std::uint32_t* child_b, std::uint32_t mask) {
          push({least, child_a != nullptr ? *child_a : pair.a, child_b != nullptr ? *child_b : pair.b, mask},
               bottom);
        });
  }

  /// Keeps what was pushed from `bottom` on in such an order that the nearest is taken first.
  void push(const Waiting& pair, std::uint32_t bottom) {
    std::uint32_t at = height_++;
    for (; at > bottom && stack_[at - 1].bound < pair.bound; --at) stack_[at] = stack_[at - 1];
    stack_[at] = pair;
  }

  void take_leaves(const Block& a, const Block& b, std::uint32_t hits) {
    for (; hits != 0; hits &= hits - 1) {
      const int bit = lowest_bit(hits);
      batch_.a[batch_.count] = a.index[bit / 4];
      batch_.b[batch_.count++] = b.index[bit % 4];
    }
    if (batch_.count >= kNearBatch || !state_.found) bound_triangles();
  }

  void bound_triangles() {
    while (batch_.count > 0 && goes_on()) {
      const std::uint32_t count = std::min(batch_.count, kNearBatch);
      double lower[kNearBatch], upper[kNearBatch];
      for (std::uint32_t i = batch_.count; i < kNearBatch; ++i) batch_.a[i] = batch_.b[i] = 0;
      means_.intervals(batch_, lower, upper);
      state_.counters.by_float32 += count;
      std::uint32_t nearest = kNearBatch;
      for (std::uint32_t i = 0; i < count; ++i) {
        if (!(upper[i] < state_.upper)) continue;
        state_.upper = upper[i];
        state_.found = true;
        nearest = i;
      }
      const double near = nearness(task_, state_);
      for (std::uint32_t i = 0; i < count && goes_on(); ++i) {
        if (!(lower[i] < near) && i != nearest)
          state_.floor = std::min(state_.floor, lower[i]);
        else if (lower[i] == 0)
          settle(task_, batch_.a[i], batch_.b[i], state_);
        else
          add_candidate({lower[i], upper[i], batch_.a[i], batch_.b[i]}, state_);
      }
      batch_.count -= count;
      for (std::uint32_t i = 0; i < batch_.count; ++i) {
        batch_.a[i] = batch_.a[kNearBatch + i];
        batch_.b[i] = batch_.b[kNearBatch + i];
      }
      take_limits();
      if (batch_.count < kNearBatch && state_.found) return;
    }
  }

  const NearestTask& task_;
  NearestSoFar& state_;
  const Means means_;
  Bound limit_, limit_without_tolerance_;
  NearBatch batch_;
  /// Depth first, one pair at a time, each leaving 15 beside the one that is taken next, on at most as many
  /// levels as both trees have together; the last gives 16.
  Waiting stack_[15 * 2 * kMaxDepth + 16];
  std::uint32_t height_ = 0;
};

}  // namespace
}  // namespace tandem
