#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>

#include "kernels/scene/scene_state.h"
#include "tandem/kernels/configuration_query.h"
#include "tandem/kernels/contact_query.h"

namespace tandem {

/// Returns how near two boxes are: less than 0, as far as they reach into each other in their shallowest
/// direction.
inline double gap_of(const WorldBox& a, const WorldBox& b) {
  double gap = -INFINITY;
  for (int k = 0; k < 3; ++k) gap = std::max({gap, a.lo[k] - b.hi[k], b.lo[k] - a.hi[k]});
  return gap;
}

/// Answers a question about configurations on the device of a scene: each configuration is a world with
/// bodies of its own, what stands is in all worlds, and one question is about as many worlds as there is room
/// for.
class ConfigurationWorlds {
 public:
  /// moves: of each body of the scene, 0 where it stands. Result: kOk, or what the device says.
  /// Conditions: a device; bodies and poses that are checked.
  Status find(SceneState& scene, const ConfigurationOptions& options, std::span<const std::uint8_t> moves,
              Buffer<ConfigurationPair>& rows, ConfigurationCounters& counters);

 private:
  struct Slice {
    std::size_t first, count;  // configurations
  };

  bool place(const SceneState& scene, const ConfigurationOptions& options, const Slice& slice);
  void keep_asked(const SceneState& scene, const ConfigurationOptions& options, const Slice& slice);
  ConfigurationPair row_of(const ConfigurationOptions& options, const Slice& slice,
                           const ObjectPair& pair) const;
  Status decide(SceneState& scene, const ConfigurationOptions& options, const Slice& slice,
                Buffer<ConfigurationPair>& rows, ConfigurationCounters& counters);
  Status bound(SceneState& scene, const ConfigurationOptions& options, const Slice& slice,
               Buffer<ObjectPair>& pairs, ConfigurationCounters& counters);
  bool list_nearest_boxes(std::size_t moving);
  void keep_those_that_may_be_nearer(std::size_t moving);
  Status measure(SceneState& scene, const ConfigurationOptions& options, const Slice& slice,
                 Buffer<ConfigurationPair>& rows, ConfigurationCounters& counters);

  SceneState worlds_;  // bodies of the device; it has no assets of its own
  bool fixed_kept_ = false;
  Buffer<std::uint32_t> standing_;
  Buffer<ObjectPair> pairs_, nearest_boxes_;
  Buffer<ConfigurationPair> nearest_;  // of each configuration of a slice
  Buffer<Contact> contacts_;
  Buffer<ObjectDistance> distances_;
  ContactCounters contact_counters_;
  DistanceCounters distance_counters_;
  std::unique_ptr<DeviceMemory> contact_memory_, distance_memory_;
};

}  // namespace tandem
