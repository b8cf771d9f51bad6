#include "step_solver.h"

#include "island_solver.h"
#include "sweep_solver.h"

namespace tandem::simulation {

std::uint32_t default_substeps(SolverKind kind) {
  constexpr std::uint32_t kSoft = 16;
  return kind == SolverKind::sweeps ? 1 : kSoft;
}

std::unique_ptr<StepSolver> make_step_solver(const SolverOptions& options) {
  SolverOptions complete = options;
  if (complete.substeps == 0) complete.substeps = default_substeps(options.kind);
  if (complete.kind == SolverKind::sweeps) return std::make_unique<SweepSolver>(complete);
  return std::make_unique<IslandSolver>(complete);
}

}  // namespace tandem::simulation
