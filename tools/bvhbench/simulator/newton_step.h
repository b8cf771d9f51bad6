#pragma once
#include "island_problem.h"

namespace tandem::simulation {

/// What Newton's method did.
struct NewtonReport {
  bool converged = false;
  std::uint32_t factorisations = 0;
  std::uint32_t passes = 0;
  IslandResidual residual;
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
/// Results, if it converged: velocity, displacement and impulse of the problem; else these stay what they
/// were.
NewtonReport solve_newton_step(IslandProblem& problem, const StepInput& input, const SolverOptions& options);

}  // namespace tandem::simulation
