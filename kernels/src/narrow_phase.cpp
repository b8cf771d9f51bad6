#include "narrow_phase.h"

#include <algorithm>

#include "narrow_phase_walk.h"
#include "tandem/kernels/detail/block_pair.h"
#include "tandem/kernels/detail/frame_test.h"
#include "tandem/kernels/detail/triangle_test.h"
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

// A triangle in a's frame: one of a as it is stored, one of b as its image.
struct FramedTriangle {
  frame::Point<float> corner[3];

  explicit FramedTriangle(const Triangle& triangle) {
    for (int i = 0; i < 3; ++i) std::copy_n(triangle.corner[i].position, 3, corner[i].x);
  }
  FramedTriangle(const Triangle& triangle, const RelativePose& b_in_a) {
    const FramedTriangle stored(triangle);
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) corner[i].x[k] = box_terms::posed_center(b_in_a, k, stored.corner[i].x);
    }
  }
};

class ScalarMeans {
 public:
  using Stack = BlockPairStack;

  explicit ScalarMeans(const PairTask& task) : task_(task) {}

  std::uint32_t test(const Block& a, const Block& b) const { return block_pair_mask(a, b, task_.b_in_a); }
  std::uint32_t drop_beyond_planes(const Block& a, const Block& b, std::uint32_t hits) const {
    const bool leaves_a = a.is_leaf_block();
    std::uint32_t left = hits;
    for (; hits != 0; hits &= hits - 1) {
      const int bit = lowest_bit(hits), i = bit / 4, j = bit % 4;
      if (leaves_a ? is_beyond(triangle_of_a(a.index[i]), box_of_b(b, j))
                   : is_beyond(triangle_of_b(b.index[j]), box_of(a, i))) {
        left &= ~(1u << bit);
      }
    }
    return left;
  }
  void append(Candidates& candidates, const Block& a, const Block& b, std::uint32_t hits) const {
    append_one_by_one(candidates, a, b, hits);
  }
  BatchVerdicts decide(const Candidates& candidates) const {
    BatchVerdicts out = {0, 0};
    for (std::uint32_t i = 0; i < kBatch && i < candidates.count; ++i) {
      const FramedTriangle a = triangle_of_a(candidates.a[i]), b = triangle_of_b(candidates.b[i]);
      const auto verdicts = task_.mode == QueryMode::fast
                                ? frame::decide<false>(a.corner, b.corner, 0.0f)
                                : frame::decide<true>(a.corner, b.corner, task_.frame_error);
      out.contact |= static_cast<std::uint32_t>(verdicts.contact.set) << i;
      out.undecided |= static_cast<std::uint32_t>(verdicts.undecided.set) << i;
    }
    return out;
  }

 private:
  FramedTriangle triangle_of_a(std::uint32_t triangle) const {
    return FramedTriangle(task_.a->tree.triangles[triangle]);
  }
  FramedTriangle triangle_of_b(std::uint32_t triangle) const {
    return FramedTriangle(task_.b->tree.triangles[triangle], task_.b_in_a);
  }
  Box box_of_b(const Block& b, int node) const {
    const Box stored = box_of(b, node);
    Box framed;
    for (int k = 0; k < 3; ++k) {
      framed.center[k] = box_terms::posed_center(task_.b_in_a, k, stored.center);
      framed.half_extent[k] = box_terms::b_on_face(task_.b_in_a, k, stored.half_extent);
    }
    return framed;
  }
  bool is_beyond(const FramedTriangle& t, const Box& box) const {
    const frame::Plane<float, true> plane(t.corner[0], t.corner[1], t.corner[2], task_.frame_error);
    return frame::beyond(plane, box.center, box.half_extent, task_.frame_error);
  }

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
  std::uint32_t drop_beyond_planes(const Block&, const Block&, std::uint32_t hits) const { return hits; }
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
  const FramedTriangle a(task.a->tree.triangles[triangle_a]);
  const FramedTriangle b(task.b->tree.triangles[triangle_b], task.b_in_a);
  TrianglePair pair;
  for (int corner = 0; corner < 3; ++corner) {
    for (int k = 0; k < 3; ++k) {
      pair.a[corner][k] = static_cast<double>(a.corner[corner].x[k]);
      pair.b[corner][k] = static_cast<double>(b.corner[corner].x[k]);
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
#ifdef TANDEM_X86_LANES
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
