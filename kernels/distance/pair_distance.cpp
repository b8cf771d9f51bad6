#include "kernels/distance/pair_distance.h"

#include <algorithm>

#include "kernels/common/traversal.h"

namespace tandem {
namespace {

// A walk of a pair ends, so that heights may be found, when it has bounded as many pairs of triangles as this
// part of the triangles, but not before it has bounded so many.
constexpr std::uint64_t kPartBounded = 4, kLeastBounded = 1024;

bool is_near_first(const BoundedBlockPair& x, const BoundedBlockPair& y) {
  if (x.bound != y.bound) return x.bound < y.bound;
  return x.a != y.a ? x.a < y.a : x.b < y.b;
}

}  // namespace

void DistanceSearch::begin(const NearestTask& task, double reach, const NearestTriangles& former) {
  found.reset(reach);
  found.most_bounded =
      std::max(kLeastBounded,
               (std::uint64_t{task.a->tree.triangle_count} + task.b->tree.triangle_count) / kPartBounded);
  if (former.a < task.a->tree.triangle_count && former.b < task.b->tree.triangle_count)
    settle(task, former.a, former.b, found);
}

void DistanceSearch::find_heights(const NearestTask& task) {
  found.most_bounded = 4 * found.bounded;
  settle_nearest(task, found);
  if (found.touches() || found.triangle_a == kNoIndex) return;
  find_direction(task, found);
  found.enough_memory = heights.make(task, found.along);
  found.heights = &heights;
}

void DistanceSearch::take_left() {
  std::swap(walks, found.left);
  found.left.clear();
  std::sort(walks.data(), walks.data() + walks.size(), is_near_first);
}

ObjectDistance DistanceSearch::finish(const NearestTask& task, double reach) {
  if (!found.touches()) settle_candidates(task, found);
  ObjectDistance out = {};
  out.triangle_a = out.triangle_b = out.face_a = out.face_b = kNoIndex;
  // Pairs of triangles that did not count are not nearer than the upper bound of then, or are beyond
  // reach.
  out.lower = std::min(found.floor, found.upper);
  out.upper = INFINITY;
  if (found.triangle_a == kNoIndex || out.lower > reach) return out;
  out.upper = found.found ? std::min(found.best.interval.upper, found.upper) : found.best.interval.upper;
  std::copy_n(found.best.point_a, 3, out.point_a);
  std::copy_n(found.best.point_b, 3, out.point_b);
  out.triangle_a = found.triangle_a;
  out.triangle_b = found.triangle_b;
  out.face_a = task.a->tree.triangles[out.triangle_a].source_face();
  out.face_b = task.b->tree.triangles[out.triangle_b].source_face();
  return out;
}

ObjectDistance DistanceSearch::find(const NearestTask& task, double reach, const NearestTriangles& former,
                                    NearestPhase way) {
  begin(task, reach, former);
  const BoundedBlockPair roots = {0, 0, 0, kAllNodePairs};
  phase_of(task, way)(task, &roots, 1, found);
  while (found.left.size() > 0 && !found.touches() && found.enough_memory) {
    find_heights(task);
    take_left();
    if (found.enough_memory)
      phase_of(task, way)(task, walks.data(), static_cast<std::uint32_t>(walks.size()), found);
  }
  return finish(task, reach);
}

}  // namespace tandem
