#pragma once
#include "narrow_phase.h"
#include "tandem/kernels/detail/traversal.h"

// The walk that all variants of the narrow phase share. Included by files that are compiled for different
// machines: internal linkage, see lanes.h.
namespace tandem {
namespace {

constexpr std::uint32_t kBatch = 16;

/// Candidates that wait until there are kBatch of them. The room above is for one more pair of leaf blocks,
/// written in whole vectors.
struct Candidates {
  alignas(64) std::uint32_t a[2 * kBatch];
  alignas(64) std::uint32_t b[2 * kBatch];
  std::uint32_t count = 0;

  /// Forgets the first batch.
  void drop_batch() {
    count -= kBatch;
    for (std::uint32_t i = 0; i < kBatch; ++i) {
      a[i] = a[kBatch + i];
      b[i] = b[kBatch + i];
    }
  }
};

/// Bits of a batch.
struct BatchVerdicts {
  std::uint32_t contact, undecided;
};

/// The node pairs of node i of a.
constexpr std::uint32_t row(std::uint32_t four, int i) {
  return four << 4 * i;
}

/// The node pairs of node j of b.
constexpr std::uint32_t column(std::uint32_t four, int j) {
  return ((four & 1u) | (four & 2u) << 3 | (four & 4u) << 6 | (four & 8u) << 9) << j;
}

/// The means of a variant are made of a task and bring: Stack; test(a, b), see block_pair_mask();
/// drop_beyond_planes(a, b, hits), of a leaf block and an internal one: less the hits of nodes that lie
/// beyond the plane of the triangle, see frame::beyond(); append(candidates, a, b, hits); decide(candidates),
/// the verdicts on the first kBatch candidates, any where there are fewer.
template <typename Means>
class PairWalk {
 public:
  PairWalk(const PairTask& task, ContactSink& sink) : task_(task), sink_(sink), means_(task) {}

  bool run() {
    const auto test = [this](const Block& a, const Block& b) -> std::uint32_t {
      const std::uint32_t hits = means_.test(a, b);
      if (!task_.self || &a != &b) return hits;
      return hits & (a.is_leaf_block() ? kNodePairsAbove : kNodePairsAbove | kNodePairsEqual);
    };
    const auto on_leaves = [this](const Block& a, const Block& b, std::uint32_t hits) {
      means_.append(candidates_, a, b, hits);
      return candidates_.count < kBatch || settle(kBatch);
    };
    const auto narrow = [this](const Block& a, const Block& b, std::uint32_t hits) {
      return worth_planes(a, b) ? means_.drop_beyond_planes(a, b, hits) : hits;
    };
    sink_.counters.block_pairs +=
        traverse<typename Means::Stack>(task_.a->tree, task_.b->tree, test, on_leaves, narrow);
    if (!done_ && candidates_.count > 0) settle(candidates_.count);
    return enough_memory_;
  }

 private:
  // A triangle's plane tells more than its box where the other mesh's nodes are much smaller: under bodies of
  // 24,000 triangles on a ground it spares 40 % of the block pairs and 60 % of the candidates
  // (docs/decisions/0014). The candidates of boxes mode are what boxes say.
  bool worth_planes(const Block& a, const Block& b) const {
    constexpr float kTimesLarger = 4;
    if (task_.mode == QueryMode::boxes) return false;
    const float size_a = size_of(a), size_b = size_of(b);
    return a.is_leaf_block() ? size_a > kTimesLarger * size_b : size_b > kTimesLarger * size_a;
  }

  /// Decides the first `count` candidates. False: the pair is done with.
  bool settle(std::uint32_t count) {
    QueryCounters& counters = sink_.counters;
    const std::uint32_t given = (2u << (count - 1)) - 1;
    BatchVerdicts verdicts = {given, 0};
    if (task_.mode != QueryMode::boxes) {
      verdicts = means_.decide(candidates_);
      verdicts.contact &= given;
      verdicts.undecided &= given;
    }
    std::uint32_t considered = given;
    for (std::uint32_t open = verdicts.contact | verdicts.undecided; open != 0 && !done_; open &= open - 1) {
      const int i = lowest_bit(open);
      const std::uint32_t a = candidates_.a[i], b = candidates_.b[i];
      if ((verdicts.undecided >> i & 1u) != 0 && !meet(task_, a, b, counters)) continue;
      add(a, b);
      if (done_) considered = (2u << i) - 1;  // what comes after the first contact does not count
    }
    counters.candidates += static_cast<std::uint32_t>(std::popcount(considered));
    if (task_.mode != QueryMode::boxes) {
      counters.decided_by_float32 +=
          static_cast<std::uint32_t>(std::popcount(considered & ~verdicts.undecided));
    }
    if (candidates_.count > kBatch)
      candidates_.drop_batch();
    else
      candidates_.count = 0;
    return !done_;
  }

  void add(std::uint32_t a, std::uint32_t b) {
    if (task_.self && a > b) {
      const std::uint32_t lower = b;
      b = a;
      a = lower;
    }
    if (sink_.next == sink_.end && !sink_.grow(sink_)) {
      enough_memory_ = false;
      done_ = true;
      return;
    }
    *sink_.next++ = {task_.pair, a, b, task_.a->tree.triangles[a].corner[0].w,
                     task_.b->tree.triangles[b].corner[0].w};
    ++sink_.counters.contacts;
    done_ = task_.first_contact_only;
  }

  const PairTask& task_;
  ContactSink& sink_;
  const Means means_;
  Candidates candidates_;
  bool done_ = false, enough_memory_ = true;
};

}  // namespace
}  // namespace tandem
