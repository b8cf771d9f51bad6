#include "kernels/distance/nearest_phase.h"

#include <algorithm>

#include "kernels/contact/candidate.h"
#include "kernels/distance/nearest_walk.h"
#include "kernels/geometry/frame_distance.h"

namespace tandem {
namespace {

template <typename Bound>
void add_if_below(int bit, Bound bound, Bound limit, Bound other, PairsBelow& below) {
  if (bound < limit) below.limit |= 1u << bit;
  if (bound < other) below.other |= 1u << bit;
}

class NearestScalarMeans {
 public:
  using Bound = float;

  explicit NearestScalarMeans(const NearestTask& task) : task_(task) {}

  float limit(double distance) const { return bound_limit(task_, distance); }
  double distance(float bound) const { return bound_distance(task_, bound); }

  PairsBelow bounds(const Block& a, const Block& b, float limit, float other, float* out) const {
    PairsBelow below = {0, 0};
    for (int i = 0; i < kNodesPerBlock; ++i) {
      for (int j = 0; j < kNodesPerBlock; ++j) {
        const int bit = 4 * i + j;
        out[bit] = box_distance_bound(box_of(a, i), box_of(b, j), task_.frame.b_in_a);
        add_if_below(bit, out[bit], limit, other, below);
      }
    }
    return below;
  }

  std::uint32_t far_along(const NearBatch& batch, const float (&direction)[3], double at_least) const {
    const distance::FrameDirection along = direction_of(task_, direction, at_least);
    std::uint32_t mask = 0;
    for (std::uint32_t i = 0; i < kNearBatch && i < batch.count; ++i) {
      const auto [a, b] = corners(batch, i);
      if (distance::is_far_along(a.corner, b.corner, along)) mask |= 1u << i;
    }
    return mask;
  }

  void bound(const NearBatch& batch, BoundedBatch& out) const {
    const DistanceFrame& frame = task_.frame;
    for (std::uint32_t i = 0; i < kNearBatch && i < batch.count; ++i) {
      const auto [a, b] = corners(batch, i);
      const auto interval = distance::frame_interval(a.corner, b.corner, frame.error);
      out.lower[i] = static_cast<double>(interval.lower) * frame.least_in_world;
      out.upper[i] = static_cast<double>(interval.upper) * frame.most_in_world;
      for (int k = 0; k < 3; ++k) out.along[k][i] = interval.along.x[k];
    }
  }

 private:
  struct Corners {
    TriangleInFrame a, b;
  };
  Corners corners(const NearBatch& batch, std::uint32_t i) const {
    return {stored_triangle(task_.a->tree.triangles[batch.a[i]]),
            posed_triangle(task_.frame.b_in_a, task_.b->tree.triangles[batch.b[i]])};
  }

  const NearestTask& task_;
};

class NearestWorldBoxMeans {
 public:
  using Bound = double;

  explicit NearestWorldBoxMeans(const NearestTask& task) : task_(task) {}

  double limit(double distance) const { return distance; }
  double distance(double bound) const { return bound; }

  PairsBelow bounds(const Block& a, const Block& b, double limit, double other, double* out) const {
    PairsBelow below = {0, 0};
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (a.kind[i] == NodeKind::imaginary) continue;
      const WorldBox box_a = node_world_box(task_.a->pose, a, i);
      for (int j = 0; j < kNodesPerBlock; ++j) {
        if (b.kind[j] == NodeKind::imaginary) continue;
        const WorldBox box_b = node_world_box(task_.b->pose, b, j);
        const int bit = 4 * i + j;
        out[bit] = distance_between(box_a, box_b);
        add_if_below(bit, out[bit], limit, other, below);
      }
    }
    return below;
  }

  std::uint32_t far_along(const NearBatch&, const float (&)[3], double) const { return 0; }

  /// Bounds nothing, so that all are settled.
  void bound(const NearBatch&, BoundedBatch& out) const {
    std::fill_n(out.lower, kNearBatch, 0.0);
    std::fill_n(out.upper, kNearBatch, INFINITY);
  }

 private:
  const NearestTask& task_;
};

}  // namespace

NearestTask nearest_task(const PosedTree& a, const PosedTree& b, const DistanceTolerance& tolerance) {
  NearestTask task;
  task.a = &a;
  task.b = &b;
  task.tolerance = tolerance;
  task.in_frame = distance_frame(a.pose, a.extent, b.pose, b.extent, task.frame);
  return task;
}

double nearness(const NearestTask& task, const NearestSoFar& state) {
  return state.found ? nearness_below(task.tolerance, state.upper) : state.upper;
}

float bound_limit(const NearestTask& task, double distance) {
  return distance::limit_of(task.frame, distance);
}

double bound_distance(const NearestTask& task, float bound) {
  return distance::distance_of(task.frame, bound);
}

distance::FrameDirection direction_of(const NearestTask& task, const float (&direction)[3], double at_least) {
  return distance::frame_direction(task.frame, direction, at_least);
}

namespace {

// Joins of each node what of() tells of its triangles, by join(). What is below a block has higher numbers.
template <typename Of, typename Join>
bool join_nodes(const PosedTree& body, double of_none, const Of& of, const Join& join, Buffer<double>& out) {
  const LevelView& tree = body.tree;
  if (!out.resize(std::size_t{tree.block_count} * kNodesPerBlock)) return false;
  for (std::size_t b = tree.block_count; b-- > 0;) {
    const Block& block = tree.blocks[b];
    for (std::size_t i = 0; i < kNodesPerBlock; ++i) {
      double& node = out[b * kNodesPerBlock + i];
      node = of_none;
      if (block.kind[i] == NodeKind::imaginary) continue;
      if (block.is_leaf_block()) {
        double corner[3][3];
        for (int c = 0; c < 3; ++c) {
          const float* const p = tree.triangles[block.index[i]].corner[c].position;
          apply(body.pose, p[0], p[1], p[2], corner[c]);
        }
        node = of(corner);
        continue;
      }
      for (std::size_t k = 0; k < kNodesPerBlock; ++k)
        node = join(node, out[block.index[i] * std::size_t{kNodesPerBlock} + k]);
    }
  }
  return true;
}

}  // namespace

bool NodeHeights::make(const NearestTask& task, const distance::Direction& along) {
  along_ = along;
  const auto low = [&](const double(&x)[3][3]) { return distance::height_along(along.n, x, along.c).low; };
  const auto high = [&](const double(&x)[3][3]) { return distance::height_along(along.n, x, along.c).high; };
  const auto lower = [](double x, double y) { return std::min(x, y); };
  const auto higher = [](double x, double y) { return std::max(x, y); };
  return join_nodes(*task.a, INFINITY, low, lower, of_a_) &&
         join_nodes(*task.b, -INFINITY, high, higher, of_b_);
}

std::uint32_t drop_by_heights(const NearestTask& task, std::uint32_t a, std::uint32_t b, std::uint32_t hits,
                              NearestSoFar& state) {
  const double near = nearness(task, state);
  for (std::uint32_t left = hits; left != 0; left &= left - 1) {
    const int bit = lowest_bit(left);
    const double apart = state.heights->apart(a, bit / 4, b, bit % 4);
    if (apart < near) continue;
    hits &= ~(1u << bit);
    state.floor = std::min(state.floor, apart);
  }
  return hits;
}

bool add_candidate(const NearCandidate& candidate, NearestSoFar& state) {
  state.enough_memory = state.candidates.push(candidate);
  return state.enough_memory;
}

bool leave(const BoundedBlockPair& pair, NearestSoFar& state) {
  state.enough_memory = state.left.push(pair);
  return state.enough_memory;
}

namespace {

// The nearer of two, and of those at one distance the one with the lower triangles.
void keep_nearer(const TriangleDistance& found, std::uint32_t triangle_a, std::uint32_t triangle_b,
                 NearestSoFar& state) {
  const double upper = found.interval.upper, best = state.best.interval.upper;
  const bool first =
      triangle_a != state.triangle_a ? triangle_a < state.triangle_a : triangle_b < state.triangle_b;
  if (!(upper < best || (upper == best && first))) return;
  state.best = found;
  state.triangle_a = triangle_a;
  state.triangle_b = triangle_b;
  state.has_along = false;
}

}  // namespace

void settle(const NearestTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b,
            NearestSoFar& state) {
  const TrianglePair pair =
      posed_pair(task.a->pose, task.a->tree, triangle_a, task.b->pose, task.b->tree, triangle_b);
  const TriangleDistance found = triangle_distance(pair, task.tolerance);
  ++state.counters.by_float64;
  state.floor = std::min(state.floor, found.interval.lower);
  if (found.interval.upper < state.upper) {
    state.upper = found.interval.upper;
    state.found = true;
  }
  keep_nearer(found, triangle_a, triangle_b, state);
}

// An axis of either body does where it tells the best apart as far as the tolerance asks for: it is right for
// whole faces, while the normal of a needle errs as much as its width is short.
void find_direction(const NearestTask& task, NearestSoFar& state) {
  if (state.has_along) return;
  state.has_along = true;
  const TrianglePair pair =
      posed_pair(task.a->pose, task.a->tree, state.triangle_a, task.b->pose, task.b->tree, state.triangle_b);
  double length;
  state.along = distance::best_direction(pair, length);
  const double enough = std::min(length, nearness(task, state));
  for (const PosedTree* body : {task.a, task.b}) {
    for (int k = 0; k < 3; ++k) {
      const auto& r = body->pose.rotation;
      for (const double side : {1.0, -1.0}) {
        const distance::Direction axis =
            distance::direction_along({{side * r[0][k], side * r[1][k], side * r[2][k]}}, pair.b[0]);
        if (!(length > 0 && distance::distance_across(axis, pair) >= enough)) continue;
        state.along = axis;
        return;
      }
    }
  }
}

bool take_over(NearestSoFar& from, NearestSoFar& state) {
  if (!from.enough_memory) return false;
  state.counters.block_pairs += from.counters.block_pairs;
  state.counters.by_float32 += from.counters.by_float32;
  state.counters.by_float64 += from.counters.by_float64;
  state.floor = std::min(state.floor, from.floor);
  if (from.found && from.upper < state.upper) {
    state.upper = from.upper;
    state.found = true;
    state.has_direction = from.has_direction;
    std::copy_n(from.direction, 3, state.direction);
  }
  keep_nearer(from.best, from.triangle_a, from.triangle_b, state);
  state.bounded += from.bounded;
  for (const NearCandidate& candidate : from.candidates.view()) {
    if (!add_candidate(candidate, state)) return false;
  }
  for (const BoundedBlockPair& pair : from.left.view()) {
    if (!leave(pair, state)) return false;
  }
  return true;
}

namespace {

// Raises a lower bound to how far apart triangles are along the direction of the best, until that is too far
// to count: by float64, then nearly exactly. Most of those that are left have their nearest corner, edge or
// plane in common with the best, and so all but the same distance.
double raised_along_best(const NearestTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b,
                         double lower, NearestSoFar& state) {
  if (state.triangle_a == kNoIndex) return lower;
  const double near = nearness(task, state);
  const TrianglePair pair =
      posed_pair(task.a->pose, task.a->tree, triangle_a, task.b->pose, task.b->tree, triangle_b);
  lower = std::max(lower, distance::distance_along_points(pair, state.best.point_a, state.best.point_b));
  if (!(lower < near)) return lower;
  find_direction(task, state);
  return std::max(lower, distance::distance_across(state.along, pair));
}

void nearest_phase_scalar(const NearestTask& task, const BoundedBlockPair* from, std::uint32_t count,
                          NearestSoFar& state) {
  NearestWalk<NearestScalarMeans>(task, state).run(from, count);
}

}  // namespace

void settle_if_near(const NearestTask& task, std::uint32_t triangle_a, std::uint32_t triangle_b, double lower,
                    NearestSoFar& state) {
  if (lower < nearness(task, state)) lower = raised_along_best(task, triangle_a, triangle_b, lower, state);
  if (lower < nearness(task, state))
    settle(task, triangle_a, triangle_b, state);
  else
    state.floor = std::min(state.floor, lower);
}

void settle_nearest(const NearestTask& task, NearestSoFar& state) {
  const NearCandidate* const begin = state.candidates.data();
  const NearCandidate* const end = begin + state.candidates.size();
  const auto* const first = std::min_element(
      begin, end, [](const NearCandidate& x, const NearCandidate& y) { return x.upper < y.upper; });
  if (first != end && first->upper < state.best.interval.upper) settle(task, first->a, first->b, state);
}

void settle_candidates(const NearestTask& task, NearestSoFar& state) {
  settle_nearest(task, state);
  NearCandidate* const begin = state.candidates.data();
  NearCandidate* const end = begin + state.candidates.size();
  const auto near = [&](const NearCandidate& candidate) { return candidate.lower < nearness(task, state); };
  NearCandidate* const far = std::partition(begin, end, near);
  for (const NearCandidate* at = far; at < end; ++at) state.floor = std::min(state.floor, at->lower);
  std::sort(begin, far, [](const NearCandidate& x, const NearCandidate& y) {
    if (x.lower != y.lower) return x.lower < y.lower;
    return x.a != y.a ? x.a < y.a : x.b < y.b;
  });
  for (const NearCandidate* at = begin; at < far && !state.touches(); ++at) {
    if (at->a == state.triangle_a && at->b == state.triangle_b) continue;
    settle_if_near(task, at->a, at->b, at->lower, state);
  }
  state.candidates.clear();
}

void nearest_phase_by_world_boxes(const NearestTask& task, const BoundedBlockPair* from, std::uint32_t count,
                                  NearestSoFar& state) {
  NearestWalk<NearestWorldBoxMeans>(task, state).run(from, count);
}

NearestPhase nearest_phase(BlockPairVariant variant) {
  return way_of(variant, nearest_phase_scalar, &LaneVariant::nearest_phase);
}

}  // namespace tandem
