#pragma once
#include <vector>

#include "island_problem.h"
#include "step_solver.h"

namespace tandem::simulation {

/// Solves islands by themselves, side by side on the threads of the caller's oneTBB arena; bodies that no
/// contact holds fly.
class IslandSolver final : public StepSolver {
 public:
  explicit IslandSolver(const SolverOptions& options);
  void step(const StepInput& input, std::span<BodyState> states, std::span<ContactImpulse> impulses) override;

 private:
  struct IslandReport {
    IslandResidual residual;
    bool by_newton = false;
  };

  IslandReport solve(IslandProblem& problem, const StepInput& input, bool try_newton) const;
  bool wants_newton(const Islands& islands, std::size_t island, std::span<const std::uint32_t> layers) const;
  void sum_up(const StepInput& input, std::span<const IslandReport> reports);

  SolverOptions options_;
  std::vector<std::uint32_t> place_;
};

}  // namespace tandem::simulation
