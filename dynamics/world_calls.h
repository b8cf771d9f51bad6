#pragma once
#include "dynamics/world_setup.h"

/// What callers of a world ask for, as its parts take it. Result: kOk, or what World's functions of these
/// names say.
namespace tandem::dynamics {

/// Returns whether a step may take so many seconds.
inline bool is_duration(double dt) {
  return dt > 0 && dt <= 1000;
}

/// state: where the body is to be.
inline Status read_set(const BodyProperties& body, const BodyMotion& motion, BodyState& state) {
  if (!is_rigid(motion.pose)) return Status::kPoseNotRigid;
  state = state_of(body, motion.pose);
  state.velocity = vector_of(motion.velocity);
  state.angular_velocity = vector_of(motion.angular_velocity);
  if (!is_usable(state)) return Status::kOutOfRange;
  if (body.motion == Motion::fixed) state.velocity = state.angular_velocity = Vector3{};
  return Status::kOk;
}

/// state: of the body, before and after it is pushed. Condition: it moves.
inline Status read_push(const BodyProperties& body, const double (&impulse)[3], const double (&at)[3],
                        BodyState& state) {
  push_at(body, vector_of(impulse), vector_of(at), state);
  return is_usable(state) ? Status::kOk : Status::kOutOfRange;
}

/// Condition: the body moves.
inline Status read_force(const BodyProperties& body, const BodyState& state, const double (&force)[3],
                         const double (&torque)[3], BodyForce& to) {
  to = {vector_of(force), vector_of(torque)};
  return pull_on(body, state, {}, to).most() <= kFastest ? Status::kOk : Status::kOutOfRange;
}

/// Result: kOk where the joint holds and may have such a motor.
inline Status check_motor(std::span<const Joint> joints, std::uint32_t joint, double speed,
                          double most_effort) {
  if (joint >= joints.size() || !joints[joint].holds) return Status::kBadJoint;
  JointDescription motor;
  motor.kind = joints[joint].kind;
  motor.speed = speed, motor.most_effort = most_effort;
  return check(motor);
}

}  // namespace tandem::dynamics
