#pragma once
#include <cstdint>

#include "dynamics/joint_order.h"
#include "dynamics/soft_joint.h"

namespace tandem::dynamics {

/// The joints of a parallel step, in the memory of its executor.
struct JointArrays {
  std::uint32_t count = 0;  ///< 0: there are none, and nothing else is looked at
  Joint* joints = nullptr;
  JointMemory *memory = nullptr, *memory_end = nullptr;  ///< at the start of the step, and at its end
  std::uint8_t* broke = nullptr;                         ///< 1 of those that break at the end of the step
  std::uint32_t* broken = nullptr;                       ///< how many these are

  // See JointOrder.
  std::uint32_t tasks = 0, colours = 0;
  const PlacedJoint* places = nullptr;
  const std::uint32_t *colour_end = nullptr, *joints_of = nullptr;
  SoftJoint* soft = nullptr;  ///< of each place

  TANDEM_HD std::uint32_t place_count() const { return tasks * kJointsOfTeam; }
  /// Returns whether a body that moves has joints that hold.
  TANDEM_HD bool hold(std::uint32_t body) const { return count > 0 && joints_of[body] > 0; }
};

/// The state of a joint's body. states: in the executor's memory.
TANDEM_HD inline BodyState state_of(std::uint32_t body, const BodyState* states) {
  return body == kNoIndex ? BodyState() : states[body];
}

}  // namespace tandem::dynamics
