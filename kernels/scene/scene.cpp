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

// Near pairs that a thread looks at at a time.
constexpr std::size_t kNearAtOnce = 4096;

// Bodies that a worker poses at a time: some microseconds of work.
constexpr std::size_t kBodiesAtOnce = 64;

// So many bodies, or fewer, are tested against all, without a tree.
constexpr std::size_t kFewChanged = 16;

// Whether a body that was placed, and not removed, stands as another instance says.
bool stands_so(const Instance& x, const Instance& y) {
  return x.asset != kNoIndex && x.asset == y.asset && std::memcmp(&x.pose, &y.pose, sizeof(Pose)) == 0;
}

// The box of a removed body: it meets none, as its lower bounds are above all upper ones.
constexpr double kFar = kLargestWorldCoordinate;
constexpr WorldBox kNowhere = {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};

bool meet(const WorldBox& a, const WorldBox& b) {
  bool meet = true;
  for (int k = 0; k < 3; ++k) meet = meet && a.lo[k] <= b.hi[k] && b.lo[k] <= a.hi[k];
  return meet;
}

template <typename Entry>
const Entry* data_or_null(const Buffer<Entry>& entries) {
  return entries.size() != 0 ? entries.data() : nullptr;
}

}  // namespace

PairFilter SceneState::filter() const {
  return {data_or_null(motion), data_or_null(group), data_or_null(mask), data_or_null(world), excluded};
}

void SceneState::forget_bodies() {
  ++version;
  instances.clear();
  bodies.clear();
  boxes.clear();
  changed_.clear();
  changed_count_ = 0;
  removed_ = 0;
  motion.clear();
  group.clear();
  mask.clear();
  world.clear();
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
  if (!threads.provide(workers)) return fail(Status::kCannotStartThread, 0);
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
  threads.for_parts(workers, placed.size(), kBodiesAtOnce, pose_part);
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

// Whether the entries are others than before; they are copied then. They are cleared where there is no
// memory.
template <typename Entry>
bool SceneState::copy_entries(const Entry* from, Buffer<Entry>& to) {
  const std::size_t count = from != nullptr ? instances.size() : 0;
  if (to.size() == count && (count == 0 || std::memcmp(to.data(), from, count * sizeof(Entry)) == 0))
    return false;
  if (to.resize(count)) {
    std::copy_n(from, count, to.data());
  } else {
    to.clear();
  }
  return true;
}

// The caller may have changed a table of excluded pairs in its place, so the pairs are found anew.
Status SceneState::set_filter(const PairFilter& filter) {
  const bool other_motion = copy_entries(filter.motion, motion);
  const bool other_group = copy_entries(filter.group, group), other_mask = copy_entries(filter.mask, mask);
  const bool other_world = copy_entries(filter.world, world);
  const bool other_kind = other_motion || other_group || other_mask || other_world;
  const bool other_excluded = excluded.slots != nullptr || filter.excluded.slots != nullptr;
  excluded = filter.excluded;
  if (other_motion || other_world) fixed_kept_ = false;
  if (other_kind) near_.forget();
  if (other_kind || other_excluded) found_of_.valid = false;
  const bool all_there = (filter.motion == nullptr || motion.size() == instances.size()) &&
                         (filter.group == nullptr || group.size() == instances.size()) &&
                         (filter.mask == nullptr || mask.size() == instances.size()) &&
                         (filter.world == nullptr || world.size() == instances.size());
  return all_there ? Status::kOk : fail(Status::kOutOfMemory, 0);
}

// An empty list says that all bodies have the usual entry.
template <typename Entry>
bool SceneState::add_entry(Entry entry, Entry usual, Buffer<Entry>& to, std::uint32_t body,
                           std::size_t count) {
  if (to.size() == 0 && entry == usual) return true;
  if (to.size() == 0) {
    if (!to.resize(count)) return false;
    std::fill_n(to.data(), count, usual);
  }
  while (to.size() < count) {
    if (!to.push(usual)) return false;
  }
  to[body] = entry;
  return true;
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
    drop(instances), drop(bodies), drop(boxes), drop(changed_), drop(motion), drop(group), drop(mask);
    drop(world);
    return fail(status, 0);
  };
  if (count > before &&
      !(instances.push({kNoIndex, {}}) && bodies.push({}) && boxes.push(kNowhere) && changed_.push(0)))
    return shrink(Status::kOutOfMemory);
  // The broad phase's tree of fixed bodies is of as many bodies as there were, and may have the removed one.
  if (count > before || (free < motion.size() && motion[free] == Motion::fixed)) fixed_kept_ = false;
  const BodyFilter usual;
  if (!add_entry(filter.motion, usual.motion, motion, free, count) ||
      !add_entry(filter.group, usual.group, group, free, count) ||
      !add_entry(filter.mask, usual.mask, mask, free, count) ||
      !add_entry(filter.world, usual.world, world, free, count))
    return shrink(Status::kOutOfMemory);
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
  if (motion.size() == 0 && what == Motion::moving) return Status::kOk;
  if (!add_entry(what, Motion::moving, motion, body, instances.size())) return fail(Status::kOutOfMemory, 0);
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

Status SceneState::take_pairs(std::span<const ObjectPair> given, Buffer<ObjectPair>& taken) {
  if (given.size() >= kNoIndex) return fail(Status::kTooManyPairs, 0);
  if (!taken.resize(given.size())) return fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (!is_body(given[i].a) || !is_body(given[i].b)) return fail(Status::kUnknownInstance, i);
    taken[i] = given[i];
  }
  return Status::kOk;
}

Status SceneState::take_or_find_pairs(const std::span<const ObjectPair>* given, double reach, bool self_pairs,
                                      Buffer<ObjectPair>& taken) {
  if (given != nullptr) return take_pairs(*given, taken);
  if (const Status status = find_pairs(reach, self_pairs); status != Status::kOk) {
    taken.clear();
    return status;
  }
  if (!taken.resize(found_.size())) return fail(Status::kOutOfMemory, 0);
  std::copy_n(found_.data(), found_.size(), taken.data());
  return Status::kOk;
}

Status SceneState::find_pairs(double reach, bool self_pairs) {
  if (const Status status = check_reach(reach); status != Status::kOk) return fail(status, 0);
  const bool same = found_of_.valid && found_of_.reach == reach && found_of_.self_pairs == self_pairs;
  if (same && changed_count_ == 0) return Status::kOk;
  bool any_fixed = false;
  for (std::uint32_t i = 0; i < motion.size(); ++i) {
    const bool is_fixed = motion[i] == Motion::fixed;
    any_fixed = any_fixed || (is_fixed && is_body(i));
    fixed_kept_ = fixed_kept_ && !(is_fixed && changed_[i] != 0);
  }
  bool few = same && any_fixed == any_fixed_ && changed_count_ <= kFewChanged;
  any_fixed_ = any_fixed;
  found_of_ = {false, reach, self_pairs};
  if (!few && boxes.size() <= kFewChanged) {
    few = true;
    found_.clear();
    std::fill_n(changed_.data(), changed_.size(), std::uint8_t{1});
  }
  const Status status = few ? search_changed() : search_all();
  if (status != Status::kOk) return fail(status, 0);
  std::fill_n(changed_.data(), changed_.size(), std::uint8_t{0});
  changed_count_ = 0;
  found_of_.valid = true;
  return Status::kOk;
}

// Boxes within reach of each other meet when each is larger by half of it; or one by all of it where the
// other is fixed and kept as it is, for any reach. Errors of levels need no more: a world box is made of
// bounds that hold all levels, the finest one too, which is what questions are about.
WorldBox SceneState::box_within_reach(std::uint32_t body) const {
  const bool is_fixed = motion.size() != 0 && motion[body] == Motion::fixed;
  if (is_fixed || !is_body(body)) return boxes[body];
  return grown(boxes[body], any_fixed_ ? found_of_.reach : 0.5 * found_of_.reach);
}

bool SceneState::widen_boxes() {
  if (!(found_of_.reach > 0)) return true;
  if (!reach_boxes_.resize(boxes.size())) return false;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) reach_boxes_[i] = box_within_reach(i);
  return true;
}

// Keeps a tree of the fixed bodies as they stand, where there are any.
Status SceneState::keep_fixed_bodies() {
  any_fixed_ =
      std::find(motion.data(), motion.data() + motion.size(), Motion::fixed) != motion.data() + motion.size();
  if (!any_fixed_) broad_phase_.forget_fixed();
  if (!any_fixed_ || fixed_kept_) return Status::kOk;
  const std::uint32_t workers = workers_for(boxes.size(), kBodiesAtOnce);
  if (!threads.provide(workers)) return Status::kCannotStartThread;
  const Status status =
      broad_phase_.keep_fixed(boxes.view(), motion.view(), data_or_null(world), threads, workers);
  fixed_kept_ = status == Status::kOk;
  return status;
}

Status SceneState::search_by_device() {
  if (!widen_boxes()) return Status::kOutOfMemory;
  device->allocator = current_allocator();
  Status status = device->find_pairs(*this, found_of_.reach, fixed_kept_, fresh_);
  const PairFilter asked = filter();
  for (std::uint32_t i = 0; found_of_.self_pairs && i < boxes.size() && status == Status::kOk; ++i) {
    if (is_body(i) && asked.looks_at(i, i) && !fresh_.push({i, i})) status = Status::kOutOfMemory;
  }
  if (status == Status::kOk && found_of_.self_pairs) std::sort(fresh_.data(), fresh_.data() + fresh_.size());
  std::swap(found_, fresh_);
  return status;
}

// Whether the near pairs have all that meet; they are found anew where that pays. A caller may change the
// excluded pairs in their place, so near ones may be excluded.
bool SceneState::near_pairs_hold(std::uint32_t workers) {
  if (found_of_.self_pairs || removed_ != 0) return false;
  if (near_.hold(asked_boxes())) return true;
  if (!near_.are_due()) return false;
  const auto is_fixed = [&](std::uint32_t i) { return motion.size() != 0 && motion[i] == Motion::fixed; };
  PairFilter all = filter();
  all.excluded = {};
  const bool found = near_.widen(asked_boxes(), is_fixed) &&
                     broad_phase_.find_pairs(near_.boxes(), all, false, threads, workers) == Status::kOk &&
                     near_.take(broad_phase_.pairs());
  if (!found) near_.forget();
  return found;
}

// Finds those of the near pairs that meet, a part at a time.
Status SceneState::take_near_pairs() {
  const std::span<const ObjectPair> near = near_.pairs();
  const std::span<const WorldBox> of = asked_boxes();
  const std::size_t parts = (near.size() + kNearAtOnce - 1) / kNearAtOnce;
  const std::uint32_t workers = workers_for(parts, 1);
  if (!found_.resize(near.size()) || !meeting_.resize(parts)) return Status::kOutOfMemory;
  if (!threads.provide(workers)) return Status::kCannotStartThread;
  ObjectPair* const found = found_.data();
  threads.for_parts(workers, parts, 1, [&](std::size_t part, std::size_t last, std::uint32_t) {
    for (; part < last; ++part) {
      const std::size_t begin = part * kNearAtOnce, end = std::min(begin + kNearAtOnce, near.size());
      std::size_t next = begin;
      for (std::size_t i = begin; i < end; ++i) {
        const ObjectPair pair = near[i];
        found[next] = pair;
        next += overlap(of[pair.a], of[pair.b]) && !excluded.contains(pair.a, pair.b);
      }
      meeting_[part] = static_cast<std::uint32_t>(next - begin);
    }
  });
  std::size_t count = 0;
  for (std::size_t part = 0; part < parts; ++part) {
    const ObjectPair* const first = found + part * kNearAtOnce;
    std::copy(first, first + meeting_[part], found + count);
    count += meeting_[part];
  }
  return found_.resize(count) ? Status::kOk : Status::kOutOfMemory;
}

// A removed body may still be a pair: with itself, which is not asked of its box, or where reach is infinite.
Status SceneState::search_all() {
  if (device != nullptr) return search_by_device();
  if (const Status status = keep_fixed_bodies(); status != Status::kOk) return status;
  if (!widen_boxes()) return Status::kOutOfMemory;
  const std::uint32_t workers = workers_for(broad_phase_.free_count(boxes.size()), kBodiesAtOnce);
  if (!threads.provide(workers)) return Status::kCannotStartThread;
  if (near_pairs_hold(workers)) return take_near_pairs();
  const Status status =
      broad_phase_.find_pairs(asked_boxes(), filter(), found_of_.self_pairs, threads, workers);
  if (status != Status::kOk) return status;
  const std::span<const ObjectPair> all = broad_phase_.pairs();
  if (!found_.resize(all.size())) return Status::kOutOfMemory;
  ObjectPair* const begin = found_.data();
  ObjectPair* end = begin;
  if (removed_ == 0) {
    end = std::copy(all.begin(), all.end(), begin);
  } else {
    end = std::copy_if(all.begin(), all.end(), begin,
                       [&](const ObjectPair& pair) { return is_body(pair.a) && is_body(pair.b); });
  }
  return found_.resize(static_cast<std::size_t>(end - begin)) ? Status::kOk : Status::kOutOfMemory;
}

// The pairs of few bodies that changed, which are looked for among all, instead of those that they had.
Status SceneState::search_changed() {
  const bool within_reach = found_of_.reach > 0;
  if (within_reach && !reach_boxes_.resize(boxes.size())) return Status::kOutOfMemory;
  const Buffer<WorldBox>& of = within_reach ? reach_boxes_ : boxes;
  for (std::uint32_t i = 0; within_reach && i < boxes.size(); ++i) {
    if (changed_[i] != 0) reach_boxes_[i] = box_within_reach(i);
  }
  const PairFilter asked = filter();
  fresh_.clear();
  for (const ObjectPair& pair : found_.view()) {
    if (changed_[pair.a] == 0 && changed_[pair.b] == 0 && !fresh_.push(pair)) return Status::kOutOfMemory;
  }
  const std::size_t kept = fresh_.size();
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (changed_[i] == 0 || !is_body(i)) continue;
    for (std::uint32_t j = 0; j < boxes.size(); ++j) {
      if (j == i ? !found_of_.self_pairs : (changed_[j] != 0 && j < i) || !meet(of[i], of[j])) continue;
      if (!is_body(j)) continue;  // with an infinite reach even its box is met
      if (asked.looks_at(i, j) && !fresh_.push({std::min(i, j), std::max(i, j)})) return Status::kOutOfMemory;
    }
  }
  if (fresh_.size() >= kNoIndex) return Status::kTooManyPairs;
  ObjectPair* const begin = fresh_.data();
  ObjectPair* const end = begin + fresh_.size();
  std::sort(begin + kept, end);
  if (!found_.resize(fresh_.size())) return Status::kOutOfMemory;
  std::merge(begin, begin + kept, begin + kept, end, found_.data());
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
