#pragma once
#include <cstdint>
#include <span>

#include "tandem/formats/allocator.h"
#include "tandem/kernels/closest_query.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/impact_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/ray_query.h"
#include "tandem/kernels/tolerance_query.h"

namespace tandem {

/// A device answers the questions of a scene in place of the CPU. The scene keeps the bodies, checks what it
/// is given, and asks. Result of each function: kOk, or the status of what failed, with where() of the scene.
class SceneDevice : public Allocated {
 public:
  virtual ~SceneDevice() = default;

  /// Takes the scene's assets.
  virtual Status set_assets(SceneState& scene) = 0;

  /// Gives an asset of the scene, which has source vertices, the positions of them, which are sound. After an
  /// error nothing has changed.
  virtual Status deform(SceneState& scene, std::uint32_t asset, std::span<const float> positions) = 0;
  virtual Status deform(SceneState& scene, std::uint32_t asset, std::span<const double> positions) = 0;

  /// Finds the pairs of world boxes within reach that the filter looks at, a < b, sorted. fixed_kept: whether
  /// the fixed bodies stand as in the last call that set it.
  virtual Status find_pairs(SceneState& scene, double reach, bool& fixed_kept, Buffer<ObjectPair>& pairs) = 0;

  virtual Status find(SceneState& scene, const ContactOptions& options,
                      const DeviceAnswer<Contact, ContactCounters>& found) = 0;
  virtual Status find(SceneState& scene, const DistanceOptions& options,
                      const DeviceAnswer<ObjectDistance, DistanceCounters>& found) = 0;
  virtual Status find(SceneState& scene, const ToleranceOptions& options,
                      const DeviceAnswer<PairVerdict, ToleranceCounters>& found) = 0;

  /// The options of these two are sound, as are the points and rays.
  virtual Status find(SceneState& scene, const ClosestOptions& options,
                      const DeviceAnswer<ClosestPoint, ClosestCounters>& found) = 0;
  virtual Status find(SceneState& scene, const RayOptions& options,
                      const DeviceAnswer<RayHit, RayCounters>& found) = 0;

  /// finds_pairs: the question is about the pairs whose swept boxes meet, which the device finds.
  virtual Status find(SceneState& scene, const ImpactOptions& options, bool finds_pairs,
                      const DeviceAnswer<Impact, ImpactCounters>& found) = 0;

  /// contacts: those that this device found of the same pairs, or of the rows of `moved`, if that is not
  /// null.
  virtual Status find(SceneState& scene, const ManifoldOptions& options, const MovedQuery* moved,
                      const DeviceMemory& contacts, Buffer<ManifoldPoint>& points,
                      const DeviceAnswer<Manifold, ManifoldCounters>& found) = 0;
  virtual Status find(SceneState& scene, const DeviceMemory& contacts,
                      const DeviceAnswer<Containment, ContainmentCounters>& found) = 0;

  /// The allocator of the caller. The device's library may have another current_allocator().
  Allocator allocator;

  /// The size of SceneState as the device's library knows it.
  std::size_t state_bytes = 0;
};

}  // namespace tandem
