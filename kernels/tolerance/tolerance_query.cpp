#include "tandem/kernels/tolerance_query.h"

#include "kernels/common/check_options.h"
#include "kernels/contact/contact_finder.h"
#include "kernels/geometry/grid_test.h"
#include "kernels/scene/scene_state.h"
#include "kernels/tolerance/tolerance_rule.h"

namespace tandem {
namespace {

using levels::LevelRange;

struct AssetLevel {
  LevelView tree;
  TreeExtent extent;
  double grid;
  float lower[3], upper[3];
};

AssetLevel level_of(const SceneAsset& asset, std::uint32_t number) {
  AssetLevel level = {asset.view.level(number), {}, 0, {}, {}};
  level.extent = extent_of(level.tree.blocks[0]);
  level.grid = grid_of(level.tree, level.extent);
  std::copy_n(asset.lower, 3, level.lower);
  std::copy_n(asset.upper, 3, level.upper);
  return level;
}

}  // namespace

struct ToleranceQuery::State : Allocated {
  std::uint64_t assets_id = 0;  // whose levels these are
  Buffer<LevelRange> ranges;
  Buffer<AssetLevel> levels;

  Buffer<std::uint32_t> level;  // of each body
  Buffer<PosedTree> trees;      // the bodies at these levels
  ContactFinder finder;
  Buffer<Contact> contacts;

  Status name_levels(SceneState& scene);
  bool choose_levels(const SceneState& scene, double tolerance);
};

Status ToleranceQuery::State::name_levels(SceneState& scene) {
  if (const Status status = scene.require_undeformed(); status != Status::kOk) return status;
  if (assets_id == scene.assets_id) return Status::kOk;
  assets_id = 0;
  ranges.clear();
  levels.clear();
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const SceneAsset& asset = scene.assets[i];
    if (asset.view.first_level != 0) return scene.fail(Status::kNoFinestLevel, i);
    const auto count = static_cast<std::uint32_t>(asset.view.levels.size());
    if (!ranges.push({static_cast<std::uint32_t>(levels.size()), count}))
      return scene.fail(Status::kOutOfMemory, i);
    for (std::uint32_t number = 0; number < count; ++number) {
      if (!levels.push(level_of(asset, number))) return scene.fail(Status::kOutOfMemory, i);
    }
  }
  assets_id = scene.assets_id;
  return Status::kOk;
}

bool ToleranceQuery::State::choose_levels(const SceneState& scene, double tolerance) {
  if (!level.resize(scene.bodies.size()) || !trees.resize(scene.bodies.size())) return false;
  for (std::uint32_t i = 0; i < scene.bodies.size(); ++i) {
    if (!scene.is_body(i)) continue;
    const LevelRange& range = ranges[scene.instances[i].asset];
    const AssetLevel* const own = &levels[range.first];
    const PosedTree& body = scene.bodies[i];
    level[i] = levels::level_within(own, range.count, body.pose, tolerance);
    const AssetLevel& chosen = own[level[i]];
    trees[i] = {chosen.tree, chosen.extent, chosen.grid, body.pose,
                posed_level_error(chosen.tree, chosen.lower, chosen.upper, body.pose)};
  }
  return true;
}

// Contacts come by ascending pair, one of each that has any.
Status ToleranceQuery::answer(SceneState& scene, const std::span<const ObjectPair>* given,
                              const ToleranceOptions& options) {
  Status status = check_level_tolerance(options.tolerance);
  if (status != Status::kOk) return scene.fail(status, 0);
  State* const state = state_.provide();
  if (state == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  status = state->name_levels(scene);
  if (status == Status::kOk) status = scene.take_or_find_pairs(given, 0, false, pairs_);
  if (status != Status::kOk) return status;
  if (scene.device != nullptr) return scene.ask_device(options, found());
  if (!state->choose_levels(scene, options.tolerance) || !rows_.resize(pairs_.size()))
    return scene.fail(Status::kOutOfMemory, 0);
  counters_ = {};
  status = state->finder.find(scene, state->trees.view(), pairs_.view(),
                              {.first_contact_only = true, .add_error_bounds = true}, state->contacts,
                              counters_.work);
  if (status != Status::kOk) return status;
  std::uint64_t counted[3] = {};
  std::size_t next = 0;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const bool near = next < state->contacts.size() && state->contacts[next].pair == i;
    next += near ? 1 : 0;
    rows_[i] = levels::verdict_on(pairs_[i], state->level[pairs_[i].a], state->level[pairs_[i].b], near);
    ++counted[static_cast<std::size_t>(rows_[i].verdict)];
  }
  counters_.apart = counted[0];
  counters_.touching = counted[1];
  counters_.within_tolerance = counted[2];
  return Status::kOk;
}

}  // namespace tandem
