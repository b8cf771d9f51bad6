#pragma once
#include <optional>
#include <span>

#include "dynamics/island_problem.h"

namespace tandem::dynamics {

/// Solves a step of an island by Newton's method in equal parts, each a step of its own with the same
/// contacts, which the bodies carry along, and normals that turn with the first of two: bodies that turn by a
/// large angle in a step ask for this. rule: of joints. The other arguments are those of
/// make_island_problem() and solve_newton_step().
///
/// Results, if all parts converged: states of the island's bodies, impulses of its contacts and of its joints
/// as sums over the parts, and what the last part leaves undone; else nothing, and these stay what they were.
std::optional<Residual> solve_newton_parts(const StepInput& input, std::size_t island, std::uint32_t parts,
                                           const SolverOptions& options,
                                           std::span<const std::uint32_t> layers,
                                           std::span<std::uint32_t> place,
                                           std::span<const std::uint32_t> order, JointRule rule,
                                           std::span<BodyState> states, std::span<ContactImpulse> impulses,
                                           bool* turned_far = nullptr);

}  // namespace tandem::dynamics
