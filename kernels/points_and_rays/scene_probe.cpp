#include "kernels/points_and_rays/scene_probe.h"

#include <utility>

namespace tandem {

Status ProbedBodies::make(SceneState& scene) {
  if (assets_id_ == scene.assets_id && shapes_id_ == scene.shapes_id && version_ == scene.version)
    return Status::kOk;
  assets_id_ = 0;
  const std::size_t count = scene.bodies.size();
  if (!frames_.resize(count)) return scene.fail(Status::kOutOfMemory, 0);
  bounds_ = {{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!scene.is_body(i)) continue;
    for (int k = 0; k < 3; ++k) {
      bounds_.lo[k] = std::fmin(bounds_.lo[k], scene.boxes[i].lo[k]);
      bounds_.hi[k] = std::fmax(bounds_.hi[k], scene.boxes[i].hi[k]);
    }
    const SceneAsset& asset = scene.asset_of(i);
    frames_[i] = local_frame(scene.bodies[i].pose, scene.bodies[i].extent, asset.lower, asset.upper);
  }
  const Status status = BroadPhase::make_tree(scene.boxes.view(), {}, scene.threads, 1, boxes_);
  if (status != Status::kOk) return scene.fail(status, 0);
  assets_id_ = scene.assets_id;
  shapes_id_ = scene.shapes_id;
  version_ = scene.version;
  return Status::kOk;
}

// Sorts by the keys, the least significant digit first: a sort that keeps the order of equal keys.
bool ProbeOrder::sort() {
  constexpr int kDigit = 10;
  const std::size_t count = keys_.size();
  for (int shift = 32; shift < 32 + kKeyBits; shift += kDigit) {
    std::size_t begin[1 << kDigit] = {};
    const auto digit_of = [shift](std::uint64_t key) { return key >> shift & ((1 << kDigit) - 1); };
    for (std::size_t i = 0; i < count; ++i) ++begin[digit_of(keys_[i])];
    std::size_t sum = 0;
    for (std::size_t& first : begin) sum += std::exchange(first, sum);
    for (std::size_t i = 0; i < count; ++i) other_[begin[digit_of(keys_[i])]++] = keys_[i];
    std::swap(keys_, other_);
  }
  return true;
}

}  // namespace tandem
