#include "tandem/kernels/moved_query.h"

#include <algorithm>
#include <atomic>

#include "kernels/geometry/pair_motion.h"
#include "kernels/scene/moved_call.h"
#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

// Pairs that a thread decides at a time.
constexpr std::size_t kDecidedAtOnce = 256;

// The place of a pair in the list of the call before.
struct PairRow {
  ObjectPair pair;
  std::uint32_t row;

  friend bool operator<(const PairRow& x, const PairRow& y) {
    return x.pair != y.pair ? x.pair < y.pair : x.row < y.row;
  }
};

}  // namespace

std::uint64_t take_moved_calls(std::uint64_t count) {
  static std::atomic<std::uint64_t> next = 1;
  return next.fetch_add(count);
}

struct MovedQuery::State : Allocated {
  std::uint64_t assets_id = 0;                        // whose boxes these are, and what is kept is of
  std::uint64_t version = 0;                          // of the scene in the last call
  std::uint64_t shapes_id = 0, shapes_id_before = 0;  // of the assets' shapes then, and in the call before
  Buffer<AssetBox> boxes;
  Buffer<PosedBodies> posed_before;
  Buffer<PairRow> places_before;  // sorted

  bool box_assets(const SceneState& scene);
  bool has_bent(const SceneAsset& asset) const { return asset.shape > shapes_id_before; }
  bool place_before();
  void decide(std::size_t from, std::size_t to, const SceneState& scene, std::span<const ObjectPair> pairs,
              const MovedOptions& options, std::uint32_t* kept_rows, PosedBodies* posed) const;
};

// Makes the boxes of the assets. It forgets what was found of other assets.
bool MovedQuery::State::box_assets(const SceneState& scene) {
  if (assets_id != scene.assets_id) {
    assets_id = 0;
    posed_before.clear();
  }
  shapes_id_before = shapes_id;
  if (assets_id == scene.assets_id && shapes_id == scene.shapes_id) return true;
  if (!boxes.resize(scene.assets.size())) return false;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const SceneAsset& asset = scene.assets[i];
    boxes[i] = asset_box(asset.lower, asset.upper, asset.origin);
  }
  assets_id = scene.assets_id;
  shapes_id = scene.shapes_id;
  return true;
}

bool MovedQuery::State::place_before() {
  if (!places_before.resize(posed_before.size())) return false;
  bool ascending = true;
  for (std::uint32_t i = 0; i < posed_before.size(); ++i) {
    places_before[i] = {posed_before[i].pair, i};
    ascending = ascending && (i == 0 || places_before[i - 1] < places_before[i]);
  }
  if (!ascending) std::sort(places_before.data(), places_before.data() + places_before.size());
  return true;
}

// Lists of successive calls are nearly the same, so a pair is mostly found behind the one before it. Of equal
// pairs before, the first is found.
void MovedQuery::State::decide(std::size_t from, std::size_t to, const SceneState& scene,
                               std::span<const ObjectPair> pairs, const MovedOptions& options,
                               std::uint32_t* kept_rows, PosedBodies* posed) const {
  const PairRow *const begin = places_before.data(), *const end = begin + places_before.size(), *next = end;
  for (std::size_t i = from; i < to; ++i) {
    const auto is_first = [&] {
      return next != end && next->pair == pairs[i] && (next == begin || !(next[-1].pair == pairs[i]));
    };
    if (!is_first()) next = std::lower_bound(begin, end, PairRow{pairs[i], 0});
    kept_rows[i] = kNoIndex;
    posed[i] = {pairs[i], scene.instances[pairs[i].a], scene.instances[pairs[i].b]};
    if (!is_first()) continue;
    const PairRow& place = *next++;
    const PosedBodies &before = posed_before[place.row], now = posed[i];
    if (before.a.asset != now.a.asset || before.b.asset != now.b.asset) continue;
    if (has_bent(scene.assets[now.a.asset]) || has_bent(scene.assets[now.b.asset])) continue;
    const double tolerance =
        options.tolerance_of_pair.empty() ? options.tolerance : options.tolerance_of_pair[i];
    if (!is_kept(boxes[now.a.asset], boxes[now.b.asset], {before.a.pose, before.b.pose},
                 {now.a.pose, now.b.pose}, tolerance))
      continue;
    kept_rows[i] = place.row;
    posed[i] = before;
  }
}

Status MovedQuery::answer(SceneState& scene, const std::span<const ObjectPair>* given,
                          const MovedOptions& options) {
  State* const state = state_.provide();
  if (state == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  std::swap(posed_, state->posed_before);
  Status status = scene.take_or_find_pairs(given, 0, false, pairs_);
  if (status == Status::kOk) status = check(scene, options);
  if (status == Status::kOk) status = decide(scene, *state, options);
  if (status != Status::kOk) forget_poses();
  return status;
}

Status MovedQuery::check(SceneState& scene, const MovedOptions& options) const {
  const std::span<const double> of_pair = options.tolerance_of_pair;
  if (!of_pair.empty() && of_pair.size() != pairs_.size()) return scene.fail(Status::kBadOption, 0);
  if (!(options.tolerance >= 0)) return scene.fail(Status::kBadTolerance, 0);
  for (std::size_t i = 0; i < of_pair.size(); ++i) {
    if (!(of_pair[i] >= 0)) return scene.fail(Status::kBadTolerance, i);
  }
  return Status::kOk;
}

Status MovedQuery::decide(SceneState& scene, State& state, const MovedOptions& options) {
  const std::span<const ObjectPair> pairs = pairs_.view();
  if (!state.box_assets(scene) || !state.place_before() || !kept_rows_.resize(pairs.size()) ||
      !posed_.resize(pairs.size()) || !rows_.resize(pairs.size()))
    return scene.fail(Status::kOutOfMemory, 0);
  const std::uint32_t workers = scene.workers_for(pairs.size(), kDecidedAtOnce);
  if (!scene.threads->provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  scene.threads->for_parts(workers, pairs.size(), kDecidedAtOnce,
                           [&](std::size_t from, std::size_t to, std::uint32_t) {
                             state.decide(from, to, scene, pairs, options, kept_rows_.data(), posed_.data());
                           });
  std::size_t moved = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    rows_[moved] = pairs[i];
    moved += kept_rows_[i] == kNoIndex;
  }
  (void)rows_.resize(moved);
  counters_ = {pairs.size(), pairs.size() - moved};
  call_before_ = call_;
  call_ = take_moved_calls(1);
  state.version = scene.version;
  return Status::kOk;
}

bool MovedQuery::second_is_larger(std::uint32_t a, std::uint32_t b) const {
  const State& state = *state_.get();
  return tandem::second_is_larger(state.boxes[a], state.boxes[b]);
}

bool MovedQuery::is_of(const SceneState& scene) const {
  const State* const state = state_.get();
  return state != nullptr && state->assets_id == scene.assets_id && state->version == scene.version;
}

Status MovedQuery::resume(Scene& in, std::span<const PosedBodies> posed) {
  SceneState* const scene = in.state();
  State* const state = state_.provide();
  static_cast<void>(forget(Status::kOk));
  forget_poses();
  if (scene == nullptr || state == nullptr) return Status::kOutOfMemory;
  if (!state->box_assets(*scene) || !posed_.resize(posed.size())) return scene->fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < posed.size(); ++i) {
    posed_[i] = posed[i];
    if (posed[i].a.asset < state->boxes.size() && posed[i].b.asset < state->boxes.size()) continue;
    forget_poses();
    return scene->fail(Status::kUnknownAsset, i);
  }
  return Status::kOk;
}

void MovedQuery::forget_poses() {
  posed_.clear();
  kept_rows_.clear();
  call_ = 0;
}

}  // namespace tandem
