#include "dynamics/joint.h"

#include <algorithm>
#include <cmath>

namespace tandem::dynamics {
namespace {

bool has_axis(JointKind kind) {
  return kind == JointKind::hinge || kind == JointKind::slider;
}

// Any direction will do where the anchors are in one place.
Vector3 direction_apart(const JointGeometry& g) {
  const double apart = norm(g.apart);
  return apart > 0 ? g.apart / apart : Vector3{0, 0, 1};
}

// Adds rows of one joint.
class DirectionMaker {
 public:
  explicit DirectionMaker(const JointGeometry& geometry) : g_(geometry) {}

  // The anchors move against each other along a direction. The force acts at b's anchor, or the two would
  // turn each other where they are apart.
  JointDirection along(const Vector3& direction) const {
    JointDirection row = {};
    row.linear = direction;
    row.angular_a = cross(g_.arm_a + g_.apart, direction);
    row.angular_b = cross(g_.arm_b, direction);
    return row;
  }
  JointDirection about(const Vector3& axis) const {
    JointDirection row = {};
    row.angular_a = row.angular_b = axis;
    return row;
  }

  void hold(JointDirection row, double error) {
    row.kind = JointRowKind::hold;
    row.least_way = row.most_way = -error;
    row.slot = next_++;
    rows_.row[rows_.count++] = row;
  }
  void hold_along(const Vector3& direction) { hold(along(direction), dot(direction, g_.apart)); }
  void hold_about(const Vector3& axis) { hold(about(axis), dot(axis, g_.tilt)); }

  // A row whose speed is that of the joint's position.
  void free(JointDirection row, const Joint& joint) {
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

  JointDirections take() const { return rows_; }

 private:
  const JointGeometry& g_;
  JointDirections rows_;
  std::uint8_t next_ = 0;
};

}  // namespace

JointGeometry geometry_of(const Joint& joint, const BodyState& a, const BodyState& b, double near) {
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

JointGeometry middle(const JointGeometry& p, const JointGeometry& q) {
  const auto mean = [](const Vector3& x, const Vector3& y) { return 0.5 * (x + y); };
  return {mean(p.arm_a, q.arm_a), mean(p.arm_b, q.arm_b),         mean(p.apart, q.apart),
          mean(p.axis, q.axis),   mean(p.first, q.first),         mean(p.second, q.second),
          mean(p.tilt, q.tilt),   0.5 * (p.position + q.position)};
}

double free_speed(const Joint& joint, const JointGeometry& g, const BodyState& a, const BodyState& b) {
  const DirectionMaker rows(g);
  switch (joint.kind) {
    case JointKind::hinge:
      return rows.about(g.axis).speed_of(a, b);
    case JointKind::slider:
      return rows.along(g.axis).speed_of(a, b);
    case JointKind::distance:
      return rows.along(direction_apart(g)).speed_of(a, b);
    default:
      return 0;
  }
}

void follow(const Joint& joint, const BodyState& a, const BodyState& b, double time, JointMemory& memory) {
  const double speed = joint.kind == JointKind::hinge ? dot(rotated(a.orientation, joint.axis_a),
                                                            b.angular_velocity - a.angular_velocity)
                                                      : 0;
  memory.position = geometry_of(joint, a, b, memory.position + time * speed).position;
}

JointDirections directions_of(const Joint& joint, const JointGeometry& g) {
  DirectionMaker rows(g);
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
      rows.free(rows.along(direction_apart(g)), joint);
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

JointImpulse impulse_of(const Joint& joint, const JointMemory& memory, const BodyState& a,
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
