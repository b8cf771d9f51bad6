#include "kernels/contact/first_within.h"

#include <algorithm>
#include <cmath>

#include "kernels/contact/candidate.h"
#include "kernels/contact/pairs_below.h"
#include "kernels/geometry/box_distance.h"
#include "kernels/geometry/frame_distance.h"

namespace tandem {
namespace {

class FirstWithin {
 public:
  FirstWithin(const PairTask& task, ContactSink& sink, Buffer<NearBlockPair>& waiting)
      : task_(task), counters_(sink.counters), sink_(sink), waiting_(waiting) {}

  bool run() {
    // Not that of the task, which has the distance as an error of positions; there is one wherever that is.
    (void)distance_frame(task_.a->pose, task_.a->extent, task_.b->pose, task_.b->extent, frame_);
    clearance_ = distance::frame_clearance(frame_, task_.within);
    limit_ = distance::limit_of(frame_, std::nextafter(task_.within, INFINITY));
    waiting_.clear();
    push({0, 0, 0, kAllNodePairs});
    while (waiting_.size() > 0 && !found_ && enough_memory_) visit(pop());
    return enough_memory_;
  }

 private:
  static bool is_farther(const NearBlockPair& x, const NearBlockPair& y) { return x.bound > y.bound; }

  void push(const NearBlockPair& pair) {
    enough_memory_ = enough_memory_ && waiting_.push(pair);
    if (enough_memory_) std::push_heap(waiting_.data(), waiting_.data() + waiting_.size(), is_farther);
  }

  NearBlockPair pop() {
    std::pop_heap(waiting_.data(), waiting_.data() + waiting_.size(), is_farther);
    const NearBlockPair nearest = waiting_[waiting_.size() - 1];
    (void)waiting_.resize(waiting_.size() - 1);
    return nearest;
  }

  void visit(const NearBlockPair& pair) {
    const Block &a = task_.a->tree.blocks[pair.a], &b = task_.b->tree.blocks[pair.b];
    float bound[16];
    std::uint32_t hits = 0;
    for (std::uint32_t left = pair.mask; left != 0; left &= left - 1) {
      const int bit = lowest_bit(left);
      bound[bit] = box_distance_bound(box_of(a, bit / 4), box_of(b, bit % 4), frame_.b_in_a);
      if (bound[bit] < limit_) hits |= 1u << bit;
    }
    ++counters_.block_pairs;
    if (hits == 0) return;
    if (a.is_leaf_block() && b.is_leaf_block()) return take_leaves(a, b, hits);
    each_pair_below(
        a, b, hits, bound,
        [&](float least, const std::uint32_t* child_a, const std::uint32_t* child_b, std::uint32_t mask) {
          push({least, child_a != nullptr ? *child_a : pair.a, child_b != nullptr ? *child_b : pair.b, mask});
        });
  }

  void take_leaves(const Block& a, const Block& b, std::uint32_t hits) {
    for (; hits != 0 && !found_; hits &= hits - 1) {
      const int bit = lowest_bit(hits);
      const std::uint32_t triangle_a = a.index[bit / 4], triangle_b = b.index[bit % 4];
      ++counters_.candidates;
      if (!are_within(triangle_a, triangle_b)) continue;
      found_ = true;
      add(triangle_a, triangle_b);
    }
  }

  void add(std::uint32_t a, std::uint32_t b) {
    enough_memory_ = sink_.next < sink_.end || sink_.grow(sink_);
    if (!enough_memory_) return;
    *sink_.next++ = make_contact(task_.pair, false, a, b, task_.a->tree.triangles[a].source_face(),
                                 task_.b->tree.triangles[b].source_face());
    ++counters_.contacts;
  }

  // Pairs are decided by the steps of narrow_phase_walk.h.
  bool are_within(std::uint32_t a, std::uint32_t b) {
    const TriangleInFrame x = stored_triangle(task_.a->tree.triangles[a]),
                          y = posed_triangle(frame_.b_in_a, task_.b->tree.triangles[b]);
    const auto sifted = distance::sift(x.corner, y.corner, clearance_, false);
    bool within = sifted.within.set;
    if (!within && !sifted.beyond.set) {
      const auto verdicts = distance::decide_within(x.corner, y.corner, clearance_);
      if (verdicts.undecided.set) return meet(task_, a, b, counters_);
      within = verdicts.contact.set;
    }
    ++counters_.decided_by_float32;
    return within;
  }

  const PairTask& task_;
  ContactCounters& counters_;
  ContactSink& sink_;
  Buffer<NearBlockPair>& waiting_;
  DistanceFrame frame_ = {};
  distance::FrameClearance clearance_;
  float limit_ = 0;
  bool found_ = false, enough_memory_ = true;
};

}  // namespace

bool find_first_within(const PairTask& task, ContactSink& sink, Buffer<NearBlockPair>& waiting) {
  return FirstWithin(task, sink, waiting).run();
}

}  // namespace tandem
