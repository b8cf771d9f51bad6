#pragma once
#include <cmath>
#include <cstdint>

#include "dynamics/joint.h"

/// These rules say where a joint's parts are and in which directions it acts, for host and device.
namespace tandem::dynamics {

namespace joint_rules_detail {

// Any direction will do where the anchors are in one place.
TANDEM_HD inline Vector3 direction_apart(const JointGeometry& g) {
  const double apart = norm(g.apart);
  return apart > 0 ? g.apart / apart : Vector3{0, 0, 1};
}

// Adds rows of one joint.
class DirectionMaker {
 public:
  TANDEM_HD explicit DirectionMaker(const JointGeometry& geometry) : g_(geometry) {}

  // The anchors move against each other along a direction. The force acts at b's anchor, or the two would
  // turn each other where they are apart.
  TANDEM_HD JointDirection along(const Vector3& direction) const {
    JointDirection row = {};
    row.linear = direction;
    row.angular_a = cross(g_.arm_a + g_.apart, direction);
    row.angular_b = cross(g_.arm_b, direction);
    return row;
  }
  TANDEM_HD JointDirection about(const Vector3& axis) const {
    JointDirection row = {};
    row.angular_a = row.angular_b = axis;
    return row;
  }

  TANDEM_HD void hold(JointDirection row, double error) {
    row.kind = JointRowKind::hold;
    row.least_way = row.most_way = -error;
    row.slot = next_++;
    rows_.row[rows_.count++] = row;
  }
  TANDEM_HD void hold_along(const Vector3& direction) { hold(along(direction), dot(direction, g_.apart)); }
  TANDEM_HD void hold_about(const Vector3& axis) { hold(about(axis), dot(axis, g_.tilt)); }

  // A row whose speed is that of the joint's position.
  TANDEM_HD void free(JointDirection row, const Joint& joint) {
    if (joint.has_limits() && joint.least == joint.most) {
      hold(row, g_.position - joint.least);
    } else if (joint.has_limits()) {
      row.kind = JointRowKind::limit, row.slot = kMostJointRows - 2;
      row.least_way = joint.least - g_.position, row.most_way = joint.most - g_.position;
      rows_.row[rows_.count++] = row;
    }
    if (joint.most_effort == 0) return;
    row.kind = JointRowKind::motor, row.slot = kMostJointRows - 1;
    rows_.row[rows_.count++] = row;
  }

  TANDEM_HD JointDirections take() const { return rows_; }

 private:
  const JointGeometry& g_;
  JointDirections rows_;
  std::uint8_t next_ = 0;
};

}  // namespace joint_rules_detail

/// near: an angle becomes the one within half a turn of this.
TANDEM_HD inline JointGeometry geometry_of(const Joint& joint, const BodyState& a, const BodyState& b,
                                           double near) {
  JointGeometry g;
  g.arm_a = rotated(a.orientation, joint.anchor_a);
  g.arm_b = rotated(b.orientation, joint.anchor_b);
  g.apart = (b.position - a.position) + (g.arm_b - g.arm_a);
  g.axis = rotated(a.orientation, joint.axis_a);
  g.first = rotated(a.orientation, joint.across_a);
  g.second = cross(g.axis, g.first);
  switch (joint.kind) {
    case JointKind::hinge: {
      g.tilt = cross(g.axis, rotated(b.orientation, joint.axis_b));
      const Vector3 across = rotated(b.orientation, joint.across_b);
      const double angle = std::atan2(dot(g.second, across), dot(g.first, across));
      g.position = angle + 2 * kPi * std::round((near - angle) / (2 * kPi));
      break;
    }
    case JointKind::slider:
      g.position = dot(g.axis, g.apart);
      [[fallthrough]];
    case JointKind::fixed:
      g.tilt = turn_between(a.orientation * joint.rest, b.orientation);
      break;
    case JointKind::distance:
      g.position = norm(g.apart);
      break;
    case JointKind::ball:
      break;
  }
  return g;
}

TANDEM_HD inline JointGeometry middle(const JointGeometry& p, const JointGeometry& q) {
  const auto mean = [](const Vector3& x, const Vector3& y) { return 0.5 * (x + y); };
  return {mean(p.arm_a, q.arm_a), mean(p.arm_b, q.arm_b),         mean(p.apart, q.apart),
          mean(p.axis, q.axis),   mean(p.first, q.first),         mean(p.second, q.second),
          mean(p.tilt, q.tilt),   0.5 * (p.position + q.position)};
}

/// Returns the speed by which the joint's position changes; 0 of a joint that has none.
TANDEM_HD inline double free_speed(const Joint& joint, const JointGeometry& g, const BodyState& a,
                                   const BodyState& b) {
  const joint_rules_detail::DirectionMaker rows(g);
  switch (joint.kind) {
    case JointKind::hinge:
      return rows.about(g.axis).speed_of(a, b);
    case JointKind::slider:
      return rows.along(g.axis).speed_of(a, b);
    case JointKind::distance:
      return rows.along(joint_rules_detail::direction_apart(g)).speed_of(a, b);
    default:
      return 0;
  }
}

/// Takes where the joint is after bodies have moved for a time. Its speed says how often a hinge has turned.
TANDEM_HD inline void follow(const Joint& joint, const BodyState& a, const BodyState& b, double time,
                             JointMemory& memory) {
  const double speed = joint.kind == JointKind::hinge ? dot(rotated(a.orientation, joint.axis_a),
                                                            b.angular_velocity - a.angular_velocity)
                                                      : 0;
  memory.position = geometry_of(joint, a, b, memory.position + time * speed).position;
}

/// The directions of a joint; how many, and their slots, depend on the joint alone.
TANDEM_HD inline JointDirections directions_of(const Joint& joint, const JointGeometry& g) {
  joint_rules_detail::DirectionMaker rows(g);
  switch (joint.kind) {
    case JointKind::ball:
    case JointKind::hinge:
    case JointKind::fixed:
      for (const Vector3& direction : Matrix3::identity().row) rows.hold_along(direction);
      break;
    case JointKind::slider:
      for (const Vector3& direction : {g.first, g.second}) rows.hold_along(direction);
      break;
    case JointKind::distance:
      rows.free(rows.along(joint_rules_detail::direction_apart(g)), joint);
      return rows.take();
  }
  if (joint.kind == JointKind::hinge) {
    for (const Vector3& axis : {g.first, g.second}) rows.hold_about(axis);
    rows.free(rows.about(g.axis), joint);
  } else if (joint.kind != JointKind::ball) {
    for (const Vector3& axis : Matrix3::identity().row) rows.hold_about(axis);
    if (joint.kind == JointKind::slider) rows.free(rows.along(g.axis), joint);
  }
  return rows.take();
}

/// Returns a joint's impulse in the last step.
TANDEM_HD inline JointImpulse impulse_of(const Joint& joint, const JointMemory& memory, const BodyState& a,
                                         const BodyState& b) {
  const JointGeometry geometry = geometry_of(joint, a, b, memory.position);
  const JointDirections directions = directions_of(joint, geometry);
  JointImpulse sum;
  for (std::size_t k = 0; k < directions.count; ++k) {
    const JointDirection& row = directions.row[k];
    const double push = memory.done[row.slot];
    sum.linear += push * row.linear;
    sum.turning += push * (row.angular_b - cross(geometry.arm_b, row.linear));
    if (row.kind == JointRowKind::motor) sum.motor = push;
  }
  return sum;
}

/// Returns whether a joint breaks that did this in a step of dt seconds.
TANDEM_HD inline bool breaks(const Joint& joint, const JointMemory& memory, const BodyState& a,
                             const BodyState& b, double dt) {
  if (joint.breaking_force == INFINITY && joint.breaking_torque == INFINITY) return false;
  const JointImpulse impulse = impulse_of(joint, memory, a, b);
  return norm(impulse.linear) > dt * joint.breaking_force ||
         norm(impulse.turning) > dt * joint.breaking_torque;
}

}  // namespace tandem::dynamics
