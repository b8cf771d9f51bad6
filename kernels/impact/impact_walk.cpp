#include "kernels/impact/impact_walk.h"

#include <algorithm>
#include <cmath>

#include "kernels/impact/triangle_impact.h"

namespace tandem::impact {

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

void ImpactWalk::visit(const WaitingPair& pair) {
  const Part& now = part(pair.part);
  const Block &a = a_->blocks[pair.a], &b = b_->blocks[pair.b];
  const double most = std::min(now.time.end, stop_.time) - now.time.begin;
  NodeTimes times;
  // The boxes below a node are apart for as long as the node is.
  node_times(now.frames, a, b, pair.mask, std::max(0.0, pair.apart - now.time.begin), most, times);
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
  const double pieces = pieces_of(pair);
  for (double i = 0; i < pieces && stop_.triangle_a == kNoIndex; ++i) {
    span_ = piece_of_step(i, pieces);
    walk();
  }
  if (stop_.triangle_a != kNoIndex && !converged_) ++counters.unconverged;
  return stop_;
}

}  // namespace tandem::impact
