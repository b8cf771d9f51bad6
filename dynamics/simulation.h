#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "dynamics/contact_cache.h"
#include "dynamics/contacts_ahead.h"
#include "dynamics/continuous_motion.h"
#include "dynamics/step_solver.h"
#include "dynamics/touches.h"

namespace tandem::dynamics {

/// The record of what a step found and did. The contacts are those of the state before the step; energies,
/// momenta and speeds are those of the state after it, over all dynamic bodies.
struct StepRecord : DetectionTimes {  ///< generation with what the cache takes
  double time = 0;                    ///< at the end of the step
  double solver_seconds = 0, step_seconds = 0;

  std::uint64_t object_pairs = 0, kept_pairs = 0, block_pairs = 0, candidates = 0, triangle_pairs = 0;
  std::uint64_t segments = 0, patches = 0, open_curves = 0, contacts = 0;
  std::uint64_t islands = 0, newton_islands = 0, sleeping = 0, reentered = 0;

  double contact_ratio =
      0;  ///< pairs of triangles that meet, by the triangles of dynamic bodies: the paper's Figure 6
  double contact_area = 0;
  double penetration_max = 0, penetration_mean = 0;  ///< over the contacts
  double residual_max = 0, residual_rms = 0;         ///< SolverStatistics

  double kinetic_energy = 0, potential_energy = 0;  ///< potential: 0 at the world's origin
  Vector3 linear_momentum, angular_momentum;
  double speed_max = 0, speed_mean = 0;  ///< of centres of mass
  double spin_max = 0;                   ///< of the fastest point about its body's centre
};

/// Sets what a record says of the bodies' states.
void measure(std::span<const BodyProperties> bodies, std::span<const BodyState> states,
             const Vector3& gravity, StepRecord& record);

struct SimulationOptions {
  double dt = 1.0 / 60;
  Vector3 gravity = {0, 0, -9.81};
  SolverOptions solver;
  SleepOptions sleep;
  Threads threads = 1;  ///< simulations of copied options share them, and must not make steps at once
};

/// The state has all that the next steps depend on, beside bodies and options.
struct SimulationState {
  std::uint64_t step = 0;
  std::vector<BodyState> states;
  std::vector<CachedContact> contacts;
  std::vector<PosedBodies> posed;      ///< of the contact finder
  AheadState ahead;                    ///< empty: no contacts ahead are looked for
  std::vector<double> quiet;           ///< of Sleep
  std::vector<std::uint32_t> groups;   ///< of Sleep
  std::vector<BodyForce> forces;       ///< empty: there are none
  std::vector<BodySettings> settings;  ///< of each body; empty: those that the bodies have
  std::vector<std::uint8_t> placed;    ///< see Simulation::place(); empty: none was
  std::vector<WorldTouch> touching;    ///< of Touches
  std::vector<Joint> joints;           ///< with what their motors ask for
  std::vector<JointMemory> joint_memory;
};

/// A simulation is made of these, beside its bodies.
struct SimulationParts {
  std::unique_ptr<ContactFinder> contacts;
  std::unique_ptr<ContactsAhead> ahead = nullptr;          ///< null: bodies are stopped when they overlap
  std::unique_ptr<ContinuousMotion> continuous = nullptr;  ///< what keeps fast bodies from passing through
                                                           ///< others; null: nothing does
  std::unique_ptr<StepSolver> solver = nullptr;            ///< null: that of the options
  std::vector<Joint> joints = {};
};

/// Moves rigid bodies, step by step: contacts where the bodies stand, or will in the middle of the step
/// (ContactsAhead), velocities with gravity, contacts
/// solved for, positions by the new velocities (semi-implicit Euler). Bodies that have moved against each
/// other by no more than the slop keep their contacts. With warm start, a step that has no impulse of the
/// step before makes ten times the sweeps. The bytes are the same for any number of threads.
class Simulation {
 public:
  /// Condition: as many states as bodies.
  Simulation(std::vector<BodyProperties> bodies, std::vector<BodyState> states, SimulationParts parts,
             const SimulationOptions& options);

  /// Throws what the contact finder throws.
  StepRecord step();

  std::span<const BodyProperties> bodies() const { return bodies_; }
  std::span<const BodyState> states() const { return states_; }
  std::vector<Instance> poses() const;

  /// Puts a body somewhere else, awake. One that contacts do not move wakes what touches it or is joined to
  /// it, and in the next step what it touches then.
  void place(std::uint32_t body, const BodyState& state);

  /// Sets what acts on a body from the next step on, beside gravity and contacts. Wakes it if that is another
  /// force than before.
  void set_force(std::uint32_t body, const BodyForce& force);

  /// Sets the numbers of a body from the next step on. If they are not what they were, the body wakes, or
  /// where contacts do not move it, what touches it or is joined to it.
  void change(std::uint32_t body, const BodySettings& settings);

  /// Sets how long the next steps are, in seconds.
  void set_step(double dt) { options_.dt = dt; }

  /// Return the contacts of the last step, and what each of them did in it.
  std::span<const ContactPoint> contacts() const { return cache_.contacts(); }
  std::span<const ContactImpulse> impulses() const { return done_; }

  /// The pairs of bodies that touched in the last step.
  const Touches& touches() const { return touches_; }
  std::span<const Joint> joints() const { return joints_; }

  /// Returns what each joint did in the last step, and where it is.
  std::span<const JointMemory> joint_memory() const { return joint_memory_; }

  /// Gives a joint's motor another target and greatest effort, and wakes what it joins.
  void set_motor(std::uint32_t joint, double speed, double most_effort);

  /// Adds a joint in the first place from which one has been removed, else at the end, and wakes what it
  /// joins. If these may not touch, what was remembered of their contacts is forgotten; that no others are
  /// found is up to the filter. Returns the place.
  std::uint32_t add_joint(const Joint& joint);

  /// Removes a joint, and wakes what it joined. Others keep their places.
  void remove_joint(std::uint32_t joint);

  /// Returns the joints that broke in the last step, ascending. Such a joint keeps its place.
  std::span<const std::uint32_t> broken() const { return broken_; }

  bool sleeps(std::uint32_t body) const { return sleep_.sleeps(body); }

  SimulationState save() const;

  /// Goes on where save() was called. Condition: of a simulation of the same bodies and options.
  void restore(SimulationState state);

 private:
  void wake(std::uint32_t body);
  void find_pulls();
  void find_contacts(StepRecord& record);
  void solve(StepRecord& record);
  std::vector<ContactImpulse> solve_contacts();
  bool find_missed(std::span<const BodyState> before);
  void drop_contacts_of_fixed();
  void sleep();
  void wake_beside_placed();
  void update_acting();
  void wake_joined(const Joint& joint);
  void find_joined();
  void forget_contacts(const ObjectPair& pair);
  void follow_joints(double time);
  void break_joints();
  std::vector<std::uint8_t> idle() const;

  std::vector<BodyProperties> bodies_, acting_;  // acting_: what sleeps is fixed
  std::vector<BodyState> states_;
  SimulationParts parts_;
  SimulationOptions options_;
  std::vector<Joint> joints_;
  std::vector<ObjectPair> joined_;  // the bodies of each
  std::vector<JointMemory> joint_memory_;
  std::vector<std::uint32_t> joint_colours_;
  std::vector<std::uint32_t> broken_;  // in the last step
  Islands islands_;
  std::vector<ContactPoint> found_;
  std::vector<ObjectPair> kept_;  // pairs whose contacts are those remembered, in this step
  ContactCache cache_;
  std::vector<ContactImpulse> done_;  // of its contacts, in the last step
  Touches touches_;
  Sleep sleep_;
  std::vector<BodyForce> forces_;     // of each body; empty: none
  std::vector<std::uint8_t> placed_;  // fixed bodies since the last step; empty: none was
  std::vector<Pull> pulls_;
  std::uint64_t step_ = 0;
};

}  // namespace tandem::dynamics
