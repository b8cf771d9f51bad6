#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "step_solver.h"

namespace tandem::simulation {

/// The step that is solved for.
struct SolverStep {
  double dt;
  double gravity_speed;  ///< that gravity gives in the step
  std::uint64_t number;  ///< of the step: another order for each
};

/// Velocities that correct penetration and are forgotten after they have moved the bodies.
struct Correction {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
};

/// Projected Gauss-Seidel on the velocity-level complementarity problem of contacts with a friction pyramid
/// (Stewart and Trinkle 1996; Erleben 2007): for each contact, with w the relative velocity of b at the
/// point,
///
///     0 <= lambda_n  complementary to  w_n - target >= 0
///     -mu lambda_n <= lambda_t <= mu lambda_n,  w_t = 0 in between, opposed to lambda_t at a bound
///
/// target: restitution times the speed of approach where that is more than gravity gives in two steps, else
/// 0. The first tangent is that in which the bodies slip, so that sliding friction has Coulomb's size
/// whatever its direction.
///
/// Penetration beyond the slop is taken away by a second set of velocities, which push along normals alone,
/// move the bodies once, and never become kinetic energy (split impulses).
///
/// An island is done before all sweeps are made when one changes no velocity by more than 10⁻⁹ of what
/// gravity gives in a step. Islands are solved side by side by the threads of the caller's oneTBB arena. The
/// same bytes for any number of them.
class ContactSolver {
 public:
  /// Solves for the velocities at the end of a step. `impulses`: what to start with, and then the solution.
  /// Results: states' velocities, impulses, corrections(). Conditions: velocities include all that is not
  /// contacts; islands are those of these contacts.
  void solve(std::span<const BodyProperties> bodies, std::span<BodyState> states,
             std::span<const ContactPoint> contacts, const Islands& islands,
             std::span<ContactImpulse> impulses, const SolverOptions& options, const SolverStep& step);

  /// For each body, of the last solve().
  std::span<const Correction> corrections() const { return corrections_; }
  const SolverStatistics& statistics() const { return statistics_; }

  struct Row;
  struct Joint;  ///< a contact as the solver sees it
  struct Mover;  ///< a body as the solver sees it

 private:
  std::vector<Mover> movers_;
  std::vector<Joint> joints_;
  std::vector<Correction> corrections_;
  SolverStatistics statistics_;

 public:
  ContactSolver();
  ContactSolver(const ContactSolver&) = delete;
  ContactSolver& operator=(const ContactSolver&) = delete;
  ~ContactSolver();
};

/// Steps by sweeps: as many solutions as substeps. With warm start, a step that has no impulse of the step
/// before makes ten times the sweeps.
class SweepSolver final : public StepSolver {
 public:
  explicit SweepSolver(const SolverOptions& options);
  void step(const StepInput& input, std::span<BodyState> states, std::span<ContactImpulse> impulses) override;

 private:
  SolverOptions options_;
  ContactSolver solver_;
};

}  // namespace tandem::simulation
