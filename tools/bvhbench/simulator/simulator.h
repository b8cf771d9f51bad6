#pragma once
#include <tbb/task_arena.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "contact_cache.h"
#include "contact_finder.h"
#include "continuous_motion.h"
#include "sleep.h"
#include "step_record.h"
#include "step_solver.h"

namespace tandem::simulation {

struct SimulatorOptions {
  double dt = 1.0 / 60;
  Eigen::Vector3d gravity = {0, 0, -9.81};
  SolverOptions solver;
  SleepOptions sleep;
  std::uint32_t threads = 1;  ///< at most; oneTBB starts no more than its max_allowed_parallelism
};

/// All that the next steps depend on, beside bodies and options.
struct SimulatorState {
  std::uint64_t step = 0;
  std::vector<BodyState> states;
  std::vector<CachedContact> contacts;
  std::vector<double> quiet;          ///< of Sleep
  std::vector<std::uint32_t> groups;  ///< of Sleep
};

/// Moves rigid bodies, step by step: contacts where the bodies stand, velocities with gravity, contacts
/// solved for, positions by the new velocities (semi-implicit Euler). Bodies that have moved against each
/// other by no more than the slop keep their contacts. With warm start, a step that has no impulse of the
/// step before makes ten times the sweeps. The same bytes for any number of threads.
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
