#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "dynamics/joint_rows.h"
#include "dynamics/soft_rules.h"
#include "dynamics/softness.h"

/// What a soft step does with a joint, in float64, for host and device. SoftJoints and ParallelSoftStep share
/// it, and so give the same bytes.
namespace tandem::dynamics {

/// How the two bodies of a joint move: y, 0 of one that contacts do not move.
struct JointMotion {
  Vector6 a, b;
};

/// A joint in a soft step. The rows that are held come first and are solved at once, because they act on each
/// other about as much as on themselves.
struct SoftJoint {
  static constexpr std::uint32_t kMostHeld = 6;

  std::uint32_t joint;                  ///< by place in StepInput::joints
  std::uint32_t held, count;            ///< rows; none where contacts move neither body
  JointConstraint row[kMostJointRows];  ///< impulses and their bounds are those of a substep
  double sum[kMostJointRows];           ///< of the impulses of the substeps
  double lower[kMostHeld][kMostHeld];   ///< L L^T: how impulses of those held change their w
  JointMotion due;                      ///< see follow_joint()
};

/// A body of a joint in a soft step.
struct SoftJointBody : JointedBody {
  Vector6 velocity = {};  ///< y at the start of the step

  /// stepped: null of a body that contacts do not move.
  TANDEM_HD SoftJointBody(std::uint32_t body, const BodyProperties* bodies, const BodyState* states,
                          const SteppedBody* stepped)
      : JointedBody(body, bodies, states, stepped != nullptr ? &stepped->scale : nullptr) {
    if (stepped != nullptr) velocity = stepped->velocity;
  }

  /// Return y of what a soft step has added to the motion, and back.
  TANDEM_HD Vector6 y_of(const SoftMotion& added) const {
    return moves ? velocity + added_motion(scale, added) : Vector6{};
  }
  /// Returns the displacement in a time. moved: what the step has added to the body's way.
  TANDEM_HD Vector6 way_of(double time, const SoftMotion& moved) const {
    return moves ? time * velocity + added_motion(scale, moved) : Vector6{};
  }
  TANDEM_HD SoftMotion added_of(const Vector6& y) const {
    const Vector6 added = y - velocity;
    SoftMotion out;
    put(scale.inverse_root_mass * added.linear, out.centre);
    put(added.angular, out.spin);
    return out;
  }
};

/// The bodies of a joint in a soft step.
struct SoftJointBodies {
  SoftJointBody a, b;
};

/// The numbers of a soft step that its joints need.
struct SoftJointNumbers {
  double dt, h;  ///< seconds of the step, and of a substep
  double substeps;
  Softness softness;  ///< how what is out of place comes back

  TANDEM_HD explicit SoftJointNumbers(const SoftNumbers& step)
      : dt(step.dt), h(step.h), substeps(step.substeps), softness(step.against_unmoved) {}
};

namespace soft_joint_detail {

TANDEM_HD inline double speed_of(const JointConstraint& row, const JointMotion& y) {
  return dot(row.gradient.a, y.a) + dot(row.gradient.b, y.b);
}

// Adds what an impulse along a row does.
TANDEM_HD inline void add_impulse(const JointConstraint& row, double impulse, JointMotion& to) {
  to.a += impulse * row.gradient.a;
  to.b += impulse * row.gradient.b;
}

TANDEM_HD inline void push(JointConstraint& row, JointMotion& y, double impulse) {
  add_impulse(row, impulse, y);
  row.impulse += impulse;
}

// Sets `lower`, for rows as they are now.
TANDEM_HD inline void factorise(SoftJoint& joint) {
  auto& lower = joint.lower;
  for (std::uint32_t i = 0; i < joint.held; ++i) {
    const ContactRow& row = joint.row[i].gradient;
    for (std::uint32_t j = 0; j <= i; ++j) {
      const ContactRow& other = joint.row[j].gradient;
      double value = dot(row.a, other.a) + dot(row.b, other.b);
      for (std::uint32_t k = 0; k < j; ++k) value -= lower[i][k] * lower[j][k];
      lower[i][j] = i > j ? value / lower[j][j] : std::sqrt(value);
    }
  }
}

// Visits a row that is a motor or a limit, see visit_joint().
TANDEM_HD inline void visit_free_row(JointConstraint& row, JointMotion& y, double h, const Softness* soft) {
  const double mobility = row.gradient.mobility(), w = speed_of(row, y) + row.drive;
  const auto wanted = [&](double speed) { return row.impulse + (speed - w) / mobility; };
  // A bound that is not reached yet may be reached in the substep, but not passed.
  const auto at_bound = [&](double way, bool passed) {
    if (!passed) return wanted(way / h);
    if (soft == nullptr) return wanted(0);
    return row.impulse + soft->mass_scale * (soft->bias_rate * way - w) / mobility -
           soft->impulse_scale * row.impulse;
  };
  double next = 0;
  if (row.kind == JointRowKind::motor) {
    next = wanted(row.speed);
  } else {
    const double least = at_bound(row.least_way, row.least_way > 0);
    const double most = at_bound(row.most_way, row.most_way < 0);
    next = least > 0 ? least : std::min(most, 0.0);
  }
  push(row, y, std::clamp(next, row.least_push, row.most_push) - row.impulse);
}

}  // namespace soft_joint_detail

/// Begins a step with a joint, whose bodies stand as at its start. unit_root: see soft_body().
TANDEM_HD inline void begin_joint(const SoftJointNumbers& step, double unit_root, std::uint32_t joint,
                                  const Joint& of, const JointMemory& memory, const SoftJointBodies& bodies,
                                  SoftJoint& out) {
  const auto& [a, b] = bodies;
  out.joint = joint;
  out.held = out.count = 0, out.due = {};
  const JointDirections from = directions_of(of, geometry_of(of, a.start, b.start, memory.position));
  const double scale = 1 / (step.substeps * unit_root * unit_root);
  for (std::size_t k = 0; k < from.count; ++k) {
    JointConstraint& row = out.row[out.count];
    row = constraint_of(of, memory, from.row[k], a, b, step.dt);
    for (double* of_step : {&row.impulse, &row.least_push, &row.most_push}) *of_step *= scale;
    out.sum[out.count++] = 0;
    if (row.kind == JointRowKind::hold) ++out.held;
  }
  soft_joint_detail::factorise(out);
}

/// Adds the impulses that the joint starts with to the velocities of its bodies.
TANDEM_HD inline void push_joint(const SoftJoint& joint, JointMotion& y) {
  for (std::uint32_t i = 0; i < joint.count; ++i)
    soft_joint_detail::add_impulse(joint.row[i], joint.row[i].impulse, y);
}

/// Makes the rows those of bodies that have moved for a time. Impulses stay along the rows that they were
/// found for; what they would add along the new ones is due to the next substep. displacement: of bodies
/// that move.
TANDEM_HD inline void follow_joint(const Joint& of, double position, const SoftJointBodies& bodies,
                                   double time, const JointMotion& displacement, SoftJoint& joint) {
  using soft_joint_detail::add_impulse;
  const auto& [a, b] = bodies;
  joint.due = {};
  for (std::uint32_t i = 0; i < joint.count; ++i) add_impulse(joint.row[i], -joint.row[i].impulse, joint.due);
  const JointDirections from = directions_of(
      of, geometry_of(of, a.after(time, displacement.a), b.after(time, displacement.b), position));
  for (std::uint32_t i = 0; i < joint.count; ++i) follow_direction(from.row[i], a, b, joint.row[i]);
  soft_joint_detail::factorise(joint);
  for (std::uint32_t i = 0; i < joint.count; ++i) add_impulse(joint.row[i], joint.row[i].impulse, joint.due);
}

/// Adds what is due.
TANDEM_HD inline void add_due(const SoftJoint& joint, JointMotion& y) {
  y.a += joint.due.a, y.b += joint.due.b;
}

/// Counts the impulses as those of a substep.
TANDEM_HD inline void sum_up(SoftJoint& joint) {
  for (std::uint32_t i = 0; i < joint.count; ++i) joint.sum[i] += joint.row[i].impulse;
}

/// Changes the impulses of a joint's rows, and the velocities of its bodies, by one visit of a sweep. soft:
/// how what is out of place comes back; null: it does not, and only velocities are mended.
TANDEM_HD inline void visit_joint(SoftJoint& joint, JointMotion& y, double h, const Softness* soft) {
  using namespace soft_joint_detail;
  const auto& lower = joint.lower;
  for (std::uint32_t i = joint.held; i < joint.count; ++i) visit_free_row(joint.row[i], y, h, soft);
  double x[SoftJoint::kMostHeld];
  for (std::uint32_t i = 0; i < joint.held; ++i) {
    const JointConstraint& row = joint.row[i];
    x[i] = (soft != nullptr ? soft->bias_rate * row.least_way : 0) - speed_of(row, y) - row.drive;
    for (std::uint32_t k = 0; k < i; ++k) x[i] -= lower[i][k] * x[k];
    x[i] /= lower[i][i];
  }
  for (std::uint32_t i = joint.held; i-- > 0;) {
    for (std::uint32_t k = i + 1; k < joint.held; ++k) x[i] -= lower[k][i] * x[k];
    x[i] /= lower[i][i];
  }
  for (std::uint32_t i = 0; i < joint.held; ++i) {
    JointConstraint& row = joint.row[i];
    push(row, y, soft != nullptr ? soft->mass_scale * x[i] - soft->impulse_scale * row.impulse : x[i]);
  }
}

/// Hands out the impulses of the step.
TANDEM_HD inline void write_joint(const SoftJointNumbers& step, double unit_root, const SoftJoint& joint,
                                  JointMemory& memory) {
  const double unit = unit_root * unit_root;
  for (std::uint32_t i = 0; i < joint.count; ++i) {
    const JointConstraint& row = joint.row[i];
    memory.impulse[row.slot] = step.substeps * unit * row.impulse;
    memory.done[row.slot] = unit * (joint.sum[i] + row.impulse);
  }
}

}  // namespace tandem::dynamics
