#include "tandem/kernels/ray_query.h"

#include <algorithm>
#include <bit>
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
  std::uint32_t number;  // of the ray
  WorldRay ray;
  double last;  // the greatest parameter of the world's ray that counts
  BodyVisit visit;
  std::uint32_t body;  // that is looked at
  LocalRay local;      // in its frame, where `reach` says so
  RayReach reach;
  FoundHit best;
  bool found;
  Buffer<FoundHit> all;
  bool enough_memory = true;

  std::uint64_t blocks = 0, by_float64 = 0;

  // Begins with a ray of a group.
  void begin(std::uint32_t of_ray, const RayGroup& group, std::uint32_t i, const BoxTree& tree) {
    number = of_ray;
    for (int k = 0; k < 3; ++k) {
      ray.origin[k] = group.origin[k][i];
      ray.direction[k] = group.direction[k][i];
      ray.scaled[k] = group.scaled[k][i];
      ray.inverse[k] = group.inverse[k][i];
    }
    ray.factor = group.factor[i];
    ray.reach = last = group.reach;
    found = false;
    all.clear();
    visit.begin(tree);
  }

  // Takes a ray of a group in the frame of the body.
  void take_local(const LocalRayGroup& group, std::uint32_t i) {
    for (int k = 0; k < 3; ++k) {
      local.o[k] = group.o[k][i];
      local.d[k] = group.d[k][i];
      local.inverse[k] = group.inverse[k][i];
    }
    local.slack = group.slack[i];
    local.length = group.length[i];
    local.edge_factor = group.edge_factor[i];
    local.least_bound = group.least_bound[i];
    local.start = group.start[i];
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
  return local_limit(search.ray, search.local, search.last);
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
  RaySearch searches[kRaysAtOnce + kRaysOfGroup];
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
  const RayGroupWays& ways;
  std::uint32_t workers;
  RayHit* rows;          // of each ray; null where all hits are asked for
  std::uint32_t* count;  // of each ray's hits, where all are asked for

  void answer(std::uint32_t first, std::uint32_t last, RayWorker& worker) const;
  void miss(std::uint32_t ray) const;
  void take_hits(RaySearch& search, RayWorker& worker) const;
  bool goes_on(RaySearch& search) const;
  bool enters_body(RaySearch& search, RayTask& task) const;
  bool walks_on(RaySearch& search, RayTask& task) const;
  void take_into_frames(const RayGroup& group, RaySearch* const* searches, unsigned which) const;
};

// Finds the next body that a ray's search is to look at. False: the search is over.
bool RayBatch::goes_on(RaySearch& search) const {
  const auto first_in = [&](const WorldBox& box) {
    double first = 0, last = search.last / search.ray.factor;
    return meets_box(search.ray, box.lo, box.hi, first, last) ? first : HUGE_VAL;
  };
  if ((search.wanted == RayHits::any && search.found) || !search.enough_memory) return false;
  do {
    // Rounded up, as a bound of a box that is just as far may be.
    const double limit = search.last / search.ray.factor * (1 + 0x1p-50);
    search.body = search.visit.next(bodies.tree(), first_in, limit);
  } while (search.body != kNoIndex && !scene.is_body(search.body));
  return search.body != kNoIndex;
}

// Makes the task of a walk through the body of a search. False: there is nothing to walk.
bool RayBatch::enters_body(RaySearch& search, RayTask& task) const {
  const PosedTree& tree = scene.bodies[search.body];
  if (search.reach == RayReach::out_of_range) walk_world_boxes(tree, search);
  if (search.reach != RayReach::in_frame) return false;
  task.tree = &tree.tree;
  task.ray = search.local;
  task.limit = task.ray.length;
  task.take = take_triangle;
  task.context = &search;
  task.blocks = 0;
  return true;
}

// Makes the task of a walk through the next body. False: the search is over.
bool RayBatch::walks_on(RaySearch& search, RayTask& task) const {
  while (goes_on(search)) {
    search.reach = local_ray(bodies.frame(search.body), search.ray, search.last, search.local);
    if (enters_body(search, task)) return true;
  }
  return false;
}

// Takes rays of a group into the frames of the bodies that they look at first.
void RayBatch::take_into_frames(const RayGroup& group, RaySearch* const* searches, unsigned which) const {
  LocalRayGroup local;
  for (unsigned left = which; left != 0;) {
    const std::uint32_t body = searches[std::countr_zero(left)]->body;
    const LocalFrame& frame = bodies.frame(body);
    const RayGroupReach reach =
        frame.in_range ? ways.take_into_frame(group, frame, local) : RayGroupReach{0, 0};
    for (std::uint32_t i = 0; i < kRaysOfGroup; ++i) {
      if ((left >> i & 1) == 0 || searches[i]->body != body) continue;
      left &= ~(1u << i);
      const bool misses = (reach.misses >> i & 1) != 0, in_frame = (reach.in_frame >> i & 1) != 0;
      searches[i]->reach = misses ? RayReach::misses : in_frame ? RayReach::in_frame : RayReach::out_of_range;
      if (in_frame) searches[i]->take_local(local, i);
    }
  }
}

void RayBatch::miss(std::uint32_t ray) const {
  if (rows != nullptr)
    rows[ray] = row_without_hit(ray);
  else
    count[ray] = 0;
}

// Writes what was found of a ray.
void RayBatch::take_hits(RaySearch& search, RayWorker& worker) const {
  const std::uint32_t ray = search.number;
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

// Writes a ray to a group.
void set_ray(RayGroup& group, std::uint32_t i, const RayOptions& options, std::uint32_t ray) {
  for (int k = 0; k < 3; ++k) {
    group.origin[k][i] = options.origins[ray][k];
    group.direction[k][i] = options.directions[ray][k];
  }
}

// Feeds walks with the rays of an order, which are begun in groups.
class RayFeed {
 public:
  RayFeed(const RayBatch& batch, RayWorker& worker) : batch_(batch), worker_(worker) {
    for (RaySearch& search : worker.searches) idle_[idle_count_++] = &search;
    group_.reach = batch.options.reach;
  }

  bool next(std::uint32_t walk, RayTask& task) {
    RaySearch*& search = search_of_[walk];
    if (search != nullptr) {
      search->blocks += task.blocks;
      if (batch_.walks_on(*search, task)) return true;
      end(search);
    }
    while (worker_.enough_memory) {
      if (ready_count_ == 0 && !begin_group()) return false;
      search = ready_[--ready_count_];
      if (batch_.enters_body(*search, task) || batch_.walks_on(*search, task)) return true;
      end(search);
    }
    return false;
  }

 private:
  void end(RaySearch*& search) {
    batch_.take_hits(*search, worker_);
    idle_[idle_count_++] = std::exchange(search, nullptr);
  }

  // Begins rays that follow each other; those that look at no body are answered at once. False: there are no
  // more.
  bool begin_group() {
    while (ready_count_ == 0 && at_ < worker_.order.size()) {
      const auto count =
          static_cast<std::uint32_t>(std::min<std::size_t>(kRaysOfGroup, worker_.order.size() - at_));
      for (std::uint32_t i = 0; i < kRaysOfGroup; ++i) {
        fetch(worker_.order.ahead(at_ + (i < count ? i : 0)));
        set_ray(group_, i, batch_.options, worker_.order[at_ + (i < count ? i : 0)]);
      }
      batch_.ways.make_ready(group_);
      begin_searches(count);
      at_ += count;
    }
    return ready_count_ > 0;
  }

  void begin_searches(std::uint32_t count) {
    RaySearch* searches[kRaysOfGroup];
    unsigned going_on = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      RaySearch& search = *(searches[i] = idle_[--idle_count_]);
      search.begin(worker_.order[at_ + i], group_, i, batch_.bodies.tree());
      if (batch_.goes_on(search)) going_on |= 1u << i;
    }
    batch_.take_into_frames(group_, searches, going_on);
    for (std::uint32_t i = count; i-- > 0;) {
      if ((going_on >> i & 1) != 0)
        ready_[ready_count_++] = searches[i];
      else
        end(searches[i]);
    }
  }

  void fetch(std::uint32_t soon) const {
    fetch_ahead(batch_.options.origins[soon].data());
    fetch_ahead(batch_.options.directions[soon].data());
    if (batch_.rows != nullptr) fetch_ahead(batch_.rows + soon);
  }

  const RayBatch& batch_;
  RayWorker& worker_;
  std::size_t at_ = 0;
  RayGroup group_;
  RaySearch* search_of_[kRaysAtOnce] = {};  // of each walk
  RaySearch *ready_[kRaysOfGroup], *idle_[kRaysAtOnce + kRaysOfGroup];
  std::uint32_t ready_count_ = 0, idle_count_ = 0;
};

// Finds where rays, which are asked about in ascending order, enter the scene. Those that miss it are
// answered.
class RayPlaces {
 public:
  RayPlaces(const RayBatch& batch, std::uint32_t first, std::uint32_t last)
      : batch_(batch), next_(first), last_(last) {
    group_.reach = batch.options.reach;
  }

  bool operator()(std::uint32_t ray, double* out) {
    if (ray == next_) find_places();
    const std::uint32_t i = ray + kRaysOfGroup - next_;
    if ((meets_ >> i & 1) == 0) {
      batch_.miss(ray);
      return false;
    }
    for (int k = 0; k < 3; ++k) out[k] = place_[k][i];
    return true;
  }

 private:
  void find_places() {
    for (std::uint32_t i = 0; i < kRaysOfGroup; ++i)
      set_ray(group_, i, batch_.options, std::min(next_ + i, last_ - 1));
    batch_.ways.make_ready(group_);
    const WorldBox bounds = batch_.bodies.bounds();
    meets_ = batch_.ways.place(group_, bounds, place_);
    next_ += kRaysOfGroup;
  }

  const RayBatch& batch_;
  std::uint32_t next_, last_;  // the first ray of the next group, and the end
  RayGroup group_;
  double place_[3][kRaysOfGroup];
  unsigned meets_ = 0;
};

// Rays that enter the scene near each other follow each other; those that miss it are answered at once.
void RayBatch::answer(std::uint32_t first, std::uint32_t last, RayWorker& worker) const {
  RayPlaces places(*this, first, last);
  if (!worker.order.make(first, last, places)) {
    worker.enough_memory = false;
    return;
  }
  RayFeed feed(*this, worker);
  const auto next = [](void* context, std::uint32_t number, RayTask& task) {
    return static_cast<RayFeed*>(context)->next(number, task);
  };
  walk({next, &feed});
}

}  // namespace

struct RayQuery::State : Allocated {
  RayStreamWalk walk = best_way(ray_stream_walk);
  const RayGroupWays& ways = *best_way(ray_group_ways);
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
  if (!scene.threads->provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  if (!state.workers.provide(workers) || !rows_.resize(all ? 0 : count) ||
      !state.begin.resize(all ? count + 1 : 0))
    return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < workers; ++i) state.workers[i].begin(scene, options.hits);
  const RayBatch batch = {scene,
                          state.bodies,
                          options,
                          state.walk,
                          state.ways,
                          workers,
                          all ? nullptr : rows_.data(),
                          all ? state.begin.data() + 1 : nullptr};
  const std::size_t part = std::clamp(count / (4 * workers), kProbesAtOnce, kMostRaysInPart);
  scene.threads->for_parts(workers, count, part, [&](std::size_t i, std::size_t end, std::uint32_t worker) {
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
