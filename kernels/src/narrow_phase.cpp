#include "narrow_phase.h"

#include "narrow_phase_walk.h"
#include "tandem/kernels/block_pair.h"
#include "tandem/kernels/frame_test.h"
#include "tandem/kernels/triangle_test.h"
#include "tandem/kernels/world_box.h"

namespace tandem {
namespace {

void append_one_by_one(Candidates& candidates, const Block& a, const Block& b, std::uint32_t hits) {
  for (; hits != 0; hits &= hits - 1) {
    const int bit = lowest_bit(hits);
    candidates.a[candidates.count] = a.index[bit / 4];
    candidates.b[candidates.count++] = b.index[bit % 4];
  }
}

frame::Point<float> corner_of(const Triangle& triangle, int corner) {
  const float* p = triangle.corner[corner].position;
  return {{p[0], p[1], p[2]}};
}

// The corners of a candidate in a's frame.
struct FramePair {
  frame::Point<float> a[3], b[3];

  FramePair(const PairTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b) {
    for (int corner = 0; corner < 3; ++corner) {
      a[corner] = corner_of(task.a->tree.triangles[triangle_a], corner);
      const frame::Point<float> stored = corner_of(task.b->tree.triangles[triangle_b], corner);
      for (int i = 0; i < 3; ++i) b[corner].x[i] = box_terms::posed_center(task.b_in_a, i, stored.x);
    }
  }
};

class ScalarMeans {
 public:
  using Stack = BlockPairStack;

  explicit ScalarMeans(const PairTask& task) : task_(task) {}

  std::uint32_t test(const Block& a, const Block& b) const { return block_pair_mask(a, b, task_.b_in_a); }
  void append(Candidates& candidates, const Block& a, const Block& b, std::uint32_t hits) const {
    append_one_by_one(candidates, a, b, hits);
  }
  BatchVerdicts decide(const Candidates& candidates) const {
    BatchVerdicts out = {0, 0};
    for (std::uint32_t i = 0; i < kBatch && i < candidates.count; ++i) {
      const FramePair pair(task_, candidates.a[i], candidates.b[i]);
      const frame::Verdicts<bool> verdicts = task_.mode == QueryMode::fast
                                                 ? frame::decide<false>(pair.a, pair.b, 0.0f)
                                                 : frame::decide<true>(pair.a, pair.b, task_.frame_error);
      out.contact |= static_cast<std::uint32_t>(verdicts.contact) << i;
      out.undecided |= static_cast<std::uint32_t>(verdicts.undecided) << i;
    }
    return out;
  }

 private:
  const PairTask& task_;
};

// The end of a node's box rounds to a float64 that no corner within the box lies beyond: corners are float32,
// and rounding is monotone.
WorldBox world_box_of(const Pose& pose, const Block& block, int node) {
  double lower[3], upper[3];
  for (int k = 0; k < 3; ++k) {
    const double center = block.center[k][node], half_extent = block.half_extent[k][node];
    lower[k] = center - half_extent;
    upper[k] = center + half_extent;
  }
  return world_box(pose, lower, upper);
}

class WorldBoxMeans {
 public:
  using Stack = BlockPairStack;

  explicit WorldBoxMeans(const PairTask& task) : task_(task) {}

  std::uint32_t test(const Block& a, const Block& b) const {
    std::uint32_t mask = 0;
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (a.kind[i] == NodeKind::imaginary) continue;
      const WorldBox box_a = world_box_of(task_.a->pose, a, i);
      for (int j = 0; j < kNodesPerBlock; ++j) {
        if (b.kind[j] == NodeKind::imaginary) continue;
        if (overlap(box_a, world_box_of(task_.b->pose, b, j))) mask |= 1u << (4 * i + j);
      }
    }
    return mask;
  }
  void append(Candidates& candidates, const Block& a, const Block& b, std::uint32_t hits) const {
    append_one_by_one(candidates, a, b, hits);
  }
  BatchVerdicts decide(const Candidates&) const { return {0, 0xFFFF}; }

 private:
  const PairTask& task_;
};

TrianglePair posed_pair(const PairTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b) {
  TrianglePair pair;
  for (int corner = 0; corner < 3; ++corner) {
    const float* p = task.a->tree.triangles[triangle_a].corner[corner].position;
    const float* q = task.b->tree.triangles[triangle_b].corner[corner].position;
    apply(task.a->pose, p[0], p[1], p[2], pair.a[corner]);
    apply(task.b->pose, q[0], q[1], q[2], pair.b[corner]);
  }
  return pair;
}

TrianglePair framed_pair(const PairTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b) {
  const FramePair framed(task, triangle_a, triangle_b);
  TrianglePair pair;
  for (int corner = 0; corner < 3; ++corner) {
    for (int k = 0; k < 3; ++k) {
      pair.a[corner][k] = static_cast<double>(framed.a[corner].x[k]);
      pair.b[corner][k] = static_cast<double>(framed.b[corner].x[k]);
    }
  }
  return pair;
}

}  // namespace

bool meet(const PairTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b, QueryCounters& counters) {
  if (task.mode == QueryMode::fast && task.in_frame) {
    ++counters.decided_by_float32;
    return decide_fast(framed_pair(task, triangle_a, triangle_b)) == Verdict::contact;
  }
  const Decision decision = decide(posed_pair(task, triangle_a, triangle_b));
  ++(decision.exactly ? counters.decided_exactly : counters.decided_by_float64);
  return decision.verdict == Verdict::contact;
}

bool narrow_phase_scalar(const PairTask& task, ContactSink& sink) {
  return PairWalk<ScalarMeans>(task, sink).run();
}

bool narrow_phase_by_world_boxes(const PairTask& task, ContactSink& sink) {
  return PairWalk<WorldBoxMeans>(task, sink).run();
}

NarrowPhase narrow_phase(BlockPairVariant variant) {
  if (block_pair_test(variant) == nullptr) return nullptr;
  switch (variant) {
    case BlockPairVariant::scalar:
      return narrow_phase_scalar;
#ifdef TANDEM_HAVE_LANES
    case BlockPairVariant::lanes4:
      return narrow_phase_lanes4;
#ifdef __x86_64__
    case BlockPairVariant::avx2:
      return narrow_phase_avx2;
    case BlockPairVariant::avx512:
      return narrow_phase_avx512;
#endif
#endif
    default:
      return nullptr;
  }
}

}  // namespace tandem
