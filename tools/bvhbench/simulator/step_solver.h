#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>

#include "islands.h"

namespace tandem::simulation {

/// Says how a step is solved.
enum class SolverKind : std::uint8_t {
  automatic,  ///< for each island Newton where that is the cheaper, else soft
  soft,       ///< substeps of one sweep over soft contacts and two that relax them
  newton,     ///< Newton's method on the whole island; soft where it does not converge
  sweeps,     ///< projected Gauss-Seidel
};

/// Says in which order sweeps visit contacts.
enum class ContactOrder : std::uint8_t {
  found,     ///< by ascending pair of bodies, sweeps forwards and backwards in turn
  shuffled,  ///< anew in each step, from the seed
};

struct SolverOptions {
  SolverKind kind = SolverKind::automatic;
  std::uint32_t substeps = 0;  ///< parts of a step that share its contacts, whose points move with the
                               ///< bodies; 0: default_substeps()
  double friction = 0.5;
  double restitution = 0;
  double slop = 5e-4;                ///< a length: penetration that is left alone, and how far bodies that
                                     ///< touch may move against each other until contacts are found anew
  double rolling_resistance = 8e-3;  ///< a length: a pair of bodies resists turning against each other by up
                                     ///< to this times the force that pushes them apart; not of sweeps
  bool warm_start = true;

  // These are for sweeps alone.
  std::uint32_t iterations = 30;           ///< sweeps over the contacts for velocities, at most
  std::uint32_t position_iterations = 30;  ///< the same for the correction of penetration
  double correction = 0.2;  ///< part of the rest that one step takes away, 0 to 1; Newton's too
  ContactOrder order = ContactOrder::found;
  std::uint64_t seed = 1;
  bool shock_propagation = false;
};

/// The parts of a step where options say nothing: 1 for sweeps, 16 for the others.
std::uint32_t default_substeps(SolverKind kind);

/// The data of which a solver makes a step.
struct StepInput {
  std::span<const BodyProperties> bodies;
  std::span<const ContactPoint> contacts;
  const Islands& islands;  ///< of these contacts
  double dt;
  Eigen::Vector3d gravity;
  std::uint64_t number;  ///< of the step
  bool is_cold;          ///< there are no impulses of a step before
};

/// Says what a solution leaves undone: the natural map of the complementarity problem, row by row the
/// velocity by which another visit would change a contact. Metres per second.
struct SolverStatistics {
  double residual = 0;      ///< the largest
  double residual_rms = 0;  ///< root of the mean square over all rows
  std::uint64_t islands = 0;
  std::uint64_t newton_islands = 0;  ///< of these solved by Newton's method
  std::uint64_t contacts = 0;        ///< of which at least one body is dynamic
};

/// Says what rows leave undone.
struct Residual {
  double largest = 0, squares = 0;

  void add(double row) {
    largest = std::max(largest, row);
    squares += row * row;
  }
};

/// Moves bodies through a step under gravity and contacts. The bytes are the same for any number of threads.
class StepSolver {
 public:
  virtual ~StepSolver() = default;

  /// states: those at the start of the step, and then at its end. impulses: for each contact what to start
  /// with, and then the solution, as a whole step would need it.
  virtual void step(const StepInput& input, std::span<BodyState> states,
                    std::span<ContactImpulse> impulses) = 0;

  /// Returns the statistics of the last step.
  const SolverStatistics& statistics() const { return statistics_; }

 protected:
  /// Makes the statistics of a step, but for newton_islands. residuals: of each island.
  void sum_up(const Islands& islands, std::span<const Residual> residuals);

  SolverStatistics statistics_;
};

/// Solves islands by themselves, side by side on the threads of the caller's oneTBB arena.
std::unique_ptr<StepSolver> make_step_solver(const SolverOptions& options);

/// The solver of SolverKind::sweeps.
std::unique_ptr<StepSolver> make_sweep_solver(const SolverOptions& options);

}  // namespace tandem::simulation
