#include "kernels/impact/impact_walk.h"

#include <algorithm>
#include <cmath>

#include "kernels/impact/triangle_impact.h"

namespace tandem::impact {
namespace {

// Shells are found when the walk has looked at so many pairs of blocks and triangles: as many as this part of
// the triangles, but not fewer than that. Pairs of bodies that meet or pass by take less.
constexpr std::uint64_t kPartLookedAt = 4, kLeastLookedAt = 1024;

constexpr std::uint64_t kNever = ~std::uint64_t{0};

std::uint64_t work_of(const ImpactCounters& counters) {
  return counters.block_pairs + counters.triangle_pairs;
}

}  // namespace

// Sorts up to 16 waiting pairs, the soonest last.
class ImpactWalk::SortedPairs {
 public:
  void insert(const WaitingPair& pair) {
    std::uint32_t i = count_++;
    for (; i > 0 && pairs_[i - 1].apart < pair.apart; --i) pairs_[i] = pairs_[i - 1];
    pairs_[i] = pair;
  }
  std::uint32_t count() const { return count_; }
  const WaitingPair& operator[](std::uint32_t i) const { return pairs_[i]; }

 private:
  WaitingPair pairs_[16];
  std::uint32_t count_ = 0;
};

// Returns a part, which is made where it is first asked for in a piece.
const ImpactWalk::Part& ImpactWalk::part(std::uint32_t number) {
  Part& part = parts_[number];
  if (part.piece == piece_) return part;
  part.piece = piece_;
  part.time = part_of_piece(span_, number);
  part.place = place_at(*pair_, part.time.begin);
  part.frames = pair_frames(*pair_, part.place, kAim * tolerance_);
  return part;
}

// False: out of memory. What is below a block has higher numbers.
bool ImpactWalk::make_shells(const MovingBody& body, const LevelView& tree, const Vector3& centre,
                             double from_a, Buffer<Shell>& out) const {
  if (!out.resize(std::size_t{tree.block_count} * kNodesPerBlock)) return false;
  for (std::size_t b = tree.block_count; b-- > 0;) {
    const Block& block = tree.blocks[b];
    for (std::size_t i = 0; i < kNodesPerBlock; ++i) {
      Shell& shell = out[b * kNodesPerBlock + i];
      shell = kNoShell;
      if (block.kind[i] == NodeKind::imaginary) continue;
      if (block.is_leaf_block()) {
        Vector3 x[3];
        for (int c = 0; c < 3; ++c) {
          const float* const p = tree.triangles[block.index[i]].corner[c].position;
          double posed[3];
          apply(body.start, p[0], p[1], p[2], posed);
          x[c] = vector_of(posed) - centre;
        }
        shell = shell_of(axes_.axis, x, from_a);
        continue;
      }
      for (std::size_t k = 0; k < kNodesPerBlock; ++k)
        shell = joined(shell, out[block.index[i] * std::size_t{kNodesPerBlock} + k]);
    }
  }
  return true;
}

// Without memory for them the walk goes on as before.
void ImpactWalk::find_shells() {
  shells_at_ = kNever;
  axes_ = shell_axes(*pair_);
  has_shells_ = make_shells(*pair_->a, *a_, axes_.centre_a, 0, shells_a_) &&
                make_shells(*pair_->b, *b_, axes_.centre_b, dot(axes_.axis, axes_.offset), shells_b_);
  gaps_ = shell_gaps(*pair_, axes_, span_.end, tolerance_);
}

std::uint32_t ImpactWalk::without_apart(const WaitingPair& pair) const {
  std::uint32_t mask = pair.mask;
  const Shell* const a = &shells_a_[pair.a * std::size_t{kNodesPerBlock}];
  const Shell* const b = &shells_b_[pair.b * std::size_t{kNodesPerBlock}];
  for (std::uint32_t left = mask; left != 0; left &= left - 1) {
    const int bit = lowest_bit(left);
    if (stay_apart(a[bit / 4], b[bit % 4], gaps_)) mask &= ~(1u << bit);
  }
  return mask;
}

void ImpactWalk::visit(const WaitingPair& pair) {
  if (work_of(*counters_) >= shells_at_) find_shells();
  const std::uint32_t mask = has_shells_ ? without_apart(pair) : pair.mask;
  if (mask == 0) {
    ++counters_->block_pairs;
    return;
  }
  const Part& now = part(pair.part);
  const Block &a = a_->blocks[pair.a], &b = b_->blocks[pair.b];
  const double most = std::min(now.time.end, stop_.time) - now.time.begin;
  NodeTimes times;
  // The boxes below a node are apart for as long as the node is.
  node_times(now.frames, a, b, mask, std::max(0.0, pair.apart - now.time.begin), most, times);
  ++counters_->block_pairs;
  if (times.hits == 0) return;
  const double length = now.time.end - now.time.begin;
  if (worth_halving(acceleration_, pair.part, length, size_of(a), size_of(b))) {
    push({pair.a, pair.b, times.hits, 2 * pair.part + 1, pair.apart});
    push({pair.a, pair.b, times.hits, 2 * pair.part, pair.apart});
  } else if (a.is_leaf_block() && b.is_leaf_block()) {
    advance_leaves(pair, times, now);
  } else {
    descend(pair, times, now.time.begin);
  }
}

void ImpactWalk::descend(const WaitingPair& pair, const NodeTimes& times, double begin) {
  const Block &a = a_->blocks[pair.a], &b = b_->blocks[pair.b];
  const bool leaves_a = a.is_leaf_block(), leaves_b = b.is_leaf_block();
  const Descent descent = leaves_a != leaves_b ? descent_beside_leaves(leaves_a)
                                               : descent_by_size(size_of(a), size_of(b), kDescendsAlone);
  const auto soonest = [&](std::uint32_t hits) {
    double apart = INFINITY;
    for (; hits != 0; hits &= hits - 1) apart = std::min(apart, times.apart[lowest_bit(hits)]);
    return begin + apart;
  };
  SortedPairs below;
  if (descent == Descent::both) {
    for (std::uint32_t hits = times.hits; hits != 0; hits &= hits - 1) {
      const int bit = lowest_bit(hits);
      below.insert({a.index[bit / 4], b.index[bit % 4], kAllNodePairs, pair.part, begin + times.apart[bit]});
    }
  }
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const std::uint32_t row = times.hits >> 4 * i & 0xFu, column = times.hits >> i & 0x1111u;
    if (descent == Descent::a_alone && row != 0)
      below.insert({a.index[i], pair.b, row * 0x1111u, pair.part, soonest(row << 4 * i)});
    if (descent == Descent::b_alone && column != 0)
      below.insert({pair.a, b.index[i], column * 0xFu, pair.part, soonest(column << i)});
  }
  for (std::uint32_t i = 0; i < below.count(); ++i) push(below[i]);
}

void ImpactWalk::advance_leaves(const WaitingPair& pair, const NodeTimes& times, const Part& part) {
  SortedPairs leaves;
  for (std::uint32_t hits = times.hits; hits != 0; hits &= hits - 1) {
    const int bit = lowest_bit(hits);
    leaves.insert({a_->blocks[pair.a].index[bit / 4], b_->blocks[pair.b].index[bit % 4], 0, pair.part,
                   part.time.begin + times.apart[bit]});
  }
  for (std::uint32_t i = leaves.count(); i-- > 0;) {
    if (leaves[i].apart < stop_.time) advance_pair(leaves[i], part);
  }
}

void ImpactWalk::advance_pair(const WaitingPair& leaf, const Part& part) {
  ++counters_->triangle_pairs;
  const MovingTriangles start = moving_triangles(*pair_, a_->triangles[leaf.a], b_->triangles[leaf.b]);
  const double end = std::min(part.time.end, stop_.time);
  const double from =
      time_to_advance_from(*pair_, start, part.place, part.time.begin, end, leaf.apart, tolerance_);
  if (from >= end) return;
  const TriangleStop stop = advance(*pair_, start, from, end, tolerance_);
  ++counters_->advanced;
  counters_->steps += stop.steps;
  counters_->most_steps = std::max<std::uint64_t>(counters_->most_steps, stop.steps);
  if (stop.time >= end) return;
  converged_ = stop.converged;
  stop_ = {stop.time, leaf.a, leaf.b};
}

// Walks through the piece.
void ImpactWalk::walk() {
  ++piece_;
  ++counters_->walks;
  if (has_shells_) gaps_ = shell_gaps(*pair_, axes_, span_.end, tolerance_);
  push({0, 0, kAllNodePairs, 1, span_.begin});
  while (height_ > 0) {
    const WaitingPair pair = stack_[--height_];
    if (pair.apart < stop_.time) visit(pair);
  }
}

PairStop ImpactWalk::find_stop(const PairMotion& pair, const LevelView& a, const LevelView& b,
                               double tolerance, ImpactCounters& counters) {
  pair_ = &pair;
  a_ = &a;
  b_ = &b;
  counters_ = &counters;
  tolerance_ = tolerance;
  acceleration_ = largest_acceleration(pair);
  stop_ = {1};
  const std::uint64_t triangles = std::uint64_t{a.triangle_count} + b.triangle_count;
  has_shells_ = false;
  shells_at_ = pair.a->angle > 0 || pair.b->angle > 0
                   ? work_of(counters) + std::max(kLeastLookedAt, triangles / kPartLookedAt)
                   : kNever;
  const double pieces = pieces_of(pair);
  for (double i = 0; i < pieces && stop_.triangle_a == kNoIndex; ++i) {
    span_ = piece_of_step(i, pieces);
    walk();
  }
  if (stop_.triangle_a != kNoIndex && !converged_) ++counters.unconverged;
  return stop_;
}

}  // namespace tandem::impact
