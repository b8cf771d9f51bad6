#include "tandem/kernels/scene.h"

#include <atomic>
#include <cstring>
#include <utility>

#include "kernels/common/check_options.h"
#include "kernels/common/instance_check.h"
#include "kernels/geometry/level_error.h"
#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

// Returns whether a body that was placed, and not removed, stands as another instance says.
bool stands_so(const Instance& x, const Instance& y) {
  return x.asset != kNoIndex && x.asset == y.asset && std::memcmp(&x.pose, &y.pose, sizeof(Pose)) == 0;
}

// The box of a removed body: it meets none, as its lower bounds are above all upper ones.
constexpr double kFar = kLargestWorldCoordinate;
constexpr WorldBox kNowhere = {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};

}  // namespace

PairFilter SceneState::filter() const {
  return columns.filter(excluded);
}

void SceneState::forget_bodies() {
  ++version;
  instances.clear();
  bodies.clear();
  boxes.clear();
  changed_.clear();
  changed_count_ = 0;
  removed_ = 0;
  columns.shrink(0);
  excluded = {};
  found_of_.valid = fixed_kept_ = false;
  near_.forget();
  broad_phase_.forget_fixed();
}

bool SceneState::reserve_bodies(std::size_t count) {
  return instances.resize(count) && bodies.resize(count) && boxes.resize(count) && changed_.resize(count);
}

Status SceneState::posed(const Instance& instance, PosedTree& tree, WorldBox& box) const {
  Pose stored;
  const Status status = pose_instance(assets.data(), static_cast<std::uint32_t>(assets.size()),
                                      instance.asset, instance.pose, stored, box);
  if (status != Status::kOk) return status;
  const SceneAsset& asset = assets[instance.asset];
  tree = {asset.tree, asset.extent, asset.grid, stored,
          posed_level_error(asset.tree, asset.lower, asset.upper, stored)};
  return Status::kOk;
}

// A body's tree, pose of stored coordinates and world box. After an error nothing has changed.
Status SceneState::pose(std::uint32_t body, const Instance& instance) {
  PosedTree tree;
  WorldBox box;
  const Status status = posed(instance, tree, box);
  if (status != Status::kOk) return status;
  bodies[body] = tree;
  boxes[body] = box;
  instances[body] = instance;
  return Status::kOk;
}

void SceneState::note_change(std::uint32_t body) {
  ++version;
  changed_count_ += changed_[body] == 0;
  changed_[body] = 1;
}

// Every part ends with its own first instance that is refused; the first of these is to blame.
Status SceneState::pose_all(std::span<const Instance> placed, bool some_stand) {
  const std::uint32_t workers = workers_for(placed.size(), kBodiesAtOnce);
  if (!threads->provide(workers)) return fail(Status::kCannotStartThread, 0);
  std::atomic<std::size_t> first_refused = placed.size(), changes = 0;
  const auto pose_part = [&](std::size_t i, std::size_t end, std::uint32_t) {
    std::size_t changed_here = 0;
    for (; i < end; ++i) {
      if (some_stand && stands_so(instances[i], placed[i])) continue;
      if (pose(static_cast<std::uint32_t>(i), placed[i]) != Status::kOk) break;
      changed_here += changed_[i] == 0;
      changed_[i] = 1;
    }
    changes += changed_here;
    std::size_t first = first_refused;
    while (i < end && i < first && !first_refused.compare_exchange_weak(first, i)) {
    }
  };
  threads->for_parts(workers, placed.size(), kBodiesAtOnce, pose_part);
  changed_count_ += changes;
  const std::size_t refused = first_refused;
  if (refused == placed.size()) return Status::kOk;
  return fail(pose(static_cast<std::uint32_t>(refused), placed[refused]), refused);
}

Status SceneState::place(std::span<const Instance> placed, const PairFilter& filter) {
  const auto failed = [&](Status status) {
    forget_bodies();
    return status;
  };
  if (placed.size() >= kNoIndex) return failed(fail(Status::kTooManyInstances, 0));
  if (filter.excluded.instances > placed.size())
    return failed(fail(Status::kUnknownInstance, filter.excluded.row));
  ++version;
  const bool some_stand = placed.size() == instances.size();
  if (!some_stand) {
    forget_bodies();
    if (!reserve_bodies(placed.size())) return failed(fail(Status::kOutOfMemory, 0));
    std::fill_n(changed_.data(), placed.size(), std::uint8_t{0});
  }
  if (const Status status = pose_all(placed, some_stand); status != Status::kOk) return failed(status);
  removed_ = 0;
  const Status status = set_filter(filter);
  return status == Status::kOk ? status : failed(status);
}

// The caller may have changed a table of excluded pairs in its place, so the pairs are found anew.
Status SceneState::set_filter(const PairFilter& filter) {
  const FilterColumns::Changes changes = columns.assign(filter, instances.size());
  const bool other_excluded = excluded.slots != nullptr || filter.excluded.slots != nullptr;
  excluded = filter.excluded;
  if (changes.motion || changes.world) fixed_kept_ = false;
  if (changes.any()) near_.forget();
  if (changes.any() || other_excluded) found_of_.valid = false;
  return changes.complete ? Status::kOk : fail(Status::kOutOfMemory, 0);
}

Status SceneState::add(const Instance& instance, const BodyFilter& filter, std::uint32_t& body) {
  const std::size_t before = instances.size();
  std::uint32_t free = 0;
  while (removed_ != 0 && is_body(free)) ++free;
  if (removed_ == 0) free = static_cast<std::uint32_t>(before);
  const std::size_t count = std::max<std::size_t>(before, std::size_t{free} + 1);
  if (count >= kNoIndex) return fail(Status::kTooManyInstances, 0);
  const auto shrink = [&](Status status) {
    const auto drop = [&](auto& entries) { (void)entries.resize(std::min(entries.size(), before)); };
    drop(instances), drop(bodies), drop(boxes), drop(changed_);
    columns.shrink(before);
    return fail(status, 0);
  };
  if (count > before &&
      !(instances.push({kNoIndex, {}}) && bodies.push({}) && boxes.push(kNowhere) && changed_.push(0)))
    return shrink(Status::kOutOfMemory);
  // The broad phase's tree of fixed bodies is of as many bodies as there were, and may have the removed one.
  if (count > before || is_fixed(free)) fixed_kept_ = false;
  if (!columns.set(free, filter, count)) return shrink(Status::kOutOfMemory);
  if (const Status status = pose(free, instance); status != Status::kOk) return shrink(status);
  removed_ -= count == before;
  near_.forget();
  note_change(free);
  if (count > before && reach_boxes_.size() == before && !reach_boxes_.push(kNowhere))
    found_of_.valid = false;
  body = free;
  return Status::kOk;
}

Status SceneState::move(std::span<const std::uint32_t> numbers, std::span<const Pose> poses) {
  if (numbers.size() != poses.size()) return fail(Status::kMotionMismatch, 0);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!is_body(numbers[i])) return fail(Status::kUnknownInstance, i);
    Pose stored;
    WorldBox box;
    const Status status = pose_instance(assets.data(), static_cast<std::uint32_t>(assets.size()),
                                        instances[numbers[i]].asset, poses[i], stored, box);
    if (status != Status::kOk) return fail(status, i);
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    (void)pose(numbers[i], {instances[numbers[i]].asset, poses[i]});
    note_change(numbers[i]);
  }
  return Status::kOk;
}

Status SceneState::set_motion(std::uint32_t body, Motion what) {
  if (!is_body(body)) return fail(Status::kUnknownInstance, 0);
  if (columns.motion.size() == 0 && what == Motion::moving) return Status::kOk;
  if (!columns.set_motion(body, what, instances.size())) return fail(Status::kOutOfMemory, 0);
  ++version;
  found_of_.valid = fixed_kept_ = false;
  near_.forget();
  return Status::kOk;
}

Status SceneState::remove(std::uint32_t body) {
  if (!is_body(body)) return fail(Status::kUnknownInstance, 0);
  instances[body].asset = kNoIndex;
  boxes[body] = kNowhere;
  note_change(body);
  ++removed_;
  return Status::kOk;
}

Scene::Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

SceneState* Scene::state() {
  if (state_ == nullptr) state_.reset(new (std::nothrow) SceneState);
  return state_.get();
}

void destroy(SceneDevice* device) {
  delete device;
}

Status Scene::answer_on(SceneDevice* device) {
  std::unique_ptr<SceneDevice> taken(device);
  SceneState* const s = state();
  if (s == nullptr || device == nullptr) return Status::kOutOfMemory;
  if (device->state_bytes != sizeof(SceneState)) return Status::kUnsupportedVersion;
  s->device = std::move(taken);
  return Status::kOk;
}

Status Scene::set_threads(std::uint32_t threads) {
  SceneState* const s = state();
  if (s == nullptr) return Status::kOutOfMemory;
  if (threads < 1 || threads > kMostSceneThreads) return s->fail(Status::kBadOption, 0);
  s->most_workers = threads;
  return Status::kOk;
}

Status share_threads(WorkerThreads& threads, std::uint32_t count, Scene& scene) {
  const Status status = scene.set_threads(count);
  if (status == Status::kOk) scene.state()->threads = &threads;
  return status;
}

Status Scene::place(std::span<const Instance> instances, const PairFilter& filter) {
  SceneState* const s = state();
  return s != nullptr ? s->place(instances, filter) : Status::kOutOfMemory;
}

Status Scene::add(const Instance& instance, std::uint32_t& body, const BodyFilter& filter) {
  SceneState* const s = state();
  return s != nullptr ? s->add(instance, filter, body) : Status::kOutOfMemory;
}

Status Scene::move(std::span<const std::uint32_t> bodies, std::span<const Pose> poses) {
  SceneState* const s = state();
  return s != nullptr ? s->move(bodies, poses) : Status::kOutOfMemory;
}

Status Scene::move(std::uint32_t body, const Pose& pose) {
  return move(std::span(&body, 1), std::span(&pose, 1));
}

Status Scene::set_motion(std::uint32_t body, Motion motion) {
  SceneState* const s = state();
  return s != nullptr ? s->set_motion(body, motion) : Status::kOutOfMemory;
}

Status Scene::remove(std::uint32_t body) {
  SceneState* const s = state();
  return s != nullptr ? s->remove(body) : Status::kOutOfMemory;
}

Status Scene::find_pairs(double reach, bool self_pairs) {
  SceneState* const s = state();
  if (s == nullptr) return Status::kOutOfMemory;
  const Status status = s->take_or_find_pairs(nullptr, reach, self_pairs, s->pairs);
  if (status != Status::kOk) s->pairs.clear();
  return status;
}

std::span<const ObjectPair> Scene::pairs() const {
  return state_ != nullptr ? state_->pairs.view() : std::span<const ObjectPair>();
}

std::span<const Instance> Scene::instances() const {
  return state_ != nullptr ? state_->instances.view() : std::span<const Instance>();
}

std::uint64_t Scene::where() const {
  return state_ != nullptr ? state_->where : 0;
}

}  // namespace tandem
