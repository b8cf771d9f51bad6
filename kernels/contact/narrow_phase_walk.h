#pragma once
#include "kernels/contact/candidate.h"
#include "kernels/contact/narrow_phase.h"
#include "kernels/contact/neighbours.h"
#include "kernels/geometry/grid_test.h"

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

/// The outcome of the first step of clearance for a batch, see distance::sift().
struct BatchSifted {
  std::uint32_t beyond, within;
};

/// Says what the first stage of the triangle test does with the candidates of a pair.
enum class FirstStage : std::uint8_t {
  bounded,      ///< float32 with an error bound
  as_computed,  ///< float32, rounding ignored: mode fast
  on_grid,      ///< float32 that rounds nothing: grid_test.h
};

template <FirstStage kStage, typename Value>
inline auto decide_first(const frame::Point<Value> (&a)[3], const frame::Point<Value> (&b)[3], float error) {
  if constexpr (kStage == FirstStage::on_grid)
    return frame::decide_on_grid(a, b);
  else
    return frame::decide<kStage == FirstStage::bounded>(a, b, error);
}

/// The node pairs of node i of a.
constexpr std::uint32_t row(std::uint32_t four, int i) {
  return four << 4 * i;
}

/// The node pairs of node j of b.
constexpr std::uint32_t column(std::uint32_t four, int j) {
  return ((four & 1u) | (four & 2u) << 3 | (four & 4u) << 6 | (four & 8u) << 9) << j;
}

/// The means of a variant are made of a task and bring: Stack; test(a, b), see block_pair_mask();
/// drop_beyond_planes(a, b, hits), see leaf_planes.h; append(candidates, a, b, hits); decide(candidates),
/// the verdicts on the first kBatch candidates, any where there are fewer; and of clearance, as it is dearer,
/// in two steps: sift(candidates), and decide_within(candidates) on those that it leaves.
///
/// kWithoutNeighbours: neighbours are left out as soon as their leaf blocks meet, which takes less than any
/// test of two triangles. Other walks are compiled without this question.
template <typename Means, bool kWithoutNeighbours = false>
class PairWalk {
 public:
  PairWalk(const PairTask& task, ContactSink& sink) : task_(task), sink_(sink), means_(task) {}

  bool run() {
    const auto test = [this](const Block& a, const Block& b) -> std::uint32_t {
      const std::uint32_t hits = means_.test(a, b);
      return task_.self && &a == &b ? hits & own_node_pairs(a.is_leaf_block()) : hits;
    };
    const auto on_leaves = [this](const Block& a, const Block& b, std::uint32_t hits) {
      if constexpr (kWithoutNeighbours) {
        if (task_.neighbours != nullptr)
          hits = drop_neighbours(*task_.neighbours, a.index[0], b.index[0], hits);
      }
      means_.append(candidates_, a, b, hits);
      return candidates_.count < kBatch || settle(kBatch);
    };
    const auto narrow = [this](const Block& a, const Block& b, std::uint32_t hits) {
      // The candidates of boxes mode are what boxes say.
      const bool try_planes =
          task_.mode != QueryMode::boxes && worth_planes(a.is_leaf_block(), size_of(a), size_of(b));
      return try_planes ? means_.drop_beyond_planes(a, b, hits) : hits;
    };
    sink_.counters.block_pairs +=
        traverse<typename Means::Stack>(task_.a->tree.blocks, task_.b->tree.blocks, test, on_leaves, narrow);
    if (!done_ && candidates_.count > 0) settle(candidates_.count);
    if (!done_ && near_.count > 0) settle_near(near_.count);
    return enough_memory_;
  }

 private:
  /// Adds those of the first `count` candidates that are surely within, and keeps those that may be. False:
  /// the pair is done with. It is not inlined, as settle_near() is not, so as not to crowd the walk that is
  /// for contacts.
  [[gnu::noinline]] bool sift(std::uint32_t count) {
    const std::uint32_t given = (2u << (count - 1)) - 1;
    const BatchSifted sifted = means_.sift(candidates_);
    const std::uint32_t told = (sifted.beyond | sifted.within) & given;
    sink_.counters.candidates += count;
    sink_.counters.decided_by_float32 += static_cast<std::uint32_t>(std::popcount(told));
    for (std::uint32_t left = given & ~sifted.beyond; left != 0 && !done_; left &= left - 1) {
      const int i = lowest_bit(left);
      if ((sifted.within >> i & 1u) != 0) {
        add(candidates_.a[i], candidates_.b[i]);
        continue;
      }
      near_.a[near_.count] = candidates_.a[i];
      near_.b[near_.count++] = candidates_.b[i];
    }
    drop_batch(candidates_);
    sifted_ += count;
    if (sifted_ >= task_.most_candidates && !done_) give_up();
    return !done_ && (near_.count < kBatch || settle_near(kBatch));
  }

  /// Ends the walk, and leaves what may be within to the next.
  void give_up() {
    sink_.counters.candidates -= near_.count;
    near_.count = 0;
    sink_.gave_up = done_ = true;
  }

  /// Decides the first `count` that may be within. False: the pair is done with.
  [[gnu::noinline]] bool settle_near(std::uint32_t count) {
    const std::uint32_t given = (2u << (count - 1)) - 1;
    BatchVerdicts verdicts = means_.decide_within(near_);
    verdicts.contact &= given;
    verdicts.undecided &= given;
    for (std::uint32_t open = verdicts.contact | verdicts.undecided; open != 0 && !done_; open &= open - 1) {
      const int i = lowest_bit(open);
      const std::uint32_t a = near_.a[i], b = near_.b[i];
      if ((verdicts.undecided >> i & 1u) == 0 || meet(task_, a, b, sink_.counters)) add(a, b);
    }
    sink_.counters.decided_by_float32 +=
        static_cast<std::uint32_t>(std::popcount(given & ~verdicts.undecided));
    drop_batch(near_);
    return !done_;
  }

  static void drop_batch(Candidates& candidates) {
    if (candidates.count > kBatch)
      candidates.drop_batch();
    else
      candidates.count = 0;
  }

  /// Decides the first `count` candidates. False: the pair is done with.
  bool settle(std::uint32_t count) {
    if (task_.within > 0 && task_.mode != QueryMode::boxes) [[unlikely]]
      return sift(count);
    ContactCounters& counters = sink_.counters;
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
    drop_batch(candidates_);
    return !done_;
  }

  void add(std::uint32_t a, std::uint32_t b) {
    if (sink_.next == sink_.end && !sink_.grow(sink_)) {
      enough_memory_ = false;
      done_ = true;
      return;
    }
    const std::uint32_t face_a = task_.a->tree.triangles[a].source_face(),
                        face_b = task_.b->tree.triangles[b].source_face();
    // Two calls: one would have GCC compare and exchange for every contact.
    if (task_.self) [[unlikely]]
      *sink_.next = make_contact(task_.pair, true, a, b, face_a, face_b);
    else
      *sink_.next = make_contact(task_.pair, false, a, b, face_a, face_b);
    ++sink_.next;
    ++sink_.counters.contacts;
    done_ = task_.first_contact_only;
  }

  const PairTask& task_;
  ContactSink& sink_;
  const Means means_;
  Candidates candidates_;
  Candidates near_;  ///< of clearance, what may be within
  std::uint64_t sifted_ = 0;
  bool done_ = false, enough_memory_ = true;
};

}  // namespace
}  // namespace tandem
