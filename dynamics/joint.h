#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "dynamics/rigid_body.h"
#include "tandem/dynamics/world.h"
#include "tandem/kernels/object_pair.h"

namespace tandem::dynamics {

/// A joint of two bodies, of which at least one moves. Points and axes are in the bodies' frames about their
/// centres of mass; of the world, which is body kNoIndex, in the world.
struct Joint {
  JointKind kind;
  std::uint32_t a, b;
  Vector3 anchor_a, anchor_b;
  Vector3 axis_a, axis_b;      ///< unit: of a hinge or slider
  Vector3 across_a, across_b;  ///< unit, across the axis: they agree where a hinge's angle is 0
  Quaternion rest;             ///< of b in a, which a slider or fixed joint holds
  double least, most;          ///< angle, way or distance
  double speed, most_effort;   ///< of the motor; none where most_effort is 0
  double breaking_force, breaking_torque;
  bool may_touch;
  bool holds = true;  ///< false: it has broken or been removed

  /// Returns whether it has been removed; the simulation may put another joint in its place.
  TANDEM_HD bool is_gone() const { return a == b; }
  /// Returns the bodies that it joins; the world with itself where it does not hold.
  TANDEM_HD ObjectPair pair() const { return holds ? ObjectPair{a, b} : ObjectPair{kNoIndex, kNoIndex}; }
  /// Returns whether a motor moves it, which keeps its bodies awake.
  TANDEM_HD bool is_driven() const { return holds && speed != 0 && most_effort > 0; }
  TANDEM_HD bool has_limits() const { return least > -INFINITY || most < INFINITY; }
};

/// A joint has at most this many rows, each with a slot for what it remembers.
inline constexpr std::size_t kMostJointRows = 7;

/// Has what a joint keeps from step to step.
struct JointMemory {
  std::array<double, kMostJointRows> impulse = {};  ///< that the next step starts with
  double position = 0;                              ///< angle, way or distance; an angle counts whole turns
  std::array<double, kMostJointRows> done = {};     ///< impulse in the last step; it differs in soft steps
};

/// The places and directions of a joint's parts, in the world. Rows made of the mean of two of these do no
/// work on bodies that went from the one to the other, and keep their angular momentum.
struct JointGeometry {
  Vector3 arm_a, arm_b;         ///< from the centres of mass to the anchors
  Vector3 apart;                ///< from a's anchor to b's
  Vector3 axis, first, second;  ///< a's, a right-handed frame
  Vector3 tilt;                 ///< turn of b that the joint does not allow, as an axis times an angle
  double position = 0;
};

/// The state of the joint's body; that of the world is at rest at the origin.
TANDEM_HD inline BodyState state_of(std::uint32_t body, std::span<const BodyState> states) {
  return body == kNoIndex ? BodyState() : states[body];
}

/// Says what a row of a joint asks for.
enum class JointRowKind : std::uint8_t {
  hold,   ///< that w is 0
  limit,  ///< that what w changes stays between two bounds
  motor,  ///< a speed, as far as its effort goes
};

/// A direction in which a joint acts: w = linear . (v_b - v_a) + angular_b . spin_b - angular_a . spin_a.
struct JointDirection {
  JointRowKind kind;
  std::uint8_t slot;  ///< in JointMemory
  Vector3 linear, angular_a, angular_b;
  double least_way, most_way;  ///< by which w may still change what it changes; equal of one that is held

  TANDEM_HD double speed_of(const BodyState& a, const BodyState& b) const {
    return dot(linear, b.velocity - a.velocity) + dot(angular_b, b.angular_velocity) -
           dot(angular_a, a.angular_velocity);
  }
};

struct JointDirections {
  std::array<JointDirection, kMostJointRows> row;
  std::size_t count = 0;
};

/// The impulse of a joint in a step, on b at its anchor; on a there the opposite one.
struct JointImpulse {
  Vector3 linear, turning;
  double motor = 0;  ///< along the axis, of the motor alone
};

/// Returns a joint that has been removed, and the first place of one in a list, or the place behind all.
Joint gone_joint();
std::uint32_t free_place(std::span<const Joint> joints);

/// Returns what a joint of bodies that stand like this keeps, before its first step.
JointMemory memory_of(const Joint& joint, std::span<const BodyState> states);

/// Returns whether the joint's anchors, limits, motor, axis and breaking limits are such as its kind can
/// have; kJoinsNothing is the caller's. Result: kOk, kBadJoint or kNoAxis.
Status check(const JointDescription& from);

/// Makes the joint of bodies that stand like this. Condition: check() is kOk, and there are the bodies.
Joint make_joint(const JointDescription& from, std::span<const BodyState> states);

}  // namespace tandem::dynamics
