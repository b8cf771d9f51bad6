#pragma once
#include "dynamics/contact_point.h"
#include "dynamics/joint_rules.h"
#include "tandem/dynamics/world.h"

/// What callers of a world see of bodies and contacts.
namespace tandem::dynamics {

inline void write(const Vector3& x, double (&out)[3]) {
  out[0] = x.x, out[1] = x.y, out[2] = x.z;
}

inline BodyMotion motion_of(const BodyProperties& body, const BodyState& state, bool sleeps) {
  BodyMotion to = {};
  to.pose = pose_of(body, state).pose;
  write(state.position, to.centre);
  write(state.velocity, to.velocity);
  write(state.angular_velocity, to.angular_velocity);
  to.sleeps = sleeps;
  return to;
}

/// impulse: what the contact did in the step.
inline WorldContact contact_of(const ContactPoint& point, const ContactImpulse& impulse) {
  WorldContact to = {};
  to.a = point.body_a, to.b = point.body_b;
  to.depth = point.depth;
  write(point.position, to.position);
  write(point.normal, to.normal);
  write(impulse.normal * point.normal + impulse.tangential, to.impulse);
  return to;
}

/// dt: seconds of the last step. states: of all bodies, at its end.
inline WorldJoint joint_of(const Joint& joint, const JointMemory& memory, std::span<const BodyState> states,
                           double dt) {
  const BodyState a = state_of(joint.a, states), b = state_of(joint.b, states);
  const JointImpulse impulse = impulse_of(joint, memory, a, b);
  const double speed = free_speed(joint, geometry_of(joint, a, b, memory.position), a, b);
  WorldJoint to = {memory.position, speed, {}, {}, impulse.motor / dt, joint.holds};
  write(impulse.linear, to.impulse);
  write(impulse.turning, to.turning);
  return to;
}

}  // namespace tandem::dynamics
