#include "tandem/kernels/closest_query.h"

#include <algorithm>

#include "kernels/common/check_options.h"
#include "kernels/common/component_labels.h"
#include "kernels/common/lane_variant.h"
#include "kernels/geometry/inside_test.h"
#include "kernels/points_and_rays/closest_search.h"
#include "kernels/points_and_rays/probe_ways.h"
#include "kernels/points_and_rays/scene_probe.h"

namespace tandem {
namespace {

using probe::distance_to;
using probe::may_cross;
using probe::walk_world_boxes;

// The search for the closest point of one point, with the bodies of a scene.
struct SceneSearch : ClosestSearch {
  const SceneState* scene = nullptr;

  void corners(std::uint32_t of, std::uint32_t triangle, double (&out)[3][3]) const {
    const PosedTree& tree = scene->bodies[of];
    pose_corners(tree.pose, tree.tree, triangle, out);
  }
  bool distance(const TrianglePair& pair, const DistanceTolerance& wanted, TriangleDistance& out) const {
    if (!point_distance_by_float64(pair, wanted, out)) out = triangle_distance(pair, wanted);
    return true;
  }
};

void take_candidates(PointTask& task, const ClosestCandidate* candidates, std::uint32_t count) {
  SceneSearch& search = *static_cast<SceneSearch*>(task.context);
  search.upper = std::min(search.upper, task.upper);
  search.settle(search, candidates, count, *task.lengths);
  task.upper = search.upper;
}

// The triangles of an asset that belong to open components.
struct SurfaceLabels {
  bool any_closed;
  std::uint32_t first;  // of the labels; kNoIndex: all triangles are of closed components
};

// This counts what the ray from a point to +x crosses.
struct CrossingCount {
  const PosedTree* tree;
  const double* point;
  const std::uint32_t* labels;
  std::int32_t winding = 0;
  std::uint32_t crossings = 0;
  float limit;

  void take(std::uint32_t triangle) {
    if (labels != nullptr && (labels[triangle] & containment::kOfOpenComponent) != 0) return;
    double corner[3][3];
    pose_corners(tree->pose, tree->tree, triangle, corner);
    const int crossing = containment::ray_crossing(corner, point);
    if (crossing == 0) return;
    ++crossings;
    winding += is_turned(tree->tree.topology[triangle].flags) ? -crossing : crossing;
  }
};

float take_crossing(void* context, std::uint32_t triangle) {
  CrossingCount& count = *static_cast<CrossingCount*>(context);
  count.take(triangle);
  return count.limit;
}

}  // namespace

struct ClosestQuery::State : Allocated {
  PointWalk walk = best_way(tandem::point_walk);
  RayWalk walk_ray = best_way(tandem::ray_walk);
  ProbedBodies bodies;
  ProbeOrder order;
  PerWorker<SceneSearch> searches;
  std::uint64_t labels_of = 0;  // the number of the assets
  Buffer<SurfaceLabels> surfaces;
  Buffer<std::uint32_t> labels;

  Status label(SceneState& scene);
  void walk_body(SceneSearch& search) const;
  void find(const ClosestOptions& options, std::uint32_t of, SceneSearch& search, ClosestPoint& row) const;
  void find_part(const ClosestOptions& options, std::uint32_t of, std::size_t first, std::size_t last,
                 SceneSearch& search, ClosestPoint* rows, std::size_t stride) const;
  void add_side(std::uint32_t body, SceneSearch& search, ClosestPoint& row) const;
  void count_crossings(std::uint32_t body, SceneSearch& search, CrossingCount& count) const;

  // Visits one body, or all: see ProbedBodies.
  template <typename Bound, typename Visit>
  void visit(std::uint32_t of, const Bound& bound, const double& limit, const Visit& at) const {
    if (of == kNoIndex) return bodies.visit(bound, limit, at);
    at(of);
  }
};

Status ClosestQuery::State::label(SceneState& scene) {
  if (labels_of == scene.assets_id) return Status::kOk;
  labels_of = 0;
  surfaces.clear();
  labels.clear();
  std::size_t total = 0;
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const LevelView& level = scene.assets[i].tree;
    const bool any_closed =
        std::any_of(level.components, level.components + level.component_count, is_closed);
    const bool labelled = any_closed && !level.closed;
    if (total >= kNoIndex ||
        !surfaces.push({any_closed, labelled ? static_cast<std::uint32_t>(total) : kNoIndex}))
      return scene.fail(Status::kOutOfMemory, i);
    if (labelled) total += level.triangle_count;
  }
  if (!labels.resize(total)) return scene.fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    if (surfaces[i].first != kNoIndex &&
        !containment::label_triangles(scene.assets[i].tree, labels.data() + surfaces[i].first))
      return scene.fail(Status::kOutOfMemory, i);
  }
  labels_of = scene.assets_id;
  return Status::kOk;
}

void ClosestQuery::State::walk_body(SceneSearch& search) const {
  const PosedTree& tree = search.scene->bodies[search.body];
  const LocalFrame& frame = bodies.frame(search.body);
  PointTask task;
  if (!local_point(frame, search.point, task.point)) {
    search.blocks += walk_world_boxes(
        tree.pose, tree.tree.blocks,
        [&](const WorldBox& box) { return distance_to(box, search.point) < search.upper; },
        [&](std::uint32_t triangle) { return search.settle(search, triangle); });
    return;
  }
  task.tree = &tree.tree;
  task.lengths = &frame;
  task.upper = search.upper;
  task.take = take_candidates;
  task.context = &search;
  walk(task);
  search.upper = std::min(search.upper, task.upper);
  search.blocks += task.blocks;
}

// of: the body that is looked at; kNoIndex: all are.
void ClosestQuery::State::find(const ClosestOptions& options, std::uint32_t of, SceneSearch& search,
                               ClosestPoint& row) const {
  const auto bound = [&](const WorldBox& box) { return distance_to(box, search.point); };
  visit(of, bound, search.upper, [&](std::uint32_t body) {
    if (!search.scene->is_body(body)) return;
    search.body = body;
    walk_body(search);
  });
  row = search.row(options.reach);
  if (row.body != kNoIndex)
    row.face = search.scene->bodies[row.body].tree.triangles[row.triangle].source_face();
  if (!options.sides) return;
  const auto around = [&](const WorldBox& box) { return bound(box) == 0 ? 0 : HUGE_VAL; };
  visit(of, around, 0, [&](std::uint32_t body) { add_side(body, search, row); });
}

// Each point's search begins with the triangle that was closest to the one before it in the part. rows: of
// the first point, and the others at multiples of the stride.
void ClosestQuery::State::find_part(const ClosestOptions& options, std::uint32_t of, std::size_t first,
                                    std::size_t last, SceneSearch& search, ClosestPoint* rows,
                                    std::size_t stride) const {
  const double beyond_reach = beyond(options.reach);
  for (std::size_t i = first; i < last; ++i) {
    const std::uint32_t body = search.best_body, triangle = search.best_triangle;
    fetch_ahead(options.points[order.ahead(i)].data());
    search.begin(options.points[order[i]].data(), beyond_reach);
    if (i != first && triangle != kNoIndex) {
      search.body = body;
      search.settle(search, triangle);
    }
    find(options, of, search, rows[stride * order[i]]);
  }
}

void ClosestQuery::State::count_crossings(std::uint32_t body, SceneSearch& search,
                                          CrossingCount& count) const {
  const PosedTree& tree = search.scene->bodies[body];
  const double along[3] = {1, 0, 0};
  const WorldRay ray = world_ray(search.point, along, HUGE_VAL);
  RayTask task;
  const RayReach reach = local_ray(bodies.frame(body), ray, HUGE_VAL, task.ray);
  if (reach == RayReach::misses) return;
  if (reach == RayReach::out_of_range) {
    search.blocks += walk_world_boxes(
        tree.pose, tree.tree.blocks, [&](const WorldBox& box) { return may_cross(box, search.point); },
        [&](std::uint32_t triangle) {
          count.take(triangle);
          return true;
        });
    return;
  }
  task.tree = &tree.tree;
  task.limit = count.limit = task.ray.length;
  task.take = take_crossing;
  task.context = &count;
  walk_ray(task);
  search.blocks += task.blocks;
}

// Counts the surfaces of a body that are around the point.
void ClosestQuery::State::add_side(std::uint32_t body, SceneSearch& search, ClosestPoint& row) const {
  const SceneState& scene = *search.scene;
  if (!scene.is_body(body) || distance_to(scene.boxes[body], search.point) != 0) return;
  const SurfaceLabels& surface = surfaces[scene.instances[body].asset];
  if (!surface.any_closed) return;
  CrossingCount count = {&scene.bodies[body],
                         search.point,
                         surface.first != kNoIndex ? labels.data() + surface.first : nullptr,
                         0,
                         0,
                         0};
  count_crossings(body, search, count);
  row.winding += count.winding;
  if (count.crossings % 2 != 0) row.within = std::min(row.within, body);
}

namespace {

Status check(SceneState& scene, const ClosestOptions& options) {
  const std::size_t of_each = std::max<std::size_t>(options.bodies.size(), 1);
  if (options.points.size() > (kNoIndex - 1) / of_each) return scene.fail(Status::kBadOption, 0);
  for (std::size_t i = 0; i < options.bodies.size(); ++i) {
    if (!scene.is_body(options.bodies[i])) return scene.fail(Status::kUnknownInstance, i);
  }
  const Status status = check_distance_options(options.tolerance, options.reach);
  if (status != Status::kOk) return scene.fail(status, 0);
  for (std::size_t i = 0; i < options.points.size(); ++i) {
    if (!is_in_range(options.points[i])) return scene.fail(Status::kOutOfRange, i);
  }
  return Status::kOk;
}

}  // namespace

Status ClosestQuery::answer(SceneState& scene, const ClosestOptions& options) {
  const std::size_t count = options.points.size(), of_each = std::max<std::size_t>(options.bodies.size(), 1);
  State* const provided = state_.provide();
  if (provided == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  State& state = *provided;
  Status status = state.bodies.make(scene);
  if (status == Status::kOk && options.sides) status = state.label(scene);
  if (status != Status::kOk) return status;
  const std::uint32_t workers = scene.workers_for(count, kProbesAtOnce);
  if (!scene.threads->provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  const auto place = [&](std::uint32_t i, double* out) {
    std::copy_n(options.points[i].data(), 3, out);
    return true;
  };
  if (!state.searches.provide(workers) || !state.order.make(0, static_cast<std::uint32_t>(count), place) ||
      !rows_.resize(count * of_each))
    return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < workers; ++i) {
    SceneSearch& search = state.searches[i];
    search.scene = &scene;
    search.tolerance = options.tolerance;
    search.blocks = search.by_float64 = 0;
  }
  const auto find = [&](std::size_t first, std::size_t last, std::uint32_t worker) {
    for (; first < last; first += kProbesAtOnce) {
      const std::size_t end = std::min(first + kProbesAtOnce, last);
      for (std::size_t k = 0; k < of_each; ++k) {
        const std::uint32_t of = options.bodies.empty() ? kNoIndex : options.bodies[k];
        state.find_part(options, of, first, end, state.searches[worker], rows_.data() + k, of_each);
      }
    }
  };
  scene.threads->for_parts(workers, count, kProbesAtOnce, find);
  counters_ = {count, 0, 0};
  for (std::uint32_t i = 0; i < workers; ++i) {
    counters_.blocks += state.searches[i].blocks;
    counters_.by_float64 += state.searches[i].by_float64;
  }
  return Status::kOk;
}

Status ClosestQuery::find(Scene& in, const ClosestOptions& options) {
  return ask_scene(in, [&](SceneState& scene) {
    Status status = check(scene, options);
    if (status == Status::kOk && options.sides) status = scene.require_topology();
    if (status != Status::kOk) return status;
    return scene.device != nullptr && options.bodies.empty() ? scene.ask_device(options, found())
                                                             : answer(scene, options);
  });
}

}  // namespace tandem
