#pragma once
#include <algorithm>
#include <cstdint>

#include "dynamics/contact_rows.h"
#include "dynamics/joint_rules.h"

/// The directions of a joint as rows of a solver, for host and device.
namespace tandem::dynamics {

/// A direction in which a joint acts, and the impulse there.
struct JointConstraint {
  JointRowKind kind;
  std::uint8_t slot;
  ContactRow gradient;           ///< of w, but for its drive
  double drive;                  ///< by bodies that move and are not moved
  double least_way, most_way;    ///< see JointDirection
  double speed;                  ///< that a motor asks for
  double least_push, most_push;  ///< bounds of the impulse of a whole step
  double impulse;                ///< as a whole step would need it
};

/// A body of a joint in a step.
struct JointedBody {
  bool moves = false;      ///< contacts and joints move it
  bool is_driven = false;  ///< it is kinematic
  MassScale scale;         ///< of one that moves
  BodyState start;         ///< at the start of the step; at rest, unless it is kinematic

  /// body: kNoIndex is the world. scale: null of a body that contacts do not move.
  TANDEM_HD JointedBody(std::uint32_t body, const BodyProperties* bodies, const BodyState* states,
                        const MassScale* scale_of_moving) {
    if (body == kNoIndex) return;
    start = states[body];
    is_driven = bodies[body].motion == Motion::kinematic;
    if (!is_driven) start.velocity = start.angular_velocity = Vector3{};
    moves = scale_of_moving != nullptr;
    if (moves) scale = *scale_of_moving;
  }

  /// Returns its state some time after the start of the step. displacement: of one that moves.
  TANDEM_HD BodyState after(double time, const Vector6& displacement) const {
    BodyState state = start;
    Vector3 way = time * state.velocity, turn = time * state.angular_velocity;
    if (moves) {
      way = displacement.linear / scale.root_mass;
      turn = scale.spread * displacement.angular;
    }
    state.position += way;
    state.orientation = rotation_by(turn) * state.orientation;
    return state;
  }
};

namespace joint_rows_detail {

TANDEM_HD inline Vector6 gradient(const JointedBody& body, const Vector3& linear, const Vector3& angular) {
  if (!body.moves) return {};
  return {linear / body.scale.root_mass, transposed(body.scale.spread) * angular};
}

}  // namespace joint_rows_detail

/// Makes the row one of this direction.
TANDEM_HD inline void set_direction(const JointDirection& from, const JointedBody& a, const JointedBody& b,
                                    JointConstraint& row) {
  using joint_rows_detail::gradient;
  row.gradient.a = -gradient(a, from.linear, from.angular_a);
  row.gradient.b = gradient(b, from.linear, from.angular_b);
  row.drive = a.is_driven || b.is_driven
                  ? from.speed_of(a.moves ? BodyState() : a.start, b.moves ? BodyState() : b.start)
                  : 0;
}

/// Does what set_direction() does, and sets how far the row may still change what it changes.
TANDEM_HD inline void follow_direction(const JointDirection& from, const JointedBody& a, const JointedBody& b,
                                       JointConstraint& row) {
  set_direction(from, a, b, row);
  row.least_way = from.least_way, row.most_way = from.most_way;
}

/// Returns the row of a direction at the start of a step, with the impulse that it starts with.
TANDEM_HD inline JointConstraint constraint_of(const Joint& joint, const JointMemory& memory,
                                               const JointDirection& from, const JointedBody& a,
                                               const JointedBody& b, double dt) {
  JointConstraint row = {};
  row.kind = from.kind, row.slot = from.slot;
  row.speed = joint.speed;
  row.most_push = from.kind == JointRowKind::motor ? dt * joint.most_effort : INFINITY;
  row.least_push = -row.most_push;
  row.impulse = std::clamp(memory.impulse[row.slot], row.least_push, row.most_push);
  follow_direction(from, a, b, row);
  return row;
}

}  // namespace tandem::dynamics
