#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dynamics/soft_joint.h"

namespace tandem::dynamics {

/// The joints of a soft step. One thread visits them between the sweeps over contacts, colour by colour.
class SoftJoints {
 public:
  /// Takes the joints of islands, at the start of a step. place: of each body of the step in `bodies` and in
  /// all lists of motions below.
  void start(const StepInput& input, std::span<const std::uint32_t> islands,
             std::span<const BodyState> states, std::span<const std::uint32_t> place,
             std::span<const SteppedBody> bodies, const SoftNumbers& numbers, double unit_root);

  bool empty() const { return joints_.empty(); }

  /// Adds the impulses that the joints start with to the velocities.
  void push(std::span<SoftMotion> velocities);

  /// Makes the rows those of bodies that have moved for a time. What is due then, add_due() gives.
  void follow(std::span<const SoftMotion> moved, double time);
  void add_due(std::span<SoftMotion> velocities);

  /// Counts the impulses as those of a substep.
  void sum_up();

  /// Visits all joints once. is_soft: what is out of place comes back.
  void visit(std::span<SoftMotion> velocities, bool is_soft);

  /// Hands out the impulses of the step.
  void write(std::span<JointMemory> memory) const;

 private:
  struct Joined {
    SoftJoint joint;
    SoftJointBodies bodies;
    std::uint32_t a, b;  // places
  };
  template <typename Change>
  void change(std::span<SoftMotion> velocities, const Change& change);

  const StepInput* input_ = nullptr;
  std::optional<SoftJointNumbers> numbers_;
  double unit_root_ = 1;
  std::vector<Joined> joints_;
};

}  // namespace tandem::dynamics
