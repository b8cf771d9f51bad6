#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dynamics/contact_rows.h"
#include "dynamics/joint_rows.h"

namespace tandem::dynamics {

/// Two bodies that touch, and how b turns against a.
struct TouchingPair {
  std::uint32_t begin, end;        ///< of their contacts
  std::array<ContactRow, 3> turn;  ///< about the axes of the world
  Vector3 drive;                   ///< of turn
  double mobility;                 ///< an impulse of 1 about any axis changes turn by no more
  double rolling_resistance;       ///< the lever of the force that pushes them apart
  Vector3 impulse;                 ///< against turning, as a whole step would need it

  /// Return what the impulse adds to the y of its bodies.
  Vector6 change_of_a(const Vector3& by) const {
    return by.x * turn[0].a + by.y * turn[1].a + by.z * turn[2].a;
  }
  Vector6 change_of_b(const Vector3& by) const {
    return by.x * turn[0].b + by.y * turn[1].b + by.z * turn[2].b;
  }
};

/// A row of a joint of an island.
struct JointRow : JointConstraint {
  std::uint32_t joint;  ///< by place in StepInput::joints
  std::uint32_t a, b;   ///< places of its bodies

  double along(const std::vector<Vector6>& y) const { return dot(gradient.a, y[a]) + dot(gradient.b, y[b]); }
};

/// The bodies and contacts of one island in arrays, for one step: inertia, arms and directions stay those of
/// its start. Bodies are known by their place here; 0 stands for all that contacts do not move, whose y is 0.
struct IslandProblem {
  std::vector<std::uint32_t> bodies;  ///< [0] is none
  std::vector<MassScale> scale;
  std::vector<Vector6> velocity;      ///< y: at the start of the step, then at its end
  std::vector<Vector6> displacement;  ///< the integral of y over the step, a result
  std::vector<Vector6> gravity;       ///< what it and lasting forces add to y in a second

  std::vector<std::uint32_t> contacts, a, b;
  std::vector<ContactRow> normal, first, second;  ///< the latter two across the normal
  std::vector<Vector3> first_direction, second_direction;
  std::vector<Vector3> drive;      ///< of normal, first, second: by bodies that move and are not moved
  std::vector<double> separation;  ///< of a gap; else the slop less the depth, at most 0
  std::vector<double> friction;    ///< Coulomb's coefficient
  std::vector<double> rebound;     ///< velocity along the normal that restitution asks for, or 0
  std::vector<Vector3> impulse;    ///< along normal, first, second, as a whole step would need it

  std::vector<TouchingPair> pairs;

  std::span<const BodyState> states;  ///< of all bodies of the step, at its start
  std::vector<std::uint32_t> joints;  ///< by place in StepInput::joints
  std::vector<JointRow> joint_rows;   ///< in the order of joints

  std::size_t contact_count() const { return contacts.size(); }
  double along(const ContactRow& row, std::size_t contact, const std::vector<Vector6>& y) const {
    return dot(row.a, y[a[contact]]) + dot(row.b, y[b[contact]]);
  }
  /// Returns by how much b of a pair turns against a, but for what drives them.
  Vector3 turning(const TouchingPair& pair, const std::vector<Vector6>& y) const {
    return {along(pair.turn[0], pair.begin, y), along(pair.turn[1], pair.begin, y),
            along(pair.turn[2], pair.begin, y)};
  }
  /// Returns one mobility for both directions, or friction would not oppose the slip.
  double friction_mobility(std::size_t contact) const {
    return std::max(first[contact].mobility(), second[contact].mobility());
  }
  /// Return what a contact's impulse adds to the y of its bodies.
  Vector6 change_of_a(std::size_t contact, const Vector3& by) const {
    return by.x * normal[contact].a + by.y * first[contact].a + by.z * second[contact].a;
  }
  Vector6 change_of_b(std::size_t contact, const Vector3& by) const {
    return by.x * normal[contact].b + by.y * first[contact].b + by.z * second[contact].b;
  }
};

/// Returns what a contact leaves undone. target: of the velocity along the normal. share: part of the
/// problem's impulses that the law is asked of.
Residual residual_of(const IslandProblem& problem, std::size_t contact, double target, double share);

/// The bodies at the start of a step, and the impulses that its contacts start with.
struct StepStart {
  std::span<const BodyState> states;
  std::span<const ContactImpulse> impulses;
};

/// Bodies and contacts come by ascending layer (find_layers()), these of their lower body, so that a sweep
/// goes up from the ground; where there is an order of the island's bodies, bodies come by it. place: for
/// each body of the step a number that this may change.
IslandProblem make_island_problem(const StepInput& input, std::size_t island, const StepStart& start,
                                  const SolverOptions& options, std::span<const std::uint32_t> layers,
                                  std::span<std::uint32_t> place, std::span<const std::uint32_t> order = {});

/// Returns the state at the end of the step of the body at a place, of this velocity and displacement.
BodyState state_at_end(const IslandProblem& problem, const StepInput& input, std::size_t place,
                       const Vector6& velocity, const Vector6& displacement);

/// Moves the island's bodies by the displacement, gives them the velocities, and hands out the impulses.
void apply_solution(const IslandProblem& problem, const StepInput& input, std::span<BodyState> states,
                    std::span<ContactImpulse> impulses);

/// Says which directions joints act in during a step of Newton's method.
enum class JointRule : std::uint8_t {
  exact,  ///< those of the middle of the step, which keep energy; it fails where bodies turn too far for that
  damped,  ///< those of its start
};

/// Solves a step of a whole island to convergence, in passes. Each finds the velocities that make the
/// function of ConvexContacts least, with the impulses and the bounds of friction that the pass before ended
/// with; the first starts from those of the step before. At the least, a contact misses its law by R times
/// the change of its impulse, so passes end in Coulomb's law without any softness (the method of multipliers;
/// Tresca's iteration for friction). They end when another would change no velocity of a contact by more than
/// 10^-4 of what gravity gives in a step, and 10^-6 of the fastest approach.
///
/// The displacement is that of the velocities nearest, in the metric of mass, to the mean of those at the
/// start and at the end, that bring no contact deeper than the slop and take away the part `correction` of
/// what is deeper. The mean makes sliding and stopping right to second order.
///
/// Results, if it converged: velocity, displacement and impulse of the problem, and what is left undone; else
/// nothing, and these stay what they were. turned_far: or null; becomes whether it did not because bodies of
/// joints turned too far.
std::optional<Residual> solve_newton_step(IslandProblem& problem, const StepInput& input,
                                          const SolverOptions& options, JointRule rule = JointRule::exact,
                                          bool* turned_far = nullptr);

}  // namespace tandem::dynamics
