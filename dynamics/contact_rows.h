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
  TANDEM_HD double mobility() const { return square(a) + square(b); }
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
  Vector3 drive;             ///< of normal, first, second: by bodies that move and are not moved, at the end
  double drive_beyond_mean;  ///< of the normal
  double separation;         ///< of a gap; else the slop less the depth, at most 0
  double friction;           ///< Coulomb's coefficient
  double rebound;            ///< velocity along the normal that restitution asks for, or 0
  Vector3 impulse;           ///< along normal, first, second, as a whole step would need it

  TANDEM_HD double speed(const ContactRow& row, const Vector6& y_a, const Vector6& y_b) const {
    return dot(row.a, y_a) + dot(row.b, y_b);
  }
  /// Returns one mobility for both directions, or friction would not oppose the slip.
  TANDEM_HD double friction_mobility() const { return std::max(first.mobility(), second.mobility()); }
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

  TANDEM_HD explicit Tangents(const Vector3& normal)
      : first(unit_orthogonal(normal)), second(cross(normal, first)) {}
};

/// The numbers of a step that rows are made of.
struct StepNumbers : StepBodies {
  std::span<const BodyState> states;  ///< at the start
  SolverOptions options;
};

/// The contacts of a pair of bodies, which are consecutive in the list of a step.
struct ContactRange {
  std::uint32_t first, count;

  TANDEM_HD std::size_t size() const { return count; }
  TANDEM_HD std::uint32_t operator[](std::size_t i) const { return first + static_cast<std::uint32_t>(i); }
};

/// Makes rows of the contacts of a step.
class RowMaker {
 public:
  TANDEM_HD explicit RowMaker(const StepNumbers& step) : step_(step) {}

  TANDEM_HD SteppedBody body(std::uint32_t body) const;
  /// body: kNoIndex is one that is not.
  TANDEM_HD bool is_moved(std::uint32_t body) const {
    return body != kNoIndex && step_.bodies[body].motion == Motion::moving;
  }

  /// Calls visit(i, contact, patch) for each contact of a pair, by place in `contacts`. Contacts: of numbers,
  /// as ContactRange.
  template <typename Contacts, typename Visit>
  TANDEM_HD void visit_contacts(const Contacts& contacts, const Visit& visit) const {
    for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
      for (end = begin; end < contacts.size() && is_of_patch(contacts[begin], contacts[end]);) ++end;
      const ContactPatch patch = patch_of(contacts, begin, end);
      for (std::size_t i = begin; i < end; ++i) visit(i, step_.contacts[contacts[i]], patch);
    }
  }
  TANDEM_HD ContactMeeting meeting(const ContactPoint& contact, const ContactPatch& patch,
                                   const Material& material) const;
  TANDEM_HD ContactRows rows(const ContactPoint& contact, const ContactPatch& patch, const SteppedBody& a,
                             const SteppedBody& b, const Material& material,
                             const ContactImpulse& impulse) const;

  TANDEM_HD Material material_of(const ContactPoint& contact) const {
    return mixed_material(step_.bodies[contact.body_a], step_.bodies[contact.body_b], step_.options);
  }

  /// Returns what a time after the start of the step adds to the velocity of b's surface as seen from a's,
  /// where one of the two is kinematic and turns: the place of the contact goes on as the centre of the other
  /// one does, but by less than a radian. Without this, what a turntable carries creeps outwards, at
  /// w^2 r dt / 2 or w^2 r dt.
  TANDEM_HD Vector3 drive_gain(const ContactPoint& contact, double time) const {
    const double since = time - contact.time;
    return drive_gain(contact.body_b, contact.body_a, since) -
           drive_gain(contact.body_a, contact.body_b, since);
  }

  /// Returns how fast body b of a contact is turned against a by what contacts do not move.
  TANDEM_HD Vector3 turning_drive(const ContactPoint& contact) const {
    return spin_driven(contact.body_b) - spin_driven(contact.body_a);
  }

 private:
  TANDEM_HD bool is_of_patch(std::uint32_t first, std::uint32_t contact) const;
  template <typename Contacts>
  TANDEM_HD ContactPatch patch_of(const Contacts& contacts, std::size_t begin, std::size_t end) const;
  TANDEM_HD double separation_of(const ContactPoint& contact, const ContactPatch& patch,
                                 const ContactMeeting& meeting) const;
  TANDEM_HD static double depth_at_start(const ContactPoint& contact, const ContactMeeting& meeting) {
    return contact.depth + contact.time * dot(contact.normal, meeting.velocity);
  }
  TANDEM_HD double rebound_of(const ContactPoint& contact, const ContactMeeting& meeting,
                              const Material& material) const;
  TANDEM_HD Vector3 velocity_at(std::uint32_t body, const Vector3& arm) const;
  TANDEM_HD Vector3 pull_at(std::uint32_t body, const Vector3& arm) const;
  TANDEM_HD Vector3 driven(std::uint32_t body, const Vector3& arm) const;
  TANDEM_HD Vector3 drive_gain(std::uint32_t body, std::uint32_t other, double time) const;
  TANDEM_HD Vector3 spin_driven(std::uint32_t body) const;

  StepNumbers step_;
};

namespace contact_rows_detail {

TANDEM_HD inline Vector6 scaled(const MassScale& scale, const Vector3& velocity, const Vector3& spin) {
  return {scale.root_mass * velocity, inverse(scale.spread) * spin};
}

TANDEM_HD inline Vector6 gradient(const SteppedBody& body, const Vector3& direction, const Vector3& arm) {
  if (!body.moves) return {};
  return {body.scale.inverse_root_mass * direction, transposed(body.scale.spread) * cross(arm, direction)};
}

}  // namespace contact_rows_detail

TANDEM_HD inline SteppedBody RowMaker::body(std::uint32_t body) const {
  const BodyState& state = step_.states[body];
  SteppedBody out;
  out.moves = true;
  const double root_mass = std::sqrt(step_.bodies[body].mass);
  out.scale = {root_mass, 1 / root_mass,
               matrix_of(state.orientation) * cholesky(step_.bodies[body].inverse_inertia)};
  out.velocity = contact_rows_detail::scaled(out.scale, state.velocity, state.angular_velocity);
  out.gravity = contact_rows_detail::scaled(out.scale, step_.pulls[body].linear, step_.pulls[body].angular);
  return out;
}

// The contacts of a patch are those of a pair that have the same normal.
TANDEM_HD inline bool RowMaker::is_of_patch(std::uint32_t first, std::uint32_t contact) const {
  return square(step_.contacts[contact].normal - step_.contacts[first].normal) < 1e-12;
}

template <typename Contacts>
TANDEM_HD ContactPatch RowMaker::patch_of(const Contacts& contacts, std::size_t begin,
                                          std::size_t end) const {
  ContactPatch out = {&step_.contacts[contacts[begin]], {}};
  for (std::size_t k = begin; k < end; ++k) {
    const ContactPoint& contact = step_.contacts[contacts[k]];
    if (contact.depth > out.deepest->depth) out.deepest = &contact;
  }
  const double least = std::min(0.0, out.deepest->depth);
  double shares = 0;
  for (std::size_t k = begin; k < end; ++k) {
    const ContactPoint& contact = step_.contacts[contacts[k]];
    if (contact.depth < least) continue;
    const double share = step_.options.slop + std::max(0.0, contact.depth);
    out.centre += share * contact.position, shares += share;
  }
  out.centre = out.centre / shares;
  return out;
}

// A gap may close; what is in contact comes no deeper, or bodies would rock within the slop. But a body that
// rolls brings the points before it down: they may go on as they turn, and faster. Bodies that turn slowly,
// or have the contacts of the start, come to rest: there only points of a patch that is clearly round may, if
// that is much.
TANDEM_HD inline double RowMaker::separation_of(const ContactPoint& contact, const ContactPatch& patch,
                                                const ContactMeeting& meeting) const {
  constexpr double kFasterOfMiddle = 2, kPassed = 3, kRound = 0.7, kOfSlop = 0.25, kFaster = 4, kLeast = 0.3;
  // What comes out by itself is not pushed out.
  const double depth = std::min(contact.depth, depth_at_start(contact, meeting));
  const double separation = depth < 0 ? -depth : std::min(0.0, step_.options.slop - depth);
  const Vector3 spin_a = step_.states[contact.body_a].angular_velocity,
                spin_b = step_.states[contact.body_b].angular_velocity;
  const auto comes_down = [&](const Vector3& than) {
    return -step_.dt * dot(contact.normal, cross(spin_b - spin_a, contact.position - than));
  };
  const double turning = step_.dt * (step_.bodies[contact.body_a].radius * norm(spin_a) +
                                     step_.bodies[contact.body_b].radius * norm(spin_b));
  // A point that the bodies roll past within a few steps goes down and comes up again. Others may come as
  // deep as the patch is, or into the slop: what stays deeper is pushed out again, and that gains energy.
  const ContactPoint& deepest = *patch.deepest;
  const bool is_passed = norm(contact.position - patch.centre) < kPassed * turning;
  const double deeper = std::max(step_.options.slop, deepest.depth) - depth;
  const auto with = [&](double allowed) {
    return is_passed ? separation + allowed : std::max(separation, std::min(separation + allowed, deeper));
  };
  if (contact.time > 0 && turning > kFastFrom * step_.options.slop)
    return with(std::max(0.0, kFasterOfMiddle * comes_down(patch.centre)));
  if (deepest.depth - contact.depth < kRound * std::max(deepest.depth, kOfSlop * step_.options.slop))
    return separation;
  const double allowed = kFaster * comes_down(deepest.position);
  return allowed > kLeast * step_.options.slop ? with(allowed) : separation;
}

// The velocity of a body's point if contacts do not move the body, else 0.
TANDEM_HD inline Vector3 RowMaker::driven(std::uint32_t body, const Vector3& arm) const {
  if (step_.bodies[body].motion != Motion::kinematic) return Vector3{};
  return step_.states[body].velocity + cross(step_.states[body].angular_velocity, arm);
}

TANDEM_HD inline Vector3 RowMaker::drive_gain(std::uint32_t body, std::uint32_t other, double time) const {
  if (step_.bodies[body].motion != Motion::kinematic) return Vector3{};
  const BodyState& of = step_.states[body];
  const double turn = std::fabs(time) * norm(of.angular_velocity);
  const Vector3 way = time / std::max(1.0, turn) * (step_.states[other].velocity - of.velocity);
  return cross(of.angular_velocity, way);
}

TANDEM_HD inline Vector3 RowMaker::spin_driven(std::uint32_t body) const {
  if (step_.bodies[body].motion != Motion::kinematic) return Vector3{};
  return step_.states[body].angular_velocity;
}

// The velocity of a body's point.
TANDEM_HD inline Vector3 RowMaker::velocity_at(std::uint32_t body, const Vector3& arm) const {
  if (step_.bodies[body].motion == Motion::fixed) return Vector3{};
  return step_.states[body].velocity + cross(step_.states[body].angular_velocity, arm);
}

// Returns how gravity and lasting forces accelerate the place of a contact.
TANDEM_HD inline Vector3 RowMaker::pull_at(std::uint32_t body, const Vector3& arm) const {
  if (!is_moved(body)) return Vector3{};
  return step_.pulls[body].linear + cross(step_.pulls[body].angular, arm);
}

TANDEM_HD inline double RowMaker::rebound_of(const ContactPoint& contact, const ContactMeeting& meeting,
                                             const Material& material) const {
  constexpr double kBouncesAbove = 2;  // times what gravity and forces give in a step
  if (!(material.restitution > 0)) return 0;
  const double approach = -dot(contact.normal, meeting.velocity);
  const double fall =
      -dot(contact.normal, pull_at(contact.body_b, meeting.arm_b) - pull_at(contact.body_a, meeting.arm_a));
  const double gap = std::max(0.0, -depth_at_start(contact, meeting));
  const bool meets = gap < step_.dt * (approach + 0.5 * step_.dt * fall) || gap == 0;
  if (!meets || !(approach > kBouncesAbove * step_.dt * step_.pull_of(contact))) return 0;
  const double square_at_impact = approach * approach + 2 * fall * gap;
  return material.restitution * std::sqrt(std::max(0.0, square_at_impact));
}

TANDEM_HD inline ContactMeeting RowMaker::meeting(const ContactPoint& contact, const ContactPatch& patch,
                                                  const Material& material) const {
  ContactMeeting out;
  out.arm_a = arm_of(contact, step_.states[contact.body_a]);
  out.arm_b = arm_of(contact, step_.states[contact.body_b]);
  out.velocity = velocity_at(contact.body_b, out.arm_b) - velocity_at(contact.body_a, out.arm_a);
  out.separation = separation_of(contact, patch, out);
  out.rebound = rebound_of(contact, out, material);
  return out;
}

TANDEM_HD inline ContactRows RowMaker::rows(const ContactPoint& contact, const ContactPatch& patch,
                                            const SteppedBody& a, const SteppedBody& b,
                                            const Material& material, const ContactImpulse& impulse) const {
  const Tangents across(contact.normal);
  const ContactMeeting meets = meeting(contact, patch, material);
  const auto row = [&](const Vector3& direction) {
    return ContactRow{-contact_rows_detail::gradient(a, direction, meets.arm_a),
                      contact_rows_detail::gradient(b, direction, meets.arm_b)};
  };
  const auto along = [&](const Vector3& x) {
    return Vector3{dot(contact.normal, x), dot(across.first, x), dot(across.second, x)};
  };
  const Vector3 gain = drive_gain(contact, step_.dt), mean_gain = drive_gain(contact, 0.5 * step_.dt);
  const Vector3 moving = driven(contact.body_b, meets.arm_b) - driven(contact.body_a, meets.arm_a) + gain;
  const Vector3 pushed = along(impulse.tangential);
  ContactRows out;
  out.normal = row(contact.normal), out.first = row(across.first), out.second = row(across.second);
  out.first_direction = across.first, out.second_direction = across.second;
  out.drive = along(moving), out.drive_beyond_mean = dot(contact.normal, gain - mean_gain);
  out.separation = meets.separation, out.friction = material.friction, out.rebound = meets.rebound;
  out.impulse = {impulse.normal, pushed.y, pushed.z};
  return out;
}

/// Returns by how much an impulse of 1 about any axis changes how the bodies turn against each other, at
/// most.
TANDEM_HD inline double turning_mobility(const SteppedBody& a, const SteppedBody& b) {
  Matrix3 mobility;
  for (const SteppedBody* body : {&a, &b}) {
    if (body->moves) mobility = mobility + body->scale.spread * transposed(body->scale.spread);
  }
  double most = 0;
  for (const Vector3& row : mobility.row)
    most = std::max(most, std::fabs(row.x) + std::fabs(row.y) + std::fabs(row.z));
  return most;
}

/// Moves a body by a displacement and gives it a velocity, both as y.
TANDEM_HD inline void apply_motion(const BodyProperties& body, const MassScale& scale,
                                   const Vector6& velocity, const Vector6& displacement, double dt,
                                   BodyState& state) {
  state.velocity = velocity.linear / scale.root_mass;
  state.angular_velocity = scale.spread * velocity.angular;
  const Vector3 moved = displacement.linear / (scale.root_mass * dt);
  const Vector3 turned = scale.spread * displacement.angular / dt;
  advance(body, state, moved - state.velocity, turned - state.angular_velocity, dt);
}

}  // namespace tandem::dynamics
