#pragma once
#include <algorithm>
#include <span>

#include "dynamics/step_solver.h"

namespace tandem::dynamics {

/// A direction of a contact as two gradients: w = a . y_a + b . y_b + drive. An impulse of 1 adds a to y_a
/// and b to y_b.
struct ContactRow {
  Vector6 a, b;

  /// Returns by how much an impulse of 1 changes w.
  double mobility() const { return square(a) + square(b); }
};

/// Turns velocities of a body into those in which its mass is 1: y = (sqrt(m) v, F^-1 spin), where F F^T is
/// the inverse of the inertia. Kinetic energy is |y|^2 / 2.
struct MassScale {
  double root_mass = 1, inverse_root_mass = 1;
  Matrix3 spread = Matrix3::identity();  ///< F
};

/// A body in a step. What contacts do not move has no velocity here: what it does is in the rows' drive.
struct SteppedBody {
  bool moves = false;
  MassScale scale;
  Vector6 velocity = {};  ///< y at the start
  Vector6 gravity = {};   ///< what it and lasting forces add to y in a second
};

/// A contact as a solver takes it.
struct ContactRows {
  ContactRow normal, first, second;  ///< the latter two across the normal
  Vector3 first_direction, second_direction;
  Vector3 drive;      ///< of normal, first, second: by bodies that move and are not moved
  double separation;  ///< of a gap; else the slop less the depth, at most 0
  double friction;    ///< Coulomb's coefficient
  double rebound;     ///< velocity along the normal that restitution asks for, or 0
  Vector3 impulse;    ///< along normal, first, second, as a whole step would need it

  double speed(const ContactRow& row, const Vector6& y_a, const Vector6& y_b) const {
    return dot(row.a, y_a) + dot(row.b, y_b);
  }
  /// Returns one mobility for both directions, or friction would not oppose the slip.
  double friction_mobility() const { return std::max(first.mobility(), second.mobility()); }
};

/// The contacts of a pair of bodies that have one normal.
struct ContactPatch {
  const ContactPoint* deepest;
  Vector3 centre;  ///< the mean of those that touch, the deeper counting more
};

/// Says how the bodies of a contact meet.
struct ContactMeeting {
  Vector3 arm_a, arm_b;  ///< of the contact, from the centres of mass
  Vector3 velocity;      ///< of b's point as seen from a's
  double separation;     ///< of a gap; else the slop less the depth, at most 0
  double rebound;        ///< velocity along the normal that restitution asks for, or 0
};

/// Two directions across a normal.
struct Tangents {
  Vector3 first, second;

  explicit Tangents(const Vector3& normal) : first(unit_orthogonal(normal)), second(cross(normal, first)) {}
};

/// Makes rows of the contacts of a step.
class RowMaker {
 public:
  RowMaker(const StepInput& input, std::span<const BodyState> states, const SolverOptions& options)
      : input_(input), states_(states), options_(options) {}

  SteppedBody body(std::uint32_t body) const;
  /// body: kNoIndex is one that is not.
  bool is_moved(std::uint32_t body) const {
    return body != kNoIndex && input_.bodies[body].motion == Motion::moving;
  }

  /// Calls visit(i, contact, patch) for each contact of a pair, by place in `contacts`.
  template <typename Visit>
  void visit_contacts(std::span<const std::uint32_t> contacts, const Visit& visit) const {
    for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
      for (end = begin; end < contacts.size() && is_of_patch(contacts[begin], contacts[end]);) ++end;
      const ContactPatch patch = patch_of(contacts.subspan(begin, end - begin));
      for (std::size_t i = begin; i < end; ++i) visit(i, input_.contacts[contacts[i]], patch);
    }
  }
  ContactMeeting meeting(const ContactPoint& contact, const ContactPatch& patch,
                         const Material& material) const;
  ContactRows rows(const ContactPoint& contact, const ContactPatch& patch, const SteppedBody& a,
                   const SteppedBody& b, const Material& material, const ContactImpulse& impulse) const;

  Material material_of(const ContactPoint& contact) const {
    return mixed_material(input_.bodies[contact.body_a], input_.bodies[contact.body_b], options_);
  }

  /// Returns how fast body b of a contact is turned against a by what contacts do not move.
  Vector3 turning_drive(const ContactPoint& contact) const {
    return spin_driven(contact.body_b) - spin_driven(contact.body_a);
  }

 private:
  bool is_of_patch(std::uint32_t first, std::uint32_t contact) const;
  ContactPatch patch_of(std::span<const std::uint32_t> contacts) const;
  double separation_of(const ContactPoint& contact, const ContactPatch& patch,
                       const ContactMeeting& meeting) const;
  static double depth_at_start(const ContactPoint& contact, const ContactMeeting& meeting) {
    return contact.depth + contact.time * dot(contact.normal, meeting.velocity);
  }
  double rebound_of(const ContactPoint& contact, const ContactMeeting& meeting,
                    const Material& material) const;
  Vector3 velocity_at(std::uint32_t body, const Vector3& arm) const;
  Vector3 pull_at(std::uint32_t body, const Vector3& arm) const;
  Vector3 driven(std::uint32_t body, const Vector3& arm) const;
  Vector3 spin_driven(std::uint32_t body) const;

  const StepInput& input_;
  std::span<const BodyState> states_;
  const SolverOptions& options_;
};

/// Returns by how much an impulse of 1 about any axis changes how the bodies turn against each other, at
/// most.
double turning_mobility(const SteppedBody& a, const SteppedBody& b);

/// Moves a body by a displacement and gives it a velocity, both as y.
void apply_motion(const BodyProperties& body, const MassScale& scale, const Vector6& velocity,
                  const Vector6& displacement, double dt, BodyState& state);

}  // namespace tandem::dynamics
