#include "kernels/contact/narrow_phase.h"

#include "kernels/common/block_pair.h"
#include "kernels/contact/candidate.h"
#include "kernels/contact/narrow_phase_walk.h"
#include "kernels/geometry/clearance.h"

namespace tandem {
namespace {

void append_one_by_one(Candidates& candidates, const Block& a, const Block& b, std::uint32_t hits) {
  for (; hits != 0; hits &= hits - 1) {
    const int bit = lowest_bit(hits);
    candidates.a[candidates.count] = a.index[bit / 4];
    candidates.b[candidates.count++] = b.index[bit % 4];
  }
}

class ScalarMeans {
 public:
  using Stack = BlockPairStack;

  explicit ScalarMeans(const PairTask& task) : task_(task) {}

  std::uint32_t test(const Block& a, const Block& b) const { return block_pair_mask(a, b, task_.b_in_a); }
  std::uint32_t drop_beyond_planes(const Block& a, const Block& b, std::uint32_t hits) const {
    return tandem::drop_beyond_planes(a, b, hits, task_.a->tree.triangles, task_.b->tree.triangles,
                                      task_.b_in_a, task_.frame_error);
  }
  void append(Candidates& candidates, const Block& a, const Block& b, std::uint32_t hits) const {
    append_one_by_one(candidates, a, b, hits);
  }
  BatchSifted sift(const Candidates& candidates) const {
    BatchSifted out = {0, 0};
    for (std::uint32_t i = 0; i < kBatch && i < candidates.count; ++i) {
      const auto [a, b] = corners(candidates, i);
      const auto sifted = distance::sift(a.corner, b.corner, task_.clearance, task_.first_contact_only);
      out.beyond |= static_cast<std::uint32_t>(sifted.beyond.set) << i;
      out.within |= static_cast<std::uint32_t>(sifted.within.set) << i;
    }
    return out;
  }
  BatchVerdicts decide_within(const Candidates& candidates) const {
    BatchVerdicts out = {0, 0};
    for (std::uint32_t i = 0; i < kBatch && i < candidates.count; ++i) {
      const auto [a, b] = corners(candidates, i);
      const auto verdicts = distance::decide_within(a.corner, b.corner, task_.clearance);
      out.contact |= static_cast<std::uint32_t>(verdicts.contact.set) << i;
      out.undecided |= static_cast<std::uint32_t>(verdicts.undecided.set) << i;
    }
    return out;
  }
  BatchVerdicts decide(const Candidates& candidates) const {
    if (task_.on_grid) return decide_batch<FirstStage::on_grid>(candidates);
    return task_.mode == QueryMode::fast ? decide_batch<FirstStage::as_computed>(candidates)
                                         : decide_batch<FirstStage::bounded>(candidates);
  }

 private:
  struct Corners {
    TriangleInFrame a, b;
  };
  Corners corners(const Candidates& candidates, std::uint32_t i) const {
    return {stored_triangle(task_.a->tree.triangles[candidates.a[i]]),
            posed_triangle(task_.b_in_a, task_.b->tree.triangles[candidates.b[i]])};
  }

  template <FirstStage kStage>
  BatchVerdicts decide_batch(const Candidates& candidates) const {
    BatchVerdicts out = {0, 0};
    for (std::uint32_t i = 0; i < kBatch && i < candidates.count; ++i) {
      const auto [a, b] = corners(candidates, i);
      const auto verdicts = decide_first<kStage>(a.corner, b.corner, task_.frame_error);
      out.contact |= static_cast<std::uint32_t>(verdicts.contact.set) << i;
      out.undecided |= static_cast<std::uint32_t>(verdicts.undecided.set) << i;
    }
    return out;
  }

  const PairTask& task_;
};

class WorldBoxMeans {
 public:
  using Stack = BlockPairStack;

  explicit WorldBoxMeans(const PairTask& task) : task_(task) {}

  std::uint32_t test(const Block& a, const Block& b) const {
    return world_block_pair_mask(task_.a->pose, a, task_.b->pose, b, task_.within);
  }
  void append(Candidates& candidates, const Block& a, const Block& b, std::uint32_t hits) const {
    append_one_by_one(candidates, a, b, hits);
  }
  std::uint32_t drop_beyond_planes(const Block&, const Block&, std::uint32_t hits) const { return hits; }
  BatchVerdicts decide(const Candidates&) const { return {0, 0xFFFF}; }
  BatchSifted sift(const Candidates&) const { return {0, 0}; }
  BatchVerdicts decide_within(const Candidates&) const { return {0, 0xFFFF}; }

 private:
  const PairTask& task_;
};

bool are_within(const PairTask& task, const TrianglePair& pair, ContactCounters& counters) {
  const Verdict verdict = distance::decide_within_float64(pair, task.within);
  const bool exactly = verdict == Verdict::undecided;
  ++(exactly ? counters.decided_exactly : counters.decided_by_float64);
  if (!exactly) return verdict == Verdict::contact;
  return decide_exact(pair) == Verdict::contact || exact::are_within(pair, task.within);
}

bool narrow_phase_scalar(const PairTask& task, ContactSink& sink) {
  return PairWalk<ScalarMeans, true>(task, sink).run();
}

}  // namespace

PairTask pair_task(const PosedTree& a, const PosedTree& b, double within) {
  PairTask task;
  task.a = &a;
  task.b = &b;
  task.self = &a == &b;
  task.within = within;
  task.in_frame = relative_pose(a.pose, a.extent, b.pose, b.extent, task.b_in_a) == RelativePoseStatus::kOk;
  if (!task.in_frame) return task;
  task.frame_error = frame_error(task.b_in_a, a.extent, b.extent);
  if (within > 0)
    task.in_frame =
        distance::ask_for_clearance(a.pose, within, task.b_in_a, task.frame_error, task.clearance);
  else
    task.on_grid = lie_on_grid(a.pose, a.extent, a.grid, b.pose, b.extent, b.grid, task.b_in_a);
  return task;
}

bool meet(const PairTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b,
          ContactCounters& counters) {
  const LevelView &a = task.a->tree, &b = task.b->tree;
  if (task.mode == QueryMode::fast && task.in_frame && !(task.within > 0)) {
    ++counters.decided_by_float32;
    return decide_fast(framed_pair(task.b_in_a, a.triangles[triangle_a], b.triangles[triangle_b])) ==
           Verdict::contact;
  }
  const TrianglePair pair = posed_pair(task.a->pose, a, triangle_a, task.b->pose, b, triangle_b);
  if (task.within > 0) return are_within(task, pair, counters);
  const Verdict verdict = decide_float64(pair);
  const bool exactly = verdict == Verdict::undecided;
  ++(exactly ? counters.decided_exactly : counters.decided_by_float64);
  return (exactly ? decide_exact(pair) : verdict) == Verdict::contact;
}

bool narrow_phase_by_world_boxes(const PairTask& task, ContactSink& sink) {
  return PairWalk<WorldBoxMeans, true>(task, sink).run();
}

NarrowPhase narrow_phase(BlockPairVariant variant) {
  return way_of(variant, narrow_phase_scalar, &LaneVariant::narrow_phase);
}

NarrowPhase narrow_phase_without_neighbours(BlockPairVariant variant) {
  return way_of(variant, narrow_phase_scalar, &LaneVariant::narrow_phase_without_neighbours);
}

}  // namespace tandem
