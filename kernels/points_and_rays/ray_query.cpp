#include "tandem/kernels/ray_query.h"

#include <algorithm>
#include <utility>

#include "kernels/common/check_options.h"
#include "kernels/common/lane_variant.h"
#include "kernels/contact/candidate.h"
#include "kernels/points_and_rays/probe_ways.h"
#include "kernels/points_and_rays/ray_rows.h"
#include "kernels/points_and_rays/scene_probe.h"

namespace tandem {
namespace {

using ray::FoundHit;

// The search for the hits of one ray.
struct RaySearch {
  const SceneState* scene = nullptr;
  RayHits wanted = RayHits::first;
  WorldRay ray;
  double last;  // the greatest parameter of the world's ray that counts
  std::uint32_t body;
  const LocalRay* local;
  FoundHit best;
  bool found;
  Buffer<FoundHit> all;
  bool enough_memory = true;

  std::uint64_t blocks = 0, by_float64 = 0;

  void corners_of(const FoundHit& hit, double (&out)[3][3]) const {
    const PosedTree& tree = scene->bodies[hit.body];
    pose_corners(tree.pose, tree.tree, hit.triangle, out);
  }

  bool comes_before(const FoundHit& x, const FoundHit& y) const {
    const ray::Answer answer = ray::comes_before_by_float64(x, y);
    if (answer != ray::Answer::unsure) return answer == ray::Answer::yes;
    double of_x[3][3], of_y[3][3];
    corners_of(x, of_x);
    corners_of(y, of_y);
    return ray::comes_before_exactly(ray.origin, ray.direction, x, of_x, y, of_y);
  }

  // Looks at a triangle. False: the search is over.
  bool take(std::uint32_t triangle) {
    ++by_float64;
    FoundHit hit;
    hit.body = body;
    hit.triangle = triangle;
    double corner[3][3];
    corners_of(hit, corner);
    if (!ray::find_meeting(ray.origin, ray.direction, corner, hit.meeting)) return true;
    if (!ray::is_within(ray.origin, ray.direction, corner, hit.meeting, ray.reach)) return true;
    if (wanted == RayHits::all) return enough_memory = all.push(hit);
    if (!found || comes_before(hit, best)) {
      best = hit;
      last = std::min(last, hit.meeting.t.upper);
    }
    found = true;
    return wanted != RayHits::any;
  }
};

// The parameter up to which others count, in the local ray; below 0: none does.
float take_triangle(void* context, std::uint32_t triangle) {
  RaySearch& search = *static_cast<RaySearch*>(context);
  if (!search.take(triangle)) return -1;
  return local_limit(search.ray, *search.local, search.last);
}

// A walk of a body that float32 cannot take.
void walk_world_boxes(const PosedTree& tree, RaySearch& search) {
  const auto wanted = [&](const WorldBox& box) {
    double first = 0, last = search.last / search.ray.factor;
    return meets_box(search.ray.origin, search.ray.scaled, box.lo, box.hi, first, last);
  };
  search.blocks += probe::walk_world_boxes(tree.pose, tree.tree.blocks, wanted,
                                           [&](std::uint32_t triangle) { return search.take(triangle); });
}

bool is_known(RayHits hits) {
  return hits == RayHits::first || hits == RayHits::any || hits == RayHits::all;
}

}  // namespace

struct RayQuery::State : Allocated {
  struct Worker {
    RaySearch search;
    Buffer<RayHit> rows;  // of all hits
    bool enough_memory = true;
  };

  RayWalk walk = best_way(tandem::ray_walk);
  ProbedBodies bodies;
  ProbeOrder order;
  PerWorker<Worker> workers;
  Buffer<std::uint32_t> begin;  // of each ray's hits, where all are asked for

  void find(SceneState& scene, const RayOptions& options, std::uint32_t ray, RaySearch& search) const;
  void walk_body(RaySearch& search) const;
};

// Whether more of the scene is to be looked at, which the walk's own limit does not tell.
void RayQuery::State::walk_body(RaySearch& search) const {
  const PosedTree& tree = search.scene->bodies[search.body];
  RayTask task;
  const RayReach reach = local_ray(bodies.frame(search.body), search.ray, search.last, task.ray);
  if (reach == RayReach::misses) return;
  if (reach == RayReach::out_of_range) return walk_world_boxes(tree, search);
  task.tree = &tree.tree;
  task.limit = task.ray.length;
  task.take = take_triangle;
  task.context = &search;
  search.local = &task.ray;
  walk(task);
  search.blocks += task.blocks;
}

void RayQuery::State::find(SceneState& scene, const RayOptions& options, std::uint32_t number,
                           RaySearch& search) const {
  search.scene = &scene;
  search.wanted = options.hits;
  search.ray = world_ray(options.origins[number].data(), options.directions[number].data(), options.reach);
  search.last = options.reach;
  search.found = false;
  search.all.clear();
  double limit = search.last / search.ray.factor;
  const auto first_in = [&](const WorldBox& box) {
    double first = 0, last = limit;
    return meets_box(search.ray.origin, search.ray.scaled, box.lo, box.hi, first, last) ? first : HUGE_VAL;
  };
  const auto visit = [&](std::uint32_t body) {
    if (!scene.is_body(body) || (search.wanted == RayHits::any && search.found) || !search.enough_memory)
      return;
    search.body = body;
    walk_body(search);
    // Rounded up, as a bound of a box that is just as far may be.
    limit = search.last / search.ray.factor * (1 + 0x1p-50);
  };
  bodies.visit(first_in, limit, visit);
}

namespace {

RayHit row_of(const SceneState& scene, std::uint32_t ray, const FoundHit& hit) {
  return tandem::row_of(ray, hit, scene.bodies[hit.body].tree.triangles[hit.triangle].source_face());
}

Status check(SceneState& scene, const RayOptions& options) {
  if (options.origins.size() != options.directions.size() || options.origins.size() >= kNoIndex ||
      !is_known(options.hits))
    return scene.fail(Status::kBadOption, 0);
  if (const Status status = check_reach(options.reach); status != Status::kOk) return scene.fail(status, 0);
  for (std::size_t i = 0; i < options.origins.size(); ++i) {
    const auto& d = options.directions[i];
    if (!is_in_range(options.origins[i]) || !is_in_range(d)) return scene.fail(Status::kOutOfRange, i);
    if (d[0] == 0 && d[1] == 0 && d[2] == 0) return scene.fail(Status::kNoDirection, i);
  }
  return Status::kOk;
}

}  // namespace

Status RayQuery::answer(SceneState& scene, const RayOptions& options) {
  const std::size_t count = options.origins.size();
  const bool all = options.hits == RayHits::all;
  State* const provided = state_.provide();
  if (provided == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  State& state = *provided;
  if (const Status status = state.bodies.make(scene); status != Status::kOk) return status;
  const std::uint32_t workers = scene.workers_for(count, kProbesAtOnce);
  if (!scene.threads.provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  // Rays that enter the scene near each other follow each other; those that miss it come first.
  const WorldBox bounds = state.bodies.bounds();
  const auto place = [&](std::size_t i, double* out) {
    const WorldRay ray = world_ray(options.origins[i].data(), options.directions[i].data(), HUGE_VAL);
    double first = 0, last = HUGE_VAL;
    if (!meets_box(ray.origin, ray.scaled, bounds.lo, bounds.hi, first, last)) first = 0;
    for (int k = 0; k < 3; ++k) out[k] = ray.origin[k] + first * ray.scaled[k];
  };
  if (!state.workers.provide(workers) || !state.order.make<3>(count, place) ||
      !rows_.resize(all ? 0 : count) || !state.begin.resize(all ? count + 1 : 0))
    return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < workers; ++i) {
    State::Worker& worker = state.workers[i];
    worker.rows.clear();
    worker.enough_memory = worker.search.enough_memory = true;
    worker.search.blocks = worker.search.by_float64 = 0;
  }
  const auto find = [&](std::size_t i, std::size_t end, std::uint32_t number) {
    State::Worker& worker = state.workers[number];
    RaySearch& search = worker.search;
    for (; i < end && worker.enough_memory; ++i) {
      const std::uint32_t ray = state.order[i], soon = state.order.ahead(i);
      fetch_ahead(options.origins[soon].data());
      fetch_ahead(options.directions[soon].data());
      if (!all) fetch_ahead(&rows_[soon]);
      state.find(scene, options, ray, search);
      if (!all) {
        rows_[ray] = search.found ? row_of(scene, ray, search.best) : row_without_hit(ray);
        continue;
      }
      std::sort(search.all.data(), search.all.data() + search.all.size(),
                [&](const FoundHit& x, const FoundHit& y) { return search.comes_before(x, y); });
      state.begin[ray + 1] = static_cast<std::uint32_t>(search.all.size());
      for (const FoundHit& hit : search.all.view())
        worker.enough_memory = worker.enough_memory && worker.rows.push(row_of(scene, ray, hit), workers);
      worker.enough_memory = worker.enough_memory && search.enough_memory;
    }
  };
  scene.threads.for_parts(workers, count, kProbesAtOnce, find);
  counters_ = {count, 0, 0, 0};
  std::size_t hits = 0;
  for (std::uint32_t i = 0; i < workers; ++i) {
    State::Worker& worker = state.workers[i];
    if (!worker.enough_memory) return scene.fail(Status::kOutOfMemory, 0);
    counters_.blocks += worker.search.blocks;
    counters_.by_float64 += worker.search.by_float64;
    hits += worker.rows.size();
  }
  if (!all) {
    for (const RayHit& row : rows_.view()) counters_.hits += row.body != kNoIndex;
    return Status::kOk;
  }
  if (hits >= kNoIndex) return scene.fail(Status::kTooManyPairs, 0);
  if (!rows_.resize(hits)) return scene.fail(Status::kOutOfMemory, 0);
  counters_.hits = hits;
  state.begin[0] = 0;
  for (std::size_t i = 0; i < count; ++i) state.begin[i + 1] += state.begin[i];
  for (std::uint32_t i = 0; i < workers; ++i) {
    for (const RayHit& row : state.workers[i].rows.view()) rows_[state.begin[row.ray]++] = row;
  }
  return Status::kOk;
}

Status RayQuery::find(Scene& in, const RayOptions& options) {
  return ask_scene(in, [&](SceneState& scene) {
    const Status status = check(scene, options);
    if (status != Status::kOk) return status;
    return scene.device != nullptr ? scene.ask_device(options, found()) : answer(scene, options);
  });
}

}  // namespace tandem
