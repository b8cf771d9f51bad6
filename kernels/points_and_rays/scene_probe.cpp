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
  const Status status = BroadPhase::make_tree(scene.boxes.view(), {}, *scene.threads, 1, boxes_);
  if (status != Status::kOk) return scene.fail(status, 0);
  assets_id_ = scene.assets_id;
  shapes_id_ = scene.shapes_id;
  version_ = scene.version;
  return Status::kOk;
}

namespace {

// Moves bit i of a number of ten bits to bit 3 i.
std::uint32_t spread_bits(std::uint32_t x) {
  x = (x | x << 16) & 0x030000FF;
  x = (x | x << 8) & 0x0300F00F;
  x = (x | x << 4) & 0x030C30C3;
  return (x | x << 2) & 0x09249249;
}

}  // namespace

// Places are numbered along each axis from the least to the largest; where float32 overflows, all have number
// 0. Keys are sorted the least significant digit first, which keeps the order of equal ones.
bool ProbeOrder::sort() {
  constexpr int kDigit = 10;
  constexpr float kSteps = 1 << kKeyBits / 3;
  const std::size_t count = places_.size();
  if (!keys_.resize(count) || !other_.resize(count)) return false;
  Place lo, hi, scale;
  lo.fill(HUGE_VALF);
  hi.fill(-HUGE_VALF);
  for (const Numbered& thing : places_.view()) {
    for (int k = 0; k < 3; ++k) {
      lo[k] = thing.place[k] < lo[k] ? thing.place[k] : lo[k];
      hi[k] = thing.place[k] > hi[k] ? thing.place[k] : hi[k];
    }
  }
  for (int k = 0; k < 3; ++k) scale[k] = hi[k] > lo[k] ? 0.999f * kSteps / (hi[k] - lo[k]) : 0;
  std::size_t begin[kKeyBits / kDigit][1 << kDigit] = {};
  const auto digit_of = [](std::uint64_t key, int digit) {
    return key >> (32 + digit * kDigit) & ((1 << kDigit) - 1);
  };
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t key = 0;
    for (int k = 0; k < 3; ++k) {
      const float x = (places_[i].place[k] - lo[k]) * scale[k];
      key = key << 1 | spread_bits(x >= 0 && x < kSteps ? static_cast<std::uint32_t>(x) : 0);
    }
    keys_[i] = std::uint64_t{key} << 32 | places_[i].number;
    for (int digit = 0; digit < kKeyBits / kDigit; ++digit) ++begin[digit][digit_of(keys_[i], digit)];
  }
  for (int digit = 0; digit < kKeyBits / kDigit; ++digit) {
    std::size_t sum = 0;
    for (std::size_t& first : begin[digit]) sum += std::exchange(first, sum);
    for (std::size_t i = 0; i < count; ++i) other_[begin[digit][digit_of(keys_[i], digit)]++] = keys_[i];
    std::swap(keys_, other_);
  }
  return true;
}

}  // namespace tandem
