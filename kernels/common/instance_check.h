#pragma once
#include <cstdint>

#include "tandem/formats/status.h"
#include "tandem/kernels/broad_phase.h"
#include "tandem/kernels/world_box.h"

/// These functions say which instances and object pairs queries refuse, and what they make of the others.
namespace tandem {

/// Poses an instance. `assets` is an array whose elements have origin, lower and upper, as a file's header
/// has them. pose: of the file's coordinates; stored: of stored ones. Result: kOk, or the first of
/// kUnknownAsset, kPoseNotRigid and kOutOfRange that holds; `box` is the instance's world box where the
/// result is kOk or kOutOfRange.
template <typename Asset>
TANDEM_HD inline Status pose_instance(const Asset* assets, std::uint32_t asset_count, std::uint32_t asset,
                                      const Pose& pose, Pose& stored, WorldBox& box) {
  if (asset >= asset_count) return Status::kUnknownAsset;
  if (!is_rigid(pose)) return Status::kPoseNotRigid;
  stored = for_stored_coordinates(pose, assets[asset].origin);
  box = world_box(stored, assets[asset].lower, assets[asset].upper);
  return in_range(box) ? Status::kOk : Status::kOutOfRange;
}

/// Result: kOk or kUnknownInstance.
TANDEM_HD inline Status check_pair(const ObjectPair& pair, std::uint32_t instance_count) {
  return pair.a < instance_count && pair.b < instance_count ? Status::kOk : Status::kUnknownInstance;
}

}  // namespace tandem
