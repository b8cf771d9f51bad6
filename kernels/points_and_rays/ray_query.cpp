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

// Rays that a thread orders and answers at a time: few enough for the third-level cache, and enough that
// neighbours are near each other.
constexpr std::size_t kMostRaysInPart = 1 << 16;

// The search for the hits of one ray.
struct RaySearch {
  const SceneState* scene = nullptr;
  RayHits wanted = RayHits::first;
  WorldRay ray;
  double last;  // the greatest parameter of the world's ray that counts
  BodyVisit visit;
  std::uint32_t body;
  const LocalRay* local;
  FoundHit best;
  bool found;
  Buffer<FoundHit> all;
  bool enough_memory = true;

  std::uint64_t blocks = 0, by_float64 = 0;

  void begin(const RayOptions& options, std::uint32_t number, const BoxTree& tree) {
    ray = world_ray(options.origins[number].data(), options.directions[number].data(), options.reach);
    last = options.reach;
    found = false;
    all.clear();
    visit.begin(tree);
  }

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
    return meets_box(search.ray, box.lo, box.hi, first, last);
  };
  search.blocks += probe::walk_world_boxes(tree.pose, tree.tree.blocks, wanted,
                                           [&](std::uint32_t triangle) { return search.take(triangle); });
}

bool is_known(RayHits hits) {
  return hits == RayHits::first || hits == RayHits::any || hits == RayHits::all;
}

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

// A thread has this for the rays that it answers.
struct RayWorker {
  ProbeOrder order;
  RaySearch searches[kRaysAtOnce];
  Buffer<RayHit> rows;  // of all hits
  bool enough_memory = true;

  void begin(const SceneState& scene, RayHits wanted) {
    rows.clear();
    enough_memory = true;
    for (RaySearch& search : searches) {
      search.scene = &scene;
      search.wanted = wanted;
      search.enough_memory = true;
      search.blocks = search.by_float64 = 0;
    }
  }
};

// A batch of rays, as threads answer it in parts.
struct RayBatch {
  const SceneState& scene;
  const ProbedBodies& bodies;
  const RayOptions& options;
  RayStreamWalk walk;
  std::uint32_t workers;
  RayHit* rows;          // of each ray; null where all hits are asked for
  std::uint32_t* count;  // of each ray's hits, where all are asked for

  void answer(std::uint32_t first, std::uint32_t last, RayWorker& worker) const;
  void take_hits(std::uint32_t ray, RaySearch& search, RayWorker& worker) const;
  bool walks_on(RaySearch& search, RayTask& task) const;
};

// Finds the next body that a ray's tree walk is to look at. False: the search is over.
bool RayBatch::walks_on(RaySearch& search, RayTask& task) const {
  const auto first_in = [&](const WorldBox& box) {
    double first = 0, last = search.last / search.ray.factor;
    return meets_box(search.ray, box.lo, box.hi, first, last) ? first : HUGE_VAL;
  };
  while (!(search.wanted == RayHits::any && search.found) && search.enough_memory) {
    // Rounded up, as a bound of a box that is just as far may be.
    const double limit = search.last / search.ray.factor * (1 + 0x1p-50);
    search.body = search.visit.next(bodies.tree(), first_in, limit);
    if (search.body == kNoIndex) return false;
    if (!scene.is_body(search.body)) continue;
    const PosedTree& tree = scene.bodies[search.body];
    const RayReach reach = local_ray(bodies.frame(search.body), search.ray, search.last, task.ray);
    if (reach == RayReach::out_of_range) walk_world_boxes(tree, search);
    if (reach != RayReach::in_frame) continue;
    task.tree = &tree.tree;
    task.limit = task.ray.length;
    task.take = take_triangle;
    task.context = &search;
    task.blocks = 0;
    search.local = &task.ray;
    return true;
  }
  return false;
}

// Writes what was found of a ray.
void RayBatch::take_hits(std::uint32_t ray, RaySearch& search, RayWorker& worker) const {
  if (rows != nullptr) {
    rows[ray] = search.found ? row_of(scene, ray, search.best) : row_without_hit(ray);
    return;
  }
  std::sort(search.all.data(), search.all.data() + search.all.size(),
            [&](const FoundHit& x, const FoundHit& y) { return search.comes_before(x, y); });
  count[ray] = static_cast<std::uint32_t>(search.all.size());
  worker.enough_memory = worker.enough_memory && search.enough_memory;
  for (const FoundHit& hit : search.all.view())
    worker.enough_memory = worker.enough_memory && worker.rows.push(row_of(scene, ray, hit), workers);
}

// Feeds walks with the rays of an order.
struct RayFeed {
  const RayBatch& batch;
  RayWorker& worker;
  std::size_t at = 0;
  std::uint32_t ray[kRaysAtOnce] = {};  // of each walk; kNoIndex: none

  bool next(std::uint32_t number, RayTask& task) {
    RaySearch& search = worker.searches[number];
    std::uint32_t& of_walk = ray[number];
    if (of_walk != kNoIndex) search.blocks += task.blocks;
    while (of_walk == kNoIndex || !batch.walks_on(search, task)) {
      if (of_walk != kNoIndex) batch.take_hits(of_walk, search, worker);
      if (at == worker.order.size() || !worker.enough_memory) return false;
      fetch(worker.order.ahead(at));
      of_walk = worker.order[at++];
      search.begin(batch.options, of_walk, batch.bodies.tree());
    }
    return true;
  }

  void fetch(std::uint32_t soon) const {
    fetch_ahead(batch.options.origins[soon].data());
    fetch_ahead(batch.options.directions[soon].data());
    if (batch.rows != nullptr) fetch_ahead(batch.rows + soon);
  }
};

// Rays that enter the scene near each other follow each other; those that miss it are answered at once.
void RayBatch::answer(std::uint32_t first, std::uint32_t last, RayWorker& worker) const {
  const WorldBox bounds = bodies.bounds();
  const auto place = [&](std::uint32_t i, double* out) {
    const WorldRay ray = world_ray(options.origins[i].data(), options.directions[i].data(), options.reach);
    double begin = 0, end = HUGE_VAL;
    if (!meets_box(ray, bounds.lo, bounds.hi, begin, end)) {
      if (rows != nullptr)
        rows[i] = row_without_hit(i);
      else
        count[i] = 0;
      return false;
    }
    for (int k = 0; k < 3; ++k) out[k] = ray.origin[k] + begin * ray.scaled[k];
    return true;
  };
  if (!worker.order.make(first, last, place)) {
    worker.enough_memory = false;
    return;
  }
  RayFeed feed = {*this, worker};
  std::fill_n(feed.ray, kRaysAtOnce, kNoIndex);
  const auto next = [](void* context, std::uint32_t number, RayTask& task) {
    return static_cast<RayFeed*>(context)->next(number, task);
  };
  walk({next, &feed});
}

}  // namespace

struct RayQuery::State : Allocated {
  RayStreamWalk walk = best_way(ray_stream_walk);
  ProbedBodies bodies;
  PerWorker<RayWorker> workers;
  Buffer<std::uint32_t> begin;  // of each ray's hits, where all are asked for
};

Status RayQuery::answer(SceneState& scene, const RayOptions& options) {
  const std::size_t count = options.origins.size();
  const bool all = options.hits == RayHits::all;
  State* const provided = state_.provide();
  if (provided == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  State& state = *provided;
  if (const Status status = state.bodies.make(scene); status != Status::kOk) return status;
  const std::uint32_t workers = scene.workers_for(count, kProbesAtOnce);
  if (!scene.threads.provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  if (!state.workers.provide(workers) || !rows_.resize(all ? 0 : count) ||
      !state.begin.resize(all ? count + 1 : 0))
    return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < workers; ++i) state.workers[i].begin(scene, options.hits);
  const RayBatch batch = {scene,
                          state.bodies,
                          options,
                          state.walk,
                          workers,
                          all ? nullptr : rows_.data(),
                          all ? state.begin.data() + 1 : nullptr};
  const std::size_t part = std::clamp(count / (4 * workers), kProbesAtOnce, kMostRaysInPart);
  scene.threads.for_parts(workers, count, part, [&](std::size_t i, std::size_t end, std::uint32_t worker) {
    for (; i < end && state.workers[worker].enough_memory; i += part) {
      batch.answer(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(std::min(i + part, end)),
                   state.workers[worker]);
    }
  });
  counters_ = {count, 0, 0, 0};
  std::size_t hits = 0;
  for (std::uint32_t i = 0; i < workers; ++i) {
    const RayWorker& worker = state.workers[i];
    if (!worker.enough_memory) return scene.fail(Status::kOutOfMemory, 0);
    for (const RaySearch& search : worker.searches) {
      counters_.blocks += search.blocks;
      counters_.by_float64 += search.by_float64;
    }
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
