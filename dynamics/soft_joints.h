#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/joint_visit.h"
#include "dynamics/soft_rules.h"

namespace tandem::dynamics {

/// The joints of a soft step. One thread visits them, in float64, between the sweeps over contacts.
class SoftJoints {
 public:
  /// Takes the joints of islands, at the start of a step. place: of each body of the step in `bodies` and in
  /// all lists of motions below. unit: of masses.
  void start(const StepInput& input, std::span<const std::uint32_t> islands,
             std::span<const BodyState> states, std::span<const std::uint32_t> place,
             std::span<const SteppedBody> bodies, double substeps, double unit);

  bool empty() const { return blocks_.empty(); }

  /// Adds the impulses that the joints start with to the velocities.
  void push(std::span<SoftMotion> velocities);

  /// Makes the rows those of bodies that have moved for a time. Impulses stay along the rows that they were
  /// found for; what they would add along the new ones is due to the next substep, which add_due() gives.
  void follow(std::span<const SoftMotion> moved, double time);
  void add_due(std::span<SoftMotion> velocities);

  /// Counts the impulses as those of a substep.
  void sum_up();

  /// Visits all joints once. soft: see visit_joint().
  void visit(std::span<SoftMotion> velocities, double h, const Softness* soft);

  /// Hands out the impulses of the step.
  void write(std::span<JointMemory> memory) const;

 private:
  void read(std::span<const SoftMotion> velocities);
  void write(std::span<SoftMotion> velocities) const;
  void add_impulses(double sign, std::span<Vector6> to) const;

  const StepInput* input_ = nullptr;
  IslandProblem problem_;             // of bodies that have joints, and without contacts
  std::vector<SteppedBody> stepped_;  // its arrays
  std::vector<Vector6> velocity_, displacement_;
  std::vector<std::uint32_t> place_;     // of each of its bodies
  std::vector<Vector6> at_start_, due_;  // velocities, and what is to be added to them
  std::vector<JointBlock> blocks_;
  std::vector<double> sum_;  // of each row's impulses in the substeps
  double scale_ = 1;         // of an impulse of the step to one of a substep
  double unit_ = 1;          // of masses
};

}  // namespace tandem::dynamics
