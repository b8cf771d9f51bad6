#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "contact_point.h"
#include "impulse_cache.h"
#include "islands.h"
#include "rigid_body.h"

namespace tandem::simulation {

/// In which order contacts are solved.
enum class ContactOrder : std::uint8_t {
  found,     ///< by ascending pair of bodies, sweeps forwards and backwards in turn
  shuffled,  ///< anew in each step, from the seed
};

struct SolverOptions {
  std::uint32_t iterations = 30;           ///< sweeps over the contacts for velocities, at most
  std::uint32_t position_iterations = 30;  ///< the same for the correction of penetration
  double friction = 0.5;
  double restitution = 0;
  double slop = 5e-4;       ///< penetration that is left alone, a length
  double correction = 0.2;  ///< part of the rest that one step takes away, 0 to 1
  ContactOrder order = ContactOrder::found;
  std::uint64_t seed = 1;
  bool warm_start = true;
  bool shock_propagation = false;
};

/// The step that is solved for.
struct SolverStep {
  double dt;
  double gravity_speed;  ///< that gravity gives in the step
  std::uint64_t number;  ///< of the step: another order for each
};

/// What a solution leaves undone: the natural map of the complementarity problem, row by row the velocity by
/// which another visit would change a contact. Metres per second.
struct SolverStatistics {
  double residual = 0;      ///< the largest
  double residual_rms = 0;  ///< root of the mean square over all rows
  std::uint64_t islands = 0;
  std::uint64_t contacts = 0;  ///< of which at least one body is dynamic
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

}  // namespace tandem::simulation
