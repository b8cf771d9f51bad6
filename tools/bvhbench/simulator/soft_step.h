#pragma once
#include "island_problem.h"

namespace tandem::simulation {

/// Solves a step in substeps of length h = dt / substeps. Each: velocities by gravity and the impulses of the
/// substep before; one sweep over soft normal rows; positions by the new velocities; two relaxing sweeps over
/// the normal rows without their push; one over friction, within the cone of the impulse that the normal row
/// has then, and one over rolling resistance. Restitution comes after all substeps.
///
/// A soft row is a damped spring of frequency f = 1 / (8 h) and damping ratio 10 (2 f and 5 against what does
/// not move), taken implicitly: it gives way to what one sweep cannot solve, and its push never becomes
/// speed, because the relaxing sweeps take it back.
///
/// Results: velocity, displacement, impulse of the problem, and what its last substep leaves undone.
IslandResidual solve_soft_step(IslandProblem& problem, const StepInput& input, const SolverOptions& options);

}  // namespace tandem::simulation
