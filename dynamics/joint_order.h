#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/joint.h"

namespace tandem::dynamics {

/// Returns the motions of bodies, as find_joint_colours() takes them.
std::vector<Motion> motions_of(std::span<const BodyProperties> bodies);

/// Returns the colour of each joint. A soft step visits joints by ascending colour; no two of a colour that
/// hold have a moving body in common.
std::vector<std::uint32_t> find_joint_colours(std::span<const Joint> joints, std::span<const Motion> motions);

/// Joints that one team visits at once are of one colour.
inline constexpr std::uint32_t kJointsOfTeam = 32;

/// A joint in the order of visits. At each of its bodies that moves `turn` others come before it.
struct PlacedJoint {
  std::uint32_t joint = kNoIndex;  ///< none: a place that is left empty
  std::uint32_t turn_a = 0, turn_b = 0;
};

/// The joints that hold, in the order in which a parallel step visits them.
struct JointOrder {
  std::vector<PlacedJoint> places;        ///< kJointsOfTeam for each task
  std::vector<std::uint32_t> colour_end;  ///< of each colour: the task with which its tasks end
  std::vector<std::uint32_t> joints_of;   ///< of each body: how many move it

  std::uint32_t tasks() const { return static_cast<std::uint32_t>(places.size() / kJointsOfTeam); }
};
JointOrder find_joint_order(std::span<const Joint> joints, std::span<const Motion> motions);

}  // namespace tandem::dynamics
