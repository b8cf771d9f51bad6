#include <algorithm>
#include <atomic>
#include <cmath>
#include <type_traits>
#include <utility>

#include "kernels/common/instance_check.h"
#include "kernels/geometry/grid_test.h"
#include "kernels/scene/scene_state.h"

// The assets of a scene, and their shapes.
namespace tandem {
namespace {

std::uint64_t next_assets_id() {
  static std::atomic<std::uint64_t> last = 0;
  return ++last;
}

void set_bounds(const float (&lower)[3], const float (&upper)[3], SceneAsset& asset) {
  double squared = 0;
  for (int k = 0; k < 3; ++k) {
    asset.lower[k] = lower[k];
    asset.upper[k] = upper[k];
    const double side = static_cast<double>(upper[k]) - static_cast<double>(lower[k]);
    squared += side * side;
  }
  asset.diagonal = std::sqrt(squared);
}

SceneAsset scene_asset(const AssetView& view) {
  SceneAsset asset = {view, view.level(), {}, 0, {}, {}, {}, 0};
  asset.extent = extent_of(asset.tree.blocks[0]);
  asset.grid = grid_of(asset.tree, asset.extent);
  std::copy_n(view.header->origin, 3, asset.origin);
  set_bounds(view.header->lower, view.header->upper, asset);
  return asset;
}

}  // namespace

void SceneState::forget_assets() {
  for (SceneAsset& asset : std::span(assets.data(), assets.size())) delete asset.deformed;
  assets.clear();
}

Status SceneState::set_assets(std::span<const AssetView> views) {
  forget_bodies();
  forget_assets();
  assets_id = next_assets_id();
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].header == nullptr || views[i].levels.empty()) return fail(Status::kUnknownAsset, i);
  }
  if (views.size() >= kNoIndex || !assets.resize(views.size())) return fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < views.size(); ++i) assets[i] = scene_asset(views[i]);
  if (device == nullptr) return Status::kOk;
  device->allocator = current_allocator();
  return device->set_assets(*this);
}

// Returns whether all bodies of an asset stay where queries take them if it has these bounds.
bool SceneState::stays_in_range(std::uint32_t asset, const float (&lower)[3], const float (&upper)[3]) const {
  return std::all_of(instances.data(), instances.data() + instances.size(), [&](const Instance& instance) {
    return instance.asset != asset || in_range(world_box(instance.pose, lower, upper));
  });
}

template <typename Real>
Status SceneState::deform(std::uint32_t number, std::span<const Real> positions) {
  if (number >= assets.size()) return fail(Status::kUnknownAsset, number);
  SceneAsset& asset = assets[number];
  if (asset.tree.source_vertices == nullptr) return fail(Status::kNoSourceVertices, number);
  if (positions.size() != 3 * asset.view.header->source_vertices)
    return fail(Status::kVertexCountMismatch, positions.size() / 3);
  float lower[3], upper[3];
  const std::size_t sound = check_positions(positions, lower, upper);
  if (sound < positions.size() / 3 || !stays_in_range(number, lower, upper))
    return fail(Status::kOutOfRange, sound);
  std::unique_ptr<DeformedTree> begun;
  if (asset.deformed == nullptr) begun.reset(new (std::nothrow) DeformedTree);
  DeformedTree* const tree = asset.deformed != nullptr ? asset.deformed : begun.get();
  Status status = tree != nullptr ? Status::kOk : Status::kOutOfMemory;
  if (status == Status::kOk && begun != nullptr) status = begun->begin(asset.tree);
  if constexpr (std::is_same_v<Real, double>) {
    if (status == Status::kOk && device != nullptr) status = tree->provide_float64(positions.size());
  }
  if (status == Status::kOk && device != nullptr) {
    device->allocator = current_allocator();
    status = device->deform(*this, number, positions);
  }
  if (status == Status::kOk) status = tree->refit(positions);  // behind a device it takes no memory
  if (status != Status::kOk) return fail(status, 0);
  asset.deformed = tree;
  static_cast<void>(begun.release());
  take_shape(number, lower, upper);
  return Status::kOk;
}

// The asset has the shape that its deformed tree has now, and so have its bodies.
void SceneState::take_shape(std::uint32_t number, const float (&lower)[3], const float (&upper)[3]) {
  SceneAsset& asset = assets[number];
  asset.tree = asset.deformed->level();
  asset.extent = extent_of(asset.tree.blocks[0]);
  widen_for_rounding(asset.deformed->rounding(), asset.extent);
  asset.grid = 0;
  std::fill_n(asset.origin, 3, 0.0);
  set_bounds(lower, upper, asset);
  asset.shape = ++shapes_id;
  for (std::uint32_t body = 0; body < instances.size(); ++body) {
    if (instances[body].asset != number) continue;
    (void)pose(body, instances[body]);
    note_change(body);
  }
}

Status SceneState::require_undeformed() {
  for (std::size_t i = 0; i < assets.size(); ++i) {
    if (assets[i].deformed != nullptr) return fail(Status::kDeformed, i);
  }
  return Status::kOk;
}

Status SceneState::require_float32_corners() {
  for (std::size_t i = 0; i < assets.size(); ++i) {
    if (!assets[i].has_float32_corners()) return fail(Status::kNotFloat32, i);
  }
  return Status::kOk;
}

Status SceneState::require_topology() {
  for (std::size_t i = 0; i < assets.size(); ++i) {
    if (assets[i].tree.topology == nullptr) return fail(Status::kNoTopology, i);
  }
  return Status::kOk;
}

Status Scene::set_assets(std::span<const AssetView> assets) {
  SceneState* const s = state();
  if (s == nullptr) return Status::kOutOfMemory;
  const Status status = s->set_assets(assets);
  if (status != Status::kOk) s->forget_assets();
  return status;
}

Status Scene::deform(std::uint32_t asset, std::span<const float> positions) {
  SceneState* const s = state();
  return s != nullptr ? s->deform(asset, positions) : Status::kOutOfMemory;
}

Status Scene::deform(std::uint32_t asset, std::span<const double> positions) {
  SceneState* const s = state();
  return s != nullptr ? s->deform(asset, positions) : Status::kOutOfMemory;
}

double Scene::looseness(std::uint32_t asset) const {
  if (state_ == nullptr || asset >= state_->assets.size() || state_->assets[asset].deformed == nullptr)
    return 1;
  return state_->assets[asset].deformed->looseness();
}

}  // namespace tandem
