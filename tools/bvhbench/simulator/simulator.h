#pragma once
#include <tbb/task_arena.h>
#include <Eigen/Core>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "contact_cache.h"
#include "continuous_motion.h"
#include "step_solver.h"

namespace tandem::simulation {

/// The record of what a step found and did. The contacts are those of the state before the step; energies,
/// momenta and speeds are those of the state after it, over all dynamic bodies.
struct StepRecord {
  double time = 0;  ///< at the end of the step

  // Seconds that the phases took.
  double update_seconds = 0, broad_phase_seconds = 0, traversal_seconds = 0, triangle_test_seconds = 0,
         transfer_seconds = 0, contact_seconds = 0, solver_seconds = 0, step_seconds = 0;

  std::uint64_t object_pairs = 0, kept_pairs = 0, block_pairs = 0, candidates = 0, triangle_pairs = 0;
  std::uint64_t segments = 0, patches = 0, open_curves = 0, contacts = 0;
  std::uint64_t islands = 0, newton_islands = 0, sleeping = 0, reentered = 0;

  double contact_ratio =
      0;  ///< pairs of triangles that meet, by the triangles of dynamic bodies: the paper's Figure 6
  double contact_area = 0;
  double penetration_max = 0, penetration_mean = 0;  ///< over the contacts
  double residual_max = 0, residual_rms = 0;         ///< SolverStatistics

  double kinetic_energy = 0, potential_energy = 0;  ///< potential: 0 at the world's origin
  Eigen::Vector3d linear_momentum = Eigen::Vector3d::Zero(), angular_momentum = Eigen::Vector3d::Zero();
  double speed_max = 0, speed_mean = 0;  ///< of centres of mass
  double spin_max = 0;                   ///< of the fastest point about its body's centre
};

struct SimulatorOptions {
  double dt = 1.0 / 60;
  Eigen::Vector3d gravity = {0, 0, -9.81};
  SolverOptions solver;
  SleepOptions sleep;
  std::uint32_t threads = 1;  ///< at most; oneTBB starts no more than its max_allowed_parallelism
};

/// The state has all that the next steps depend on, beside bodies and options.
struct SimulatorState {
  std::uint64_t step = 0;
  std::vector<BodyState> states;
  std::vector<CachedContact> contacts;
  std::vector<PosedBodies> posed;     ///< of the contact finder
  std::vector<double> quiet;          ///< of Sleep
  std::vector<std::uint32_t> groups;  ///< of Sleep
};

/// Moves rigid bodies, step by step: contacts where the bodies stand, velocities with gravity, contacts
/// solved for, positions by the new velocities (semi-implicit Euler). Bodies that have moved against each
/// other by no more than the slop keep their contacts. With warm start, a step that has no impulse of the
/// step before makes ten times the sweeps. The bytes are the same for any number of threads.
class Simulator {
 public:
  /// continuous: what keeps fast bodies from passing through others; null: nothing does. Condition: as many
  /// states as bodies.
  Simulator(std::vector<BodyProperties> bodies, std::vector<BodyState> states,
            std::unique_ptr<ContactFinder> contacts, const SimulatorOptions& options,
            std::unique_ptr<ContinuousMotion> continuous = nullptr);

  /// Throws what the contact finder throws.
  StepRecord step();

  std::span<const BodyProperties> bodies() const { return bodies_; }
  std::span<const BodyState> states() const { return states_; }
  std::vector<BodyPose> poses() const;

  /// Puts a body somewhere else, awake.
  void place(std::uint32_t body, const BodyState& state);

  SimulatorState save() const;

  /// Goes on where save() was called. Condition: of a simulator of the same bodies and options.
  void restore(SimulatorState state);

 private:
  StepRecord step_in_arena();
  void find_contacts(StepRecord& record);
  void solve(StepRecord& record);
  void sleep();
  void update_acting();
  std::vector<std::uint8_t> idle() const;
  void take_measures(StepRecord& record) const;

  std::vector<BodyProperties> bodies_, acting_;  // acting_: what sleeps is fixed
  std::vector<BodyState> states_;
  std::unique_ptr<ContactFinder> finder_;
  std::unique_ptr<ContinuousMotion> continuous_;
  SimulatorOptions options_;
  tbb::task_arena arena_;
  Islands islands_;
  std::unique_ptr<StepSolver> solver_;
  ContactCache cache_;
  Sleep sleep_;
  std::uint64_t step_ = 0;
};

}  // namespace tandem::simulation
