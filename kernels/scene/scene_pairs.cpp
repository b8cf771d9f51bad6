#include <algorithm>
#include <cstring>

#include "kernels/common/check_options.h"
#include "kernels/scene/scene_state.h"

// A scene finds the pairs of its bodies whose boxes meet: all anew, or those of bodies that changed.
namespace tandem {
namespace {

// Near pairs that a thread looks at at a time.
constexpr std::size_t kNearAtOnce = 4096;

// So many bodies, or fewer, are tested against all, without a tree; or one of so many where there is one.
constexpr std::size_t kFewChanged = 16, kBodiesForOneChanged = 32;

// To make a tree takes about as long as it takes to test so many bodies against all. Of few bodies none is
// made.
constexpr std::size_t kSearchesForTree = 64, kFewestForTree = 256;

}  // namespace

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

// Calls visit() eight bodies at a time where none of these changed: most have not.
template <typename Visit>
void SceneState::each_changed(const Visit& visit) const {
  const std::uint8_t* const changed = changed_.data();
  std::uint32_t i = 0;
  const auto count = static_cast<std::uint32_t>(changed_.size());
  while (i < count) {
    std::uint64_t eight = 0;
    if (count - i >= sizeof eight) std::memcpy(&eight, changed + i, sizeof eight);
    if (count - i >= sizeof eight && eight == 0) {
      i += sizeof eight;
      continue;
    }
    for (const std::uint32_t end = std::min<std::uint32_t>(count, i + sizeof eight); i < end; ++i) {
      if (changed[i] != 0) visit(i);
    }
  }
}

// Says whether it pays to look for the pairs of those that changed alone.
bool SceneState::few_changed() const {
  return changed_count_ <= std::max(kFewChanged, boxes.size() / kBodiesForOneChanged);
}

Status SceneState::find_pairs(double reach, bool self_pairs) {
  if (const Status status = check_reach(reach); status != Status::kOk) return fail(status, 0);
  const bool same = found_of_.valid && found_of_.reach == reach && found_of_.self_pairs == self_pairs;
  if (same && changed_count_ == 0) return Status::kOk;
  bool fixed_changed = false;
  each_changed([&](std::uint32_t i) { fixed_changed = fixed_changed || is_fixed(i); });
  fixed_kept_ = fixed_kept_ && !fixed_changed;
  bool few = same && few_changed();
  if (!same || fixed_changed) {
    bool any_fixed = false;
    for (std::uint32_t i = 0; i < columns.motion.size() && !any_fixed; ++i)
      any_fixed = is_fixed(i) && is_body(i);
    few = few && any_fixed == any_fixed_;
    any_fixed_ = any_fixed;
  }
  found_of_ = {false, reach, self_pairs};
  if (!few) tree_.forget();
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
  if (is_fixed(body) || !is_body(body)) return boxes[body];
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
  const Buffer<Motion>& motion = columns.motion;
  any_fixed_ =
      std::find(motion.data(), motion.data() + motion.size(), Motion::fixed) != motion.data() + motion.size();
  if (!any_fixed_) broad_phase_.forget_fixed();
  if (!any_fixed_ || fixed_kept_) return Status::kOk;
  const std::uint32_t workers = workers_for(boxes.size(), kBodiesAtOnce);
  if (!threads->provide(workers)) return Status::kCannotStartThread;
  const Status status =
      broad_phase_.keep_fixed(boxes.view(), motion.view(), filter().world, *threads, workers);
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

// Says whether the near pairs have all that meet; they are found anew where that pays. A caller may change
// the excluded pairs in their place, so near ones may be excluded.
bool SceneState::near_pairs_hold(std::uint32_t workers) {
  if (found_of_.self_pairs || removed_ != 0) return false;
  if (near_.hold(asked_boxes())) return true;
  if (!near_.are_due()) return false;
  PairFilter all = filter();
  all.excluded = {};
  const bool found = near_.widen(asked_boxes(), [&](std::uint32_t i) { return is_fixed(i); }) &&
                     broad_phase_.find_pairs(near_.boxes(), all, false, *threads, workers) == Status::kOk &&
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
  if (!threads->provide(workers)) return Status::kCannotStartThread;
  ObjectPair* const found = found_.data();
  threads->for_parts(workers, parts, 1, [&](std::size_t part, std::size_t last, std::uint32_t) {
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
  if (!threads->provide(workers)) return Status::kCannotStartThread;
  if (near_pairs_hold(workers)) return take_near_pairs();
  const Status status =
      broad_phase_.find_pairs(asked_boxes(), filter(), found_of_.self_pairs, *threads, workers);
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

// Lets the tree follow the boxes that changed. It is made when bodies have been tested against all others so
// often that it would have cost no more.
Status SceneState::follow_changed() {
  const bool within_reach = found_of_.reach > 0;
  if (within_reach && !reach_boxes_.resize(boxes.size())) return Status::kOutOfMemory;
  each_changed([&](std::uint32_t i) {
    if (within_reach) reach_boxes_[i] = box_within_reach(i);
    if (tree_.is_made()) tree_.update(i, asked_boxes()[i], filter());
  });
  if (tree_.is_made() || boxes.size() < kFewestForTree) return Status::kOk;
  searched_alone_ += changed_count_;
  if (searched_alone_ < kSearchesForTree) return Status::kOk;
  searched_alone_ = 0;
  const std::uint32_t workers = workers_for(boxes.size(), kBodiesAtOnce);
  if (!threads->provide(workers)) return Status::kCannotStartThread;
  return tree_.make(asked_boxes(), filter(), *threads, workers);
}

// Visits all bodies whose boxes meet that of one, and maybe others.
template <typename Visit>
void SceneState::each_near(std::uint32_t body, const Visit& visit) const {
  if (tree_.is_made()) return tree_.visit(body, asked_boxes()[body], filter(), visit);
  for (std::uint32_t other = 0; other < boxes.size(); ++other) visit(other);
}

// The pairs of few bodies that changed take the place of those that they had. A removed body is asked for by
// its number: with an infinite reach even its box is met.
Status SceneState::search_changed() {
  if (const Status status = follow_changed(); status != Status::kOk) return status;
  const std::span<const WorldBox> of = asked_boxes();
  const PairFilter asked = filter();
  bool enough_memory = fresh_.resize(found_.size());
  if (!enough_memory) return Status::kOutOfMemory;
  ObjectPair* const unchanged_end =
      std::copy_if(found_.data(), found_.data() + found_.size(), fresh_.data(),
                   [&](const ObjectPair& pair) { return (changed_[pair.a] | changed_[pair.b]) == 0; });
  const auto kept = static_cast<std::size_t>(unchanged_end - fresh_.data());
  enough_memory = fresh_.resize(kept);
  each_changed([&](std::uint32_t i) {
    if (!is_body(i)) return;
    each_near(i, [&](std::uint32_t j) {
      if (j == i ? !found_of_.self_pairs : (changed_[j] != 0 && j < i) || !overlap(of[i], of[j])) return;
      if (is_body(j) && asked.looks_at(i, j))
        enough_memory = enough_memory && fresh_.push({std::min(i, j), std::max(i, j)});
    });
  });
  if (!enough_memory) return Status::kOutOfMemory;
  if (fresh_.size() >= kNoIndex) return Status::kTooManyPairs;
  ObjectPair* const begin = fresh_.data();
  ObjectPair* const end = begin + fresh_.size();
  std::sort(begin + kept, end);
  if (!found_.resize(fresh_.size())) return Status::kOutOfMemory;
  std::merge(begin, begin + kept, begin + kept, end, found_.data());
  return Status::kOk;
}

}  // namespace tandem
