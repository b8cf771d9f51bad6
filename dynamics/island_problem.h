#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dynamics/contact_island.h"
#include "dynamics/joint_rows.h"

namespace tandem::dynamics {

/// A row of a joint of an island.
struct JointRow : JointConstraint {
  std::uint32_t joint;  ///< by place in StepInput::joints
  std::uint32_t a, b;   ///< places of its bodies

  double along(std::span<const Vector6> y) const { return dot(gradient.a, y[a]) + dot(gradient.b, y[b]); }
};

/// A contact island with its memory, and its joints.
struct IslandProblem : ContactIsland {
  std::unique_ptr<std::byte[]> memory;
  std::span<const BodyState> states;  ///< of all bodies of the step, at its start
  std::vector<std::uint32_t> joints;  ///< by place in StepInput::joints
  std::vector<JointRow> joint_rows;   ///< in the order of joints
};

/// Returns what a contact leaves undone. target: of the velocity along the normal.
Residual residual_of(const ContactIsland& island, std::size_t contact, double target);

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

/// Solves a step of a whole island, see NewtonStep.
///
/// Results, if it converged: velocity, displacement and impulse of the problem, and what is left undone; else
/// nothing, and these stay what they were. turned_far: or null; becomes whether it did not because bodies of
/// joints turned too far.
std::optional<Residual> solve_newton_step(IslandProblem& problem, const StepInput& input,
                                          const SolverOptions& options, JointRule rule = JointRule::exact,
                                          bool* turned_far = nullptr);

}  // namespace tandem::dynamics
