#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>

#include "dynamics/islands.h"
#include "dynamics/joint.h"
#include "dynamics/threads.h"

namespace tandem::dynamics {

/// Says how a step is solved.
enum class SolverKind : std::uint8_t {
  automatic,  ///< for each island Newton where that is the cheaper, else soft
  soft,       ///< substeps of one sweep over soft contacts and two that relax them
  newton,     ///< Newton's method on the whole island; soft where it does not converge
};

struct SolverOptions {
  SolverKind kind = SolverKind::automatic;
  std::uint32_t substeps = 16;  ///< parts of a step that share its contacts, whose points move with the
                                ///< bodies
  double friction = 0.5;        ///< of bodies whose material says nothing, as the next
  double restitution = 0;
  double slop = 5e-4;                ///< a length: penetration that is left alone, and how far bodies that
                                     ///< touch may move against each other until contacts are found anew
  double rolling_resistance = 8e-3;  ///< a length: a pair of bodies resists turning against each other by up
                                     ///< to this times the force that pushes them apart
  bool warm_start = true;
  double correction = 0.2;  ///< part of the rest of penetration that one step takes away, 0 to 1; Newton's
};

/// Returns the numbers of two bodies that touch, none of them less than 0.
TANDEM_HD inline Material mixed_material(const BodyProperties& a, const BodyProperties& b,
                                         const SolverOptions& options) {
  const auto said = [](double number, double otherwise) { return number >= 0 ? number : otherwise; };
  const auto larger = [&](double Material::*number, double otherwise) {
    return std::max(said(a.material.*number, otherwise), said(b.material.*number, otherwise));
  };
  const double friction_a = said(a.material.friction, options.friction),
               friction_b = said(b.material.friction, options.friction);
  return {friction_a == friction_b ? friction_a : std::sqrt(friction_a * friction_b),
          larger(&Material::restitution, options.restitution),
          larger(&Material::rolling_resistance, options.rolling_resistance)};
}

/// Bodies and contacts of a step.
struct StepBodies {
  std::span<const BodyProperties> bodies;
  std::span<const ContactPoint> contacts;
  double dt;
  std::span<const Pull> pulls;  ///< of each body

  /// Returns what is added to the velocity of any point of a body in a second, at most; 0 of a body that
  /// contacts do not move.
  TANDEM_HD double pull_of(std::uint32_t body) const {
    return bodies[body].motion == Motion::moving ? pulls[body].most() : 0;
  }
  TANDEM_HD double pull_of(const ContactPoint& contact) const {
    return std::max(pull_of(contact.body_a), pull_of(contact.body_b));
  }
};

/// The data of which a solver makes a step.
struct StepInput : StepBodies {
  const Islands& islands;  ///< of these contacts and joints
  std::uint64_t number;    ///< of the step
  bool is_cold;            ///< there are no impulses of a step before
  Threads& threads;
  std::span<const Joint> joints = {};
  std::span<JointMemory> joint_memory = {};  ///< impulses of the step before, and then of this one
  /// A result: what each contact did in the step, which in soft steps is not what the next step starts with;
  /// empty: nobody asks.
  std::span<ContactImpulse> done = {};
  std::span<const std::uint32_t> joint_colours = {};  ///< see find_joint_colours()
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
  void add(const Residual& other) {
    largest = std::max(largest, other.largest);
    squares += other.squares;
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
  /// Makes the statistics of a step, but for newton_islands. residual: of all islands.
  void sum_up(const Islands& islands, const Residual& residual);

  SolverStatistics statistics_;
};

/// Solves islands by themselves, side by side.
std::unique_ptr<StepSolver> make_step_solver(const SolverOptions& options);

}  // namespace tandem::dynamics
