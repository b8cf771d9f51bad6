#include "dynamics/joint.h"

#include <algorithm>
#include <cmath>

#include "dynamics/joint_rules.h"

namespace tandem::dynamics {
namespace {

bool has_axis(JointKind kind) {
  return kind == JointKind::hinge || kind == JointKind::slider;
}

}  // namespace

Joint gone_joint() {
  Joint joint = {};
  joint.a = joint.b = kNoIndex, joint.holds = false;
  return joint;
}

std::uint32_t free_place(std::span<const Joint> joints) {
  return static_cast<std::uint32_t>(std::ranges::find_if(joints, &Joint::is_gone) - joints.begin());
}

JointMemory memory_of(const Joint& joint, std::span<const BodyState> states) {
  JointMemory memory;
  follow(joint, state_of(joint.a, states), state_of(joint.b, states), 0, memory);
  return memory;
}

Status check(const JointDescription& from) {
  const bool has_limits = from.least > -INFINITY || from.most < INFINITY;
  const bool may_be_limited = has_axis(from.kind) || from.kind == JointKind::distance;
  bool good = from.kind <= JointKind::distance && from.least <= from.most && from.least < INFINITY &&
              from.most > -INFINITY && std::isfinite(from.speed) && from.most_effort >= 0 &&
              from.breaking_force >= 0 && from.breaking_torque >= 0 && (may_be_limited || !has_limits) &&
              (has_axis(from.kind) || (from.speed == 0 && from.most_effort == 0));
  good = good && is_finite(vector_of(from.anchor)) && is_finite(vector_of(from.axis));
  if (from.kind == JointKind::distance) good = good && is_finite(vector_of(from.anchor_b)) && from.most >= 0;
  if (!good) return Status::kBadJoint;
  return has_axis(from.kind) && !(norm(vector_of(from.axis)) > 0) ? Status::kNoAxis : Status::kOk;
}

Joint make_joint(const JointDescription& from, std::span<const BodyState> states) {
  const BodyState a = state_of(from.a, states), b = state_of(from.b, states);
  const bool two_anchors = from.kind == JointKind::distance;
  const Vector3 axis = has_axis(from.kind) ? normalized(vector_of(from.axis)) : Vector3{0, 0, 1};
  const Vector3 across = unit_orthogonal(axis);
  const auto turned_back = [](const BodyState& state, const Vector3& x) {
    return rotated(conjugated(state.orientation), x);
  };
  Joint joint;
  joint.kind = from.kind, joint.a = from.a, joint.b = from.b;
  joint.anchor_a = into_body(a, vector_of(from.anchor));
  joint.anchor_b = into_body(b, vector_of(two_anchors ? from.anchor_b : from.anchor));
  joint.axis_a = turned_back(a, axis), joint.axis_b = turned_back(b, axis);
  joint.across_a = turned_back(a, across), joint.across_b = turned_back(b, across);
  joint.rest = conjugated(a.orientation) * b.orientation;
  joint.least = from.least, joint.most = from.most;
  joint.speed = from.speed, joint.most_effort = from.most_effort;
  joint.breaking_force = from.breaking_force, joint.breaking_torque = from.breaking_torque;
  joint.may_touch = from.may_touch;
  if (two_anchors && !joint.has_limits())
    joint.least = joint.most = norm(vector_of(from.anchor_b) - vector_of(from.anchor));
  if (two_anchors) joint.least = std::max(joint.least, 0.0);
  return joint;
}

}  // namespace tandem::dynamics
