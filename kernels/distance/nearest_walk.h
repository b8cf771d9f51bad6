#pragma once
#include <algorithm>
#include <limits>

#include "kernels/common/traversal.h"
#include "kernels/contact/pairs_below.h"
#include "kernels/distance/nearest_phase.h"

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

  /// Entries beyond the count, in the first batch, name any triangle: the first.
  void fill_up() {
    for (std::uint32_t i = count; i < kNearBatch; ++i) a[i] = b[i] = 0;
  }

  /// Forgets the first ones, as many as given, at most kNearBatch; then there are no more than kNearBatch.
  void drop(std::uint32_t first) {
    count -= first;
    for (std::uint32_t i = 0; i < count; ++i) {
      a[i] = a[first + i];
      b[i] = b[first + i];
    }
  }
};

/// Bounds of the distances in the world of a batch of triangles, and the directions from b to a that tell
/// them, in a's frame and of any length.
struct BoundedBatch {
  double lower[kNearBatch], upper[kNearBatch];
  alignas(64) float along[3][kNearBatch];
};

/// Pairs of blocks in the order of their bounds, in steps: the nearest step first, and of it the last pushed.
class WaitingPairs {
 public:
  bool empty() const { return nonempty_ == 0; }
  bool has_range() const { return scale_ > 0; }

  /// Bounds will be below this, mostly. Condition: it is positive.
  void set_range(double bound) { scale_ = kSteps / bound; }

  /// False: there is no room.
  bool push(const BoundedBlockPair& pair) {
    const std::uint32_t place = free_ != kNone ? free_ : used_;
    if (place == kMost) return false;
    if (free_ != kNone)
      free_ = next_[place];
    else
      ++used_;
    const double step = pair.bound * scale_;
    const std::uint32_t i = step < kSteps - 1 ? static_cast<std::uint32_t>(step) : kSteps - 1;
    next_[place] = (nonempty_ >> i & 1) != 0 ? first_[i] : kNone;
    first_[i] = static_cast<std::uint16_t>(place);
    nonempty_ |= std::uint64_t{1} << i;
    pairs_[place] = pair;
    return true;
  }

  /// Condition: not empty.
  BoundedBlockPair pop() {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(nonempty_));
    const std::uint16_t place = first_[i];
    first_[i] = next_[place];
    if (first_[i] == kNone) nonempty_ &= ~(std::uint64_t{1} << i);
    next_[place] = free_;
    free_ = place;
    return pairs_[place];
  }

 private:
  static constexpr std::uint32_t kSteps = 64, kMost = 1536;
  static constexpr std::uint16_t kNone = 0xFFFF;

  double scale_ = 0;
  std::uint64_t nonempty_ = 0;  ///< a bit for each step
  std::uint16_t free_ = kNone, first_[kSteps], next_[kMost];
  std::uint16_t used_ = 0;
  BoundedBlockPair pairs_[kMost];
};

/// Node pairs of two blocks, a bit each: those whose bounds are below one limit, and below another.
struct PairsBelow {
  std::uint32_t limit, other;
};

/// The means of a variant are made of a task and bring: Bound, a number type; bounds(a, b, limit, other,
/// out): the bounds of all node pairs, and the masks of those below both limits, imaginary nodes never;
/// limit(distance), distance(bound), see box_distance.h; far_along(batch, direction, distance): which of the
/// first kNearBatch pairs of triangles, any where there are fewer, are surely at least so far apart along the
/// direction; and bound(batch, out) of them.
template <typename Means>
class NearestWalk {
 public:
  NearestWalk(const NearestTask& task, NearestSoFar& state) : task_(task), state_(state), means_(task) {}

  void run(const BoundedBlockPair* from, std::uint32_t count) {
    take_limit();
    if (state_.found) wait_in_order();
    std::uint32_t next = 0;
    while (next < count && goes_on() && is_within_limits()) {
      stack_[height_++] = from[next++];
      while (goes_on() && is_within_limits() && (height_ > 0 || take_nearest())) visit(stack_[--height_]);
    }
    if (goes_on()) bound_triangles(true);
    while (goes_on() && (height_ > 0 || take_nearest())) leave(stack_[--height_], state_);
    for (; next < count && goes_on(); ++next) leave(from[next], state_);
    if (passed_over_ < std::numeric_limits<Bound>::infinity())
      state_.floor = std::min(state_.floor, means_.distance(passed_over_));
  }

 private:
  using Bound = typename Means::Bound;

  bool goes_on() const { return !state_.touches() && state_.enough_memory; }
  bool is_within_limits() const {
    return visits_ < state_.most_visits && state_.bounded < state_.most_bounded;
  }

  void take_limit() { limit_ = means_.limit(nearness(task_, state_)); }

  void visit(const BoundedBlockPair& taken) {
    const BoundedBlockPair pair = taken;               // the stack changes below
    if (!(static_cast<Bound>(pair.bound) < limit_)) {  // it counts no longer
      passed_over_ = std::min(passed_over_, static_cast<Bound>(pair.bound));
      return;
    }
    const Block &a = task_.a->tree.blocks[pair.a], &b = task_.b->tree.blocks[pair.b];
    alignas(64) Bound bound[16];
    const PairsBelow below = means_.bounds(a, b, limit_, passed_over_, bound);
    ++state_.counters.block_pairs;
    ++visits_;
    std::uint32_t hits = below.limit & pair.mask;
    for (std::uint32_t bits = below.other & ~below.limit & pair.mask; bits != 0; bits &= bits - 1)
      passed_over_ = std::min(passed_over_, bound[lowest_bit(bits)]);
    if (hits != 0 && state_.heights != nullptr) [[unlikely]]
      hits = drop_by_heights(task_, pair.a, pair.b, hits, state_);
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

  /// Keeps what was pushed onto the stack from `bottom` on in such an order that the nearest is taken first.
  /// As soon as an upper bound is known, what is near waits in the order of its bound instead, as far as
  /// there is room, so that little is looked at that is beyond the last upper bound. What may touch is to be
  /// looked at in any case, and at once.
  void push(const BoundedBlockPair& pair, std::uint32_t bottom) {
    if (waiting_.has_range() && pair.bound > 0 && waiting_.push(pair)) return;
    std::uint32_t at = height_++;
    for (; at > bottom && stack_[at - 1].bound < pair.bound; --at) stack_[at] = stack_[at - 1];
    stack_[at] = pair;
  }

  /// Puts the nearest of those that wait onto the stack. False: none is left.
  bool take_nearest() {
    if (waiting_.empty()) return false;
    stack_[height_++] = waiting_.pop();
    return true;
  }

  void take_leaves(const Block& a, const Block& b, std::uint32_t hits) {
    for (; hits != 0; hits &= hits - 1) {
      const int bit = lowest_bit(hits);
      leaves_.a[leaves_.count] = a.index[bit / 4];
      leaves_.b[leaves_.count++] = b.index[bit % 4];
    }
    bound_triangles(!state_.found);
  }

  /// Bounds the pairs of triangles that wait, when there are enough of them or all are to be; at first drops
  /// those that the direction of the nearest ones so far tells to be too far apart.
  void bound_triangles(bool all) {
    while ((leaves_.count >= kNearBatch || (all && leaves_.count > 0)) && goes_on()) {
      const std::uint32_t count = std::min(leaves_.count, kNearBatch);
      leaves_.fill_up();
      std::uint32_t left = (2u << (count - 1)) - 1;
      if (state_.has_direction) left &= ~means_.far_along(leaves_, state_.direction, state_.upper);
      for (; left != 0; left &= left - 1) {
        const int i = lowest_bit(left);
        near_.a[near_.count] = leaves_.a[i];
        near_.b[near_.count++] = leaves_.b[i];
      }
      leaves_.drop(count);
      if (near_.count >= kNearBatch || all) bound_near();
    }
    while (all && near_.count > 0 && goes_on()) bound_near();
    if (all && state_.found) wait_in_order();
  }

  /// Entries that are on the stack when the first upper bound is known wait from then on.
  void wait_in_order() {
    if (waiting_.has_range()) return;
    waiting_.set_range(static_cast<double>(limit_));
    std::uint32_t left = 0;
    for (std::uint32_t i = 0; i < height_; ++i) {
      if (!(stack_[i].bound > 0 && waiting_.push(stack_[i]))) stack_[left++] = stack_[i];
    }
    height_ = left;
  }

  void bound_near() {
    const std::uint32_t count = std::min(near_.count, kNearBatch);
    if (count == 0) return;
    near_.fill_up();
    BoundedBatch found;
    means_.bound(near_, found);
    state_.counters.by_float32 += count;
    state_.bounded += count;
    std::uint32_t nearest = kNearBatch;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (!(found.upper[i] < state_.upper)) continue;
      state_.upper = found.upper[i];
      state_.found = true;
      nearest = i;
    }
    if (nearest < kNearBatch) {
      state_.has_direction = true;
      for (int k = 0; k < 3; ++k) state_.direction[k] = found.along[k][nearest];
    }
    const double near = nearness(task_, state_);
    for (std::uint32_t i = 0; i < count && goes_on(); ++i) {
      if (!(found.lower[i] < near) && i != nearest)
        state_.floor = std::min(state_.floor, found.lower[i]);
      else if (found.lower[i] == 0 && i == nearest)
        settle(task_, near_.a[i], near_.b[i], state_);
      else if (found.lower[i] == 0)
        settle_if_near(task_, near_.a[i], near_.b[i], 0, state_);
      else
        add_candidate({found.lower[i], found.upper[i], near_.a[i], near_.b[i]}, state_);
    }
    near_.drop(count);
    take_limit();
  }

  const NearestTask& task_;
  NearestSoFar& state_;
  const Means means_;
  Bound limit_;  ///< pairs of blocks with this bound count no longer
  Bound passed_over_ = std::numeric_limits<Bound>::infinity();  ///< the least bound of what is passed over
  NearBatch leaves_, near_;
  WaitingPairs waiting_;
  /// Depth first, one pair at a time, each leaving 15 beside the one that is taken next, on at most as many
  /// levels as both trees have together; the last gives 16.
  BoundedBlockPair stack_[15 * 2 * kMaxDepth + 16];
  std::uint32_t height_ = 0;
  std::uint64_t visits_ = 0;
};

}  // namespace
}  // namespace tandem
