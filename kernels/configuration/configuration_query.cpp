#include "tandem/kernels/configuration_query.h"

#include <algorithm>
#include <atomic>

#include "kernels/common/check_options.h"
#include "kernels/contact/first_contact.h"
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

// A pair whose boxes meet, and how far these reach into each other in their shallowest direction.
struct Meeting {
  const PosedTree *a, *b;
  ObjectPair bodies;
  double depth;
};

double depth_of(const WorldBox& a, const WorldBox& b) {
  double depth = std::min(a.hi[0], b.hi[0]) - std::max(a.lo[0], b.lo[0]);
  for (int k = 1; k < 3; ++k)
    depth = std::min(depth, std::min(a.hi[k], b.hi[k]) - std::max(a.lo[k], b.lo[k]));
  return depth;
}

}  // namespace

struct ConfigurationQuery::State : Allocated {
  struct Worker {
    Buffer<PosedTree> trees;  // of the bodies that move, in this configuration
    Buffer<WorldBox> boxes;   // larger by the clearance
    Buffer<Meeting> meetings;
    FirstContact first_contact;
    Buffer<ConfigurationPair> found;
    ConfigurationCounters counters;
    bool enough_memory = true;
  };

  bool stands_as_before(const SceneState& scene, std::span<const std::uint32_t> bodies) const;
  Status prepare(const SceneState& scene, const ConfigurationOptions& options);
  Status check_bodies(SceneState& scene, std::span<const std::uint32_t> bodies);
  void work(const SceneState& scene, const ConfigurationOptions& options, std::size_t configuration,
            Worker& worker);
  bool pose(const SceneState& scene, const ConfigurationOptions& options, std::size_t configuration,
            Worker& worker);
  bool meet(const SceneState& scene, const ConfigurationOptions& options, Worker& worker) const;

  PairFilter filter;
  Buffer<std::uint8_t> moves;  // of each body of the scene
  Buffer<MovingPair> moving_pairs;
  BroadPhase standing;  // keeps the boxes of those that stand
  SceneVersion standing_of;
  Buffer<std::uint32_t> moved_before;  // the bodies that did not stand then
  Buffer<Motion> motion;
  PerWorker<Worker> workers;
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
    worker.boxes[i] = options.within > 0 ? grown(box, options.within) : box;
  }
  return true;
}

// Finds the pairs whose boxes meet, the deepest first: most of those that touch are among these. False: out
// of memory.
bool ConfigurationQuery::State::meet(const SceneState& scene, const ConfigurationOptions& options,
                                     Worker& worker) const {
  const std::span<const std::uint32_t> bodies = options.bodies;
  worker.meetings.clear();
  bool enough_memory = true;
  const auto add = [&](const PosedTree& a, const PosedTree& b, const ObjectPair& pair, double depth) {
    const bool in_order = pair.a < pair.b;
    enough_memory =
        enough_memory && worker.meetings.push({in_order ? &a : &b,
                                               in_order ? &b : &a,
                                               {std::min(pair.a, pair.b), std::max(pair.a, pair.b)},
                                               depth});
  };
  for (const MovingPair& pair : moving_pairs.view()) {
    const WorldBox &a = worker.boxes[pair.a], &b = worker.boxes[pair.b];
    if (overlap(a, b))
      add(worker.trees[pair.a], worker.trees[pair.b], {bodies[pair.a], bodies[pair.b]}, depth_of(a, b));
  }
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    const WorldBox& box = worker.boxes[i];
    standing.visit_kept(box, [&](std::uint32_t other) {
      if (filter.looks_at(bodies[i], other))
        add(worker.trees[i], scene.bodies[other], {bodies[i], other}, depth_of(box, scene.boxes[other]));
    });
  }
  std::sort(worker.meetings.data(), worker.meetings.data() + worker.meetings.size(),
            [](const Meeting& x, const Meeting& y) {
              return x.depth != y.depth ? x.depth > y.depth : x.bodies < y.bodies;
            });
  return enough_memory;
}

void ConfigurationQuery::State::work(const SceneState& scene, const ConfigurationOptions& options,
                                     std::size_t configuration, Worker& worker) {
  if (!pose(scene, options, configuration, worker)) return;
  worker.enough_memory = meet(scene, options, worker);
  bool touching = false;
  for (const Meeting& meeting : worker.meetings.view()) {
    if (!worker.enough_memory) return;
    bool touch = false;
    ++worker.counters.object_pairs;
    worker.enough_memory = worker.first_contact.find(*meeting.a, *meeting.b, options.within, touch);
    if (!touch) continue;
    touching = true;
    const ConfigurationPair row = {static_cast<std::uint32_t>(configuration), meeting.bodies.a,
                                   meeting.bodies.b};
    worker.enough_memory = worker.enough_memory && worker.found.push(row);
    if (!options.all_pairs) break;
  }
  worker.counters.touching += touching;
}

Status ConfigurationQuery::answer(SceneState& scene, const ConfigurationOptions& options) {
  const std::size_t moving = options.bodies.size();
  State* const state = state_.provide();
  if (state == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  if (scene.device != nullptr) return scene.fail(Status::kBadOption, 0);
  if (const Status status = check_within(options.within); status != Status::kOk) return scene.fail(status, 0);
  if (const Status status = state->check_bodies(scene, options.bodies); status != Status::kOk) return status;
  if (moving == 0 ? !options.poses.empty() : options.poses.size() % moving != 0)
    return scene.fail(Status::kMotionMismatch, options.poses.size());
  const std::size_t count = moving == 0 ? 0 : options.poses.size() / moving;
  if (count >= kNoIndex) return scene.fail(Status::kTooManyPairs, 0);
  if (const Status status = state->prepare(scene, options); status != Status::kOk)
    return scene.fail(status, 0);

  const std::uint32_t workers = scene.workers_for(count, kConfigurationsAtOnce);
  if (!scene.threads.provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  if (!state->workers.provide(workers)) return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < workers; ++i) {
    State::Worker& worker = state->workers[i];
    worker.found.clear();
    worker.counters = {};
    worker.enough_memory = worker.trees.resize(moving) && worker.boxes.resize(moving);
    worker.first_contact.begin();
  }
  state->first_refused = options.poses.size();
  scene.threads.for_parts(workers, count, kConfigurationsAtOnce,
                          [&](std::size_t i, std::size_t end, std::uint32_t worker) {
                            for (; i < end && state->workers[worker].enough_memory; ++i)
                              state->work(scene, options, i, state->workers[worker]);
                          });
  if (const std::size_t refused = state->first_refused; refused != options.poses.size()) {
    PosedTree tree;
    WorldBox box;
    const std::uint32_t body = options.bodies[refused % moving];
    return scene.fail(scene.posed({scene.instances[body].asset, options.poses[refused]}, tree, box), refused);
  }
  rows_.clear();
  counters_ = {count, 0, 0, 0};
  for (std::uint32_t i = 0; i < workers; ++i) {
    State::Worker& worker = state->workers[i];
    bool enough_memory = worker.enough_memory;
    for (const ConfigurationPair& row : worker.found.view()) enough_memory = enough_memory && rows_.push(row);
    if (!enough_memory) return scene.fail(Status::kOutOfMemory, 0);
    worker.counters.block_pairs = worker.first_contact.block_pairs();
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
