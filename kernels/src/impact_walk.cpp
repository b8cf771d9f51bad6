#include "impact_walk.h"

#include <algorithm>
#include <cmath>

#include "tandem/kernels/detail/impact/box_times.h"
#include "tandem/kernels/detail/impact/triangle_impact.h"

namespace tandem::impact {
namespace {

// A block pair whose nodes in the mask may meet, but not before `apart` from the walk's beginning on.
struct WaitingPair {
  std::uint32_t a, b, mask;
  double apart;
};

// Up to 16 of them, the soonest last.
class SortedPairs {
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

// A depth-first walk of two trees from a time on, the nodes that may meet soonest first.
class Walk {
 public:
  Walk(const PairMotion& pair, const LevelView& a, const LevelView& b, double tolerance,
       ImpactCounters& counters)
      : pair_(pair), a_(a), b_(b), tolerance_(tolerance), counters_(counters) {}

  // Result: the earliest stop in [begin, end], or a time of `end`.
  PairStop run(double begin, double end) {
    begin_ = begin;
    stop_ = {end};
    left_ = end - begin;
    place_ = place_at(pair_, begin);
    frames_ = pair_frames(pair_, place_, kAim * tolerance_);
    height_ = 0;
    push({0, 0, kAllNodePairs, 0});
    while (height_ > 0) {
      const WaitingPair pair = stack_[--height_];
      if (pair.apart < left_) visit(pair);
    }
    ++counters_.walks;
    return stop_;
  }

 private:
  // Each pair puts at most 16 on, whose depths' sum is higher by 1 at least, and is from 2 to 2 kMaxDepth.
  static constexpr std::uint32_t kStackSize = 16 * (2 * kMaxDepth - 2) + 1;

  void push(const WaitingPair& pair) { stack_[height_++] = pair; }

  void visit(const WaitingPair& pair) {
    const Block &a = a_.blocks[pair.a], &b = b_.blocks[pair.b];
    NodeTimes times;
    // What is below a node is apart for as long as the node is.
    node_times(frames_, a, b, pair.mask, pair.apart, left_, times);
    ++counters_.block_pairs;
    if (times.hits == 0) return;
    const bool leaves_a = a.is_leaf_block(), leaves_b = b.is_leaf_block();
    if (leaves_a && leaves_b) return advance_leaves(a, b, times);
    descend(pair, a, b, times,
            leaves_a != leaves_b ? descent_beside_leaves(leaves_a)
                                 : descent_by_size(size_of(a), size_of(b), kDescendsAlone));
  }

  void descend(const WaitingPair& pair, const Block& a, const Block& b, const NodeTimes& times,
               Descent descent) {
    SortedPairs below;
    if (descent == Descent::both) {
      for (std::uint32_t hits = times.hits; hits != 0; hits &= hits - 1) {
        const int bit = lowest_bit(hits);
        below.insert({a.index[bit / 4], b.index[bit % 4], kAllNodePairs, times.apart[bit]});
      }
    } else {
      for (int i = 0; i < kNodesPerBlock; ++i) {
        const bool of_a = descent == Descent::a_alone;
        const std::uint32_t hits = times.hits & (of_a ? 0xFu << 4 * i : 0x1111u << i);
        if (hits == 0) continue;
        double apart = left_;
        for (std::uint32_t rest = hits; rest != 0; rest &= rest - 1)
          apart = std::min(apart, times.apart[lowest_bit(rest)]);
        if (of_a) {
          below.insert({a.index[i], pair.b, (hits >> 4 * i) * 0x1111u, apart});
        } else {
          below.insert({pair.a, b.index[i], (hits >> i) * 0xFu, apart});
        }
      }
    }
    for (std::uint32_t i = 0; i < below.count(); ++i) push(below[i]);
  }

  void advance_leaves(const Block& a, const Block& b, const NodeTimes& times) {
    SortedPairs leaves;
    for (std::uint32_t hits = times.hits; hits != 0; hits &= hits - 1) {
      const int bit = lowest_bit(hits);
      leaves.insert({a.index[bit / 4], b.index[bit % 4], 0, times.apart[bit]});
    }
    for (std::uint32_t i = leaves.count(); i-- > 0 && leaves[i].apart < left_;) advance_pair(leaves[i]);
  }

  void advance_pair(const WaitingPair& leaf) {
    ++counters_.triangle_pairs;
    const MovingTriangles start = moving_triangles(pair_, a_.triangles[leaf.a], b_.triangles[leaf.b]);
    const TimeApart apart =
        time_apart_by_faces(pair_, triangles_at(pair_, start, place_), kAim * tolerance_);
    if (apart.time >= left_) return;
    const double from = begin_ + std::max(apart.nearly, leaf.apart);
    const TriangleStop stop = advance(pair_, start, from, stop_.time, tolerance_);
    ++counters_.advanced;
    counters_.steps += stop.steps;
    counters_.most_steps = std::max<std::uint64_t>(counters_.most_steps, stop.steps);
    if (stop.time >= stop_.time) return;
    unconverged_ = !stop.converged;
    stop_ = {stop.time, leaf.a, leaf.b};
    left_ = stop.time - begin_;
  }

 public:
  bool unconverged() const { return unconverged_; }

 private:
  const PairMotion& pair_;
  const LevelView &a_, &b_;
  double tolerance_;
  ImpactCounters& counters_;

  double begin_ = 0, left_ = 0;  // of the walk, and what is left of it before the earliest stop
  PairStop stop_ = {1};
  bool unconverged_ = false;
  PairPlace place_ = {};
  PairFrames frames_ = {};
  WaitingPair stack_[kStackSize];
  std::uint32_t height_ = 0;
};

}  // namespace

PairStop find_stop(const PairMotion& pair, const LevelView& a, const LevelView& b, double tolerance,
                   ImpactCounters& counters) {
  const double turn = std::max(pair.a->angle, pair.b->angle);
  const double walks = std::max(1.0, std::ceil(turn / kMostTurnOfWalk));
  Walk walk(pair, a, b, tolerance, counters);
  for (double i = 0; i < walks; ++i) {
    const PairStop stop = walk.run(i / walks, (i + 1) / walks);
    if (stop.triangle_a == kNoIndex) continue;
    if (walk.unconverged()) ++counters.unconverged;
    return stop;
  }
  return {1};
}

}  // namespace tandem::impact
