#include "tandem/kernels/configuration_query.h"

#include <algorithm>
#include <atomic>

#include "kernels/common/check_options.h"
#include "kernels/configuration/configuration_worlds.h"
#include "kernels/contact/first_contact.h"
#include "kernels/distance/pair_distance.h"
#include "kernels/scene/body_visit.h"
#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

// Configurations that a worker takes at a time.
constexpr std::size_t kConfigurationsAtOnce = 16;

// This names two of the bodies that move, by their places in the list.
struct MovingPair {
  std::uint32_t a, b;
};

// Bodies and filter of a scene; another after each change. No scene has {}.
struct SceneVersion {
  std::uint64_t assets_id = 0, version = 0;

  bool operator==(const SceneVersion&) const = default;
};

// A pair that is to be decided, and how near its boxes are by gap_of().
struct Candidate {
  const PosedTree *a, *b;
  ObjectPair bodies;
  double gap;
};

Candidate candidate_of(const PosedTree& a, const PosedTree& b, const ObjectPair& bodies, double gap) {
  const bool in_order = bodies.a < bodies.b;
  return {in_order ? &a : &b,
          in_order ? &b : &a,
          {std::min(bodies.a, bodies.b), std::max(bodies.a, bodies.b)},
          gap};
}

void sort_by_gap(Buffer<Candidate>& candidates) {
  std::sort(candidates.data(), candidates.data() + candidates.size(),
            [](const Candidate& x, const Candidate& y) {
              return x.gap != y.gap ? x.gap < y.gap : x.bodies < y.bodies;
            });
}

}  // namespace

struct ConfigurationQuery::State : Allocated {
  struct Worker {
    Buffer<PosedTree> trees;  // of the bodies that move, in this configuration
    Buffer<WorldBox> boxes;   // larger by the clearance
    Buffer<Candidate> candidates;
    FirstContact first_contact;
    DistanceSearch search;
    ConfigurationPair nearest;   // of the last configuration
    NearestTriangles triangles;  // of `nearest`
    Buffer<ConfigurationPair> found;
    ConfigurationCounters counters;
    bool enough_memory = true;

    void begin(std::size_t moving) {
      found.clear();
      counters = {};
      enough_memory = trees.resize(moving) && boxes.resize(moving);
      first_contact.begin();
      search.reset_counters();
    }
  };

  Status check(SceneState& scene, const ConfigurationOptions& options);
  Status walk(SceneState& scene, const ConfigurationOptions& options, std::size_t count);

  bool stands_as_before(const SceneState& scene, std::span<const std::uint32_t> bodies) const;
  Status prepare(const SceneState& scene, const ConfigurationOptions& options);
  Status check_bodies(SceneState& scene, std::span<const std::uint32_t> bodies);
  void work(const SceneState& scene, const ConfigurationOptions& options, std::size_t configuration,
            Worker& worker);
  bool pose(const SceneState& scene, const ConfigurationOptions& options, std::size_t configuration,
            Worker& worker);
  bool meet(const SceneState& scene, const ConfigurationOptions& options, Worker& worker) const;
  void decide(const ConfigurationOptions& options, std::size_t configuration, Worker& worker) const;
  void find_nearest(const SceneState& scene, const ConfigurationOptions& options, std::size_t configuration,
                    Worker& worker) const;
  void bound(const ConfigurationOptions& options, const Candidate& candidate, const NearestTriangles& former,
             Worker& worker) const;

  NearestPhase nearest_phase = best_way(tandem::nearest_phase);
  PairFilter filter;
  Buffer<std::uint8_t> moves;  // of each body of the scene
  Buffer<MovingPair> moving_pairs;
  BroadPhase standing;  // keeps the boxes of those that stand
  SceneVersion standing_of;
  Buffer<std::uint32_t> moved_before;  // the bodies that did not stand then
  Buffer<Motion> motion;
  PerWorker<Worker> workers;
  ConfigurationWorlds worlds;
  std::atomic<std::size_t> first_refused;
};

Status ConfigurationQuery::State::check_bodies(SceneState& scene, std::span<const std::uint32_t> bodies) {
  if (!moves.resize(scene.instances.size())) return scene.fail(Status::kOutOfMemory, 0);
  std::fill_n(moves.data(), moves.size(), std::uint8_t{0});
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!scene.is_body(bodies[i]) || moves[bodies[i]] != 0) return scene.fail(Status::kUnknownInstance, i);
    moves[bodies[i]] = 1;
  }
  return Status::kOk;
}

// Prepares what holds in all configurations: which of the bodies that move the filter looks at, and a tree of
// those that stand, which is kept while the scene stays as it is. Removed bodies have a box that meets
// nothing. The caller may change the table of excluded pairs in its place, so that is asked in every call.
Status ConfigurationQuery::State::prepare(const SceneState& scene, const ConfigurationOptions& options) {
  filter = scene.filter();
  moving_pairs.clear();
  for (std::uint32_t i = 0; i < options.bodies.size(); ++i) {
    for (std::uint32_t j = i + 1; j < options.bodies.size(); ++j) {
      if (filter.looks_at(options.bodies[i], options.bodies[j]) && !moving_pairs.push({i, j}))
        return Status::kOutOfMemory;
    }
  }
  if (stands_as_before(scene, options.bodies)) return Status::kOk;
  standing_of = {};
  if (!motion.resize(moves.size()) || !moved_before.resize(options.bodies.size()))
    return Status::kOutOfMemory;
  std::copy(options.bodies.begin(), options.bodies.end(), moved_before.data());
  for (std::uint32_t i = 0; i < moves.size(); ++i)
    motion[i] = moves[i] != 0 || !scene.is_body(i) ? Motion::moving : Motion::fixed;
  const Status status = standing.keep_fixed(scene.boxes.view(), motion.view(), filter.world);
  if (status == Status::kOk) standing_of = {scene.assets_id, scene.version};
  return status;
}

bool ConfigurationQuery::State::stands_as_before(const SceneState& scene,
                                                 std::span<const std::uint32_t> bodies) const {
  return standing_of == SceneVersion{scene.assets_id, scene.version} &&
         std::ranges::equal(moved_before.view(), bodies);
}

// False: a pose is refused.
bool ConfigurationQuery::State::pose(const SceneState& scene, const ConfigurationOptions& options,
                                     std::size_t configuration, Worker& worker) {
  const std::size_t count = options.bodies.size(), first = configuration * count;
  for (std::size_t i = 0; i < count; ++i) {
    const Instance instance = {scene.instances[options.bodies[i]].asset, options.poses[first + i]};
    WorldBox box;
    if (scene.posed(instance, worker.trees[i], box) != Status::kOk) {
      std::size_t least = first_refused;
      while (first + i < least && !first_refused.compare_exchange_weak(least, first + i)) {
      }
      return false;
    }
    const bool grow = options.find != ConfigurationPairs::nearest && options.within > 0;
    worker.boxes[i] = grow ? grown(box, options.within) : box;
  }
  return true;
}

// Finds the pairs whose boxes meet, the deepest first: most of those that touch are among these. False: out
// of memory.
bool ConfigurationQuery::State::meet(const SceneState& scene, const ConfigurationOptions& options,
                                     Worker& worker) const {
  const std::span<const std::uint32_t> bodies = options.bodies;
  worker.candidates.clear();
  bool enough_memory = true;
  for (const MovingPair& pair : moving_pairs.view()) {
    const WorldBox &a = worker.boxes[pair.a], &b = worker.boxes[pair.b];
    if (!overlap(a, b)) continue;
    enough_memory =
        enough_memory && worker.candidates.push(candidate_of(worker.trees[pair.a], worker.trees[pair.b],
                                                             {bodies[pair.a], bodies[pair.b]}, gap_of(a, b)));
  }
  for (std::uint32_t i = 0; i < bodies.size() && standing.kept_of() != 0; ++i) {
    const WorldBox& box = worker.boxes[i];
    standing.kept().visit(box, [&](std::uint32_t other) {
      if (!filter.looks_at(bodies[i], other)) return;
      enough_memory = enough_memory && worker.candidates.push(
                                           candidate_of(worker.trees[i], scene.bodies[other],
                                                        {bodies[i], other}, gap_of(box, scene.boxes[other])));
    });
  }
  sort_by_gap(worker.candidates);
  return enough_memory;
}

void ConfigurationQuery::State::decide(const ConfigurationOptions& options, std::size_t configuration,
                                       Worker& worker) const {
  bool touching = false;
  for (const Candidate& candidate : worker.candidates.view()) {
    if (!worker.enough_memory) return;
    bool touch = false;
    ++worker.counters.object_pairs;
    worker.enough_memory = worker.first_contact.find(*candidate.a, *candidate.b, options.within, touch);
    if (!touch) continue;
    touching = true;
    worker.enough_memory = worker.enough_memory && worker.found.push({configuration, candidate.bodies.a,
                                                                      candidate.bodies.b, 0, options.within});
    if (options.find == ConfigurationPairs::first) break;
  }
  worker.counters.touching += touching;
}

// Bounds the distance of a pair, unless it is farther than the nearest so far. What is passed over is not
// nearer than `upper` was then, and so not than the least upper bound in the end.
void ConfigurationQuery::State::bound(const ConfigurationOptions& options, const Candidate& candidate,
                                      const NearestTriangles& former, Worker& worker) const {
  ConfigurationPair& nearest = worker.nearest;
  const double reach = std::min(options.within, nearest.upper);
  const NearestTask task = nearest_task(*candidate.a, *candidate.b, options.tolerance);
  const ObjectDistance distance = worker.search.find(task, reach, former, nearest_phase);
  worker.enough_memory = worker.search.found.enough_memory;
  ++worker.counters.object_pairs;
  nearest.lower = std::min(nearest.lower, distance.lower);
  if (distance.upper >= nearest.upper) return;
  nearest.a = candidate.bodies.a;
  nearest.b = candidate.bodies.b;
  nearest.upper = distance.upper;
  worker.triangles = {distance.triangle_a, distance.triangle_b};
}

// Looks at the nearest boxes first, of pairs of moving bodies and then of those with one that stands. What
// was nearest in the configuration before comes first of all, as this is mostly like it; but not from one
// part of the configurations to the next, so that no result depends on the number of threads.
void ConfigurationQuery::State::find_nearest(const SceneState& scene, const ConfigurationOptions& options,
                                             std::size_t configuration, Worker& worker) const {
  const std::span<const std::uint32_t> bodies = options.bodies;
  ConfigurationPair& nearest = worker.nearest;
  if (configuration % kConfigurationsAtOnce == 0) nearest.a = nearest.b = kNoIndex;
  const ObjectPair former = {nearest.a, nearest.b};
  const NearestTriangles former_triangles = worker.triangles;
  nearest = {configuration, kNoIndex, kNoIndex, INFINITY, INFINITY};
  double limit = options.within;
  const auto look_at = [&](const Candidate& candidate) {
    if (!worker.enough_memory || candidate.gap > limit) return;
    bound(options, candidate, candidate.bodies == former ? former_triangles : NearestTriangles{}, worker);
    limit = nearest.upper == 0 ? -1 : std::min(limit, nearest.upper);
  };
  const auto standing_one = [&](std::uint32_t i, std::uint32_t other) {
    return candidate_of(worker.trees[i], scene.bodies[other], {bodies[i], other},
                        distance_between(worker.boxes[i], scene.boxes[other]));
  };
  worker.candidates.clear();
  for (const MovingPair& pair : moving_pairs.view()) {
    const double gap = distance_between(worker.boxes[pair.a], worker.boxes[pair.b]);
    Candidate candidate =
        candidate_of(worker.trees[pair.a], worker.trees[pair.b], {bodies[pair.a], bodies[pair.b]}, gap);
    if (candidate.bodies == former) candidate.gap = -1;
    worker.enough_memory = worker.enough_memory && worker.candidates.push(candidate);
  }
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    const std::uint32_t other = former.a == bodies[i]   ? former.b
                                : former.b == bodies[i] ? former.a
                                                        : kNoIndex;
    if (other != kNoIndex && moves[other] == 0) look_at(standing_one(i, other));
  }
  sort_by_gap(worker.candidates);
  for (const Candidate& candidate : worker.candidates.view()) look_at(candidate);
  for (std::uint32_t i = 0; i < bodies.size() && standing.kept_of() != 0; ++i) {
    const auto gap = [&](const WorldBox& box) { return distance_between(worker.boxes[i], box); };
    visit_bodies(standing.kept(), gap, limit, [&](std::uint32_t other) {
      const Candidate candidate = standing_one(i, other);
      if (candidate.bodies != former && filter.looks_at(bodies[i], other)) look_at(candidate);
    });
  }
  worker.counters.touching += nearest.upper == 0;
  if (nearest.upper == INFINITY) return;
  nearest.lower = std::min(nearest.lower, nearest.upper);
  worker.enough_memory = worker.enough_memory && worker.found.push(nearest);
}

// Condition: the bodies are posed.
void ConfigurationQuery::State::work(const SceneState& scene, const ConfigurationOptions& options,
                                     std::size_t configuration, Worker& worker) {
  if (options.find == ConfigurationPairs::nearest) return find_nearest(scene, options, configuration, worker);
  worker.enough_memory = meet(scene, options, worker);
  decide(options, configuration, worker);
}

Status ConfigurationQuery::State::check(SceneState& scene, const ConfigurationOptions& options) {
  const std::size_t moving = options.bodies.size();
  Status status = options.find == ConfigurationPairs::nearest
                      ? check_distance_options(options.tolerance, options.within)
                      : check_within(options.within);
  if (status != Status::kOk) return scene.fail(status, 0);
  status = check_bodies(scene, options.bodies);
  if (status != Status::kOk) return status;
  if (moving == 0 ? !options.poses.empty() : options.poses.size() % moving != 0)
    return scene.fail(Status::kMotionMismatch, options.poses.size());
  return Status::kOk;
}

// Poses the bodies in all configurations, and where the CPU answers finds what is asked for.
Status ConfigurationQuery::State::walk(SceneState& scene, const ConfigurationOptions& options,
                                       std::size_t count) {
  const std::size_t moving = options.bodies.size();
  const std::uint32_t used = scene.workers_for(count, kConfigurationsAtOnce);
  if (!scene.threads->provide(used)) return scene.fail(Status::kCannotStartThread, 0);
  if (!workers.provide(used)) return scene.fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < workers.size(); ++i) workers[i].begin(moving);
  first_refused = options.poses.size();
  scene.threads->for_parts(used, count, kConfigurationsAtOnce,
                           [&](std::size_t i, std::size_t end, std::uint32_t number) {
                             Worker& worker = workers[number];
                             for (; i < end && worker.enough_memory; ++i) {
                               const bool in_range = pose(scene, options, i, worker);
                               if (in_range && scene.device == nullptr) work(scene, options, i, worker);
                             }
                           });
  for (std::size_t i = 0; i < workers.size(); ++i) {
    if (!workers[i].enough_memory) return scene.fail(Status::kOutOfMemory, 0);
  }
  const std::size_t refused = first_refused;
  if (refused == options.poses.size()) return Status::kOk;
  PosedTree tree;
  WorldBox box;
  const std::uint32_t body = options.bodies[refused % moving];
  return scene.fail(scene.posed({scene.instances[body].asset, options.poses[refused]}, tree, box), refused);
}

Status ConfigurationQuery::answer(SceneState& scene, const ConfigurationOptions& options) {
  State* const state = state_.provide();
  if (state == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  Status status = state->check(scene, options);
  if (status != Status::kOk) return status;
  const bool by_device = scene.device != nullptr;
  if (!by_device) status = state->prepare(scene, options);
  if (status != Status::kOk) return scene.fail(status, 0);
  const std::size_t count = options.bodies.empty() ? 0 : options.poses.size() / options.bodies.size();
  status = state->walk(scene, options, count);
  if (status != Status::kOk) return status;
  rows_.clear();
  counters_ = {count, 0, 0, 0};
  if (by_device) return state->worlds.find(scene, options, state->moves.view(), rows_, counters_);
  for (std::size_t i = 0; i < state->workers.size(); ++i) {
    State::Worker& worker = state->workers[i];
    for (const ConfigurationPair& row : worker.found.view()) {
      if (!rows_.push(row)) return scene.fail(Status::kOutOfMemory, 0);
    }
    worker.counters.block_pairs =
        worker.first_contact.block_pairs() + worker.search.found.counters.block_pairs;
    add_to(counters_, worker.counters,
           {&ConfigurationCounters::touching, &ConfigurationCounters::object_pairs,
            &ConfigurationCounters::block_pairs});
  }
  std::sort(rows_.data(), rows_.data() + rows_.size());
  return Status::kOk;
}

Status ConfigurationQuery::find(Scene& in, const ConfigurationOptions& options) {
  return ask_scene(in, [&](SceneState& scene) { return answer(scene, options); });
}

}  // namespace tandem
