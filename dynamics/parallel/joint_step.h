#pragma once
#include <cstdint>

#include "dynamics/parallel/atomics.h"
#include "dynamics/parallel/joint_sweeps.h"

/// What a parallel step does with joints before and after its sweeps.
namespace tandem::dynamics {

/// Lets the bodies that joints hold count for the unit of masses.
TANDEM_HD inline void weigh_joined(const JointArrays& joints, const BodyProperties* bodies, std::uint32_t i,
                                   double& most_mass) {
  if (bodies[i].motion == Motion::moving && joints.hold(i)) atomic_most(most_mass, bodies[i].mass);
}

/// Begins the step with the joint of a place. Bodies are those of the step.
TANDEM_HD inline void begin_placed(const JointSweeps& of, double unit_root, std::uint32_t place) {
  const std::uint32_t i = of.joints.places[place].joint;
  SoftJoint& soft = of.joints.soft[place];
  soft.count = 0;
  if (i == kNoIndex) return;
  const Joint& joint = of.joints.joints[i];
  const SoftJointBodies bodies = {of.body(joint.a), of.body(joint.b)};
  if (bodies.a.moves || bodies.b.moves)
    begin_joint(of.numbers, unit_root, i, joint, of.joints.memory[i], bodies, soft);
}

/// Ends the step of a joint, but for what its place did. states: at the end of the step.
TANDEM_HD inline void end_joint(const JointArrays& joints, const BodyState* states, double dt,
                                std::uint32_t i) {
  const Joint& joint = joints.joints[i];
  JointMemory memory = joints.memory[i];
  memory.done = memory.impulse;
  if (!joint.holds) memory.impulse = memory.done = {};
  follow(joint, state_of(joint.a, states), state_of(joint.b, states), dt, memory);
  joints.memory_end[i] = memory, joints.broke[i] = 0;
}

/// Takes what the joint of a place did. Condition: end_joint() of all.
TANDEM_HD inline void end_placed(const JointSweeps& of, double unit_root, const BodyState* states,
                                 std::uint32_t place) {
  const SoftJoint& soft = of.joints.soft[place];
  if (soft.count == 0) return;
  const Joint& joint = of.joints.joints[soft.joint];
  JointMemory& memory = of.joints.memory_end[soft.joint];
  write_joint(of.numbers, unit_root, soft, memory);
  if (!breaks(joint, memory, state_of(joint.a, states), state_of(joint.b, states), of.numbers.dt)) return;
  of.joints.broke[soft.joint] = 1;
  atomic_add(*of.joints.broken, 1);
}

/// The next step begins with what a joint is at the end of this one.
TANDEM_HD inline void go_on(const JointArrays& joints, std::uint32_t i) {
  joints.memory[i] = joints.memory_end[i];
  if (joints.broke[i] != 0) joints.joints[i].holds = false;
}

}  // namespace tandem::dynamics
