#include "simulator.h"

namespace tandem::simulation {
std::uint32_t default_substeps(SolverMethod method) {
  return method == SolverMethod::sweeps ? 1 : dynamics::SolverOptions().substeps;
}

SimulationOptions options_of(const SimulatorOptions& options) {
  SimulationOptions out = options;
  out.solver = options.solver;
  out.solver.kind = options.solver.method == SolverMethod::sweeps
                        ? SolverKind::soft
                        : static_cast<SolverKind>(options.solver.method);
  return out;
}

std::unique_ptr<StepSolver> make_solver(const TestBedSolverOptions& options) {
  TestBedSolverOptions complete = options;
  if (complete.substeps == 0) complete.substeps = default_substeps(options.method);
  if (options.method == SolverMethod::sweeps) return make_sweep_solver(complete);
  complete.kind = static_cast<SolverKind>(options.method);
  return make_step_solver(complete);
}

Simulator::Simulator(std::vector<BodyProperties> bodies, std::vector<BodyState> states,
                     std::unique_ptr<ContactFinder> contacts, const SimulatorOptions& options,
                     std::unique_ptr<ContinuousMotion> continuous, std::unique_ptr<ContactsAhead> ahead)
    : Simulation(std::move(bodies), std::move(states),
                 {std::move(contacts), std::move(ahead), std::move(continuous), make_solver(options.solver)},
                 options_of(options)) {}

}  // namespace tandem::simulation
