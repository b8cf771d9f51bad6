#include "dynamics/soft_joints.h"

#include <algorithm>

namespace tandem::dynamics {

void SoftJoints::start(const StepInput& input, std::span<const std::uint32_t> islands,
                       std::span<const BodyState> states, std::span<const std::uint32_t> place,
                       std::span<const SteppedBody> bodies, const SoftNumbers& numbers, double unit_root) {
  input_ = &input;
  numbers_.emplace(numbers);
  unit_root_ = unit_root;
  std::vector<std::uint32_t> order;
  for (const std::uint32_t island : islands) {
    const auto joints = input.islands.joints_of(island);
    order.insert(order.end(), joints.begin(), joints.end());
  }
  std::ranges::stable_sort(order, {}, [&](std::uint32_t joint) { return input.joint_colours[joint]; });
  joints_.clear(), joints_.reserve(order.size());
  const auto place_of = [&](std::uint32_t body) { return numbers.rows.is_moved(body) ? place[body] : 0; };
  const auto body = [&](std::uint32_t i) {
    const std::uint32_t at = place_of(i);
    return SoftJointBody(i, input.bodies.data(), states.data(), at > 0 ? &bodies[at] : nullptr);
  };
  for (const std::uint32_t joint : order) {
    const Joint& of = input.joints[joint];
    Joined& joined =
        joints_.emplace_back(Joined{{}, {body(of.a), body(of.b)}, place_of(of.a), place_of(of.b)});
    begin_joint(*numbers_, unit_root, joint, of, input.joint_memory[joint], joined.bodies, joined.joint);
  }
}

// change(joint, y): changes the velocities of a joint's bodies.
template <typename Change>
void SoftJoints::change(std::span<SoftMotion> velocities, const Change& change) {
  for (Joined& of : joints_) {
    JointMotion y = {of.bodies.a.y_of(velocities[of.a]), of.bodies.b.y_of(velocities[of.b])};
    change(of.joint, y);
    if (of.a > 0) velocities[of.a] = of.bodies.a.added_of(y.a);
    if (of.b > 0) velocities[of.b] = of.bodies.b.added_of(y.b);
  }
}

void SoftJoints::push(std::span<SoftMotion> velocities) {
  change(velocities, [](const SoftJoint& joint, JointMotion& y) { push_joint(joint, y); });
}

void SoftJoints::follow(std::span<const SoftMotion> moved, double time) {
  for (Joined& of : joints_) {
    const auto& [a, b] = of.bodies;
    follow_joint(input_->joints[of.joint.joint], input_->joint_memory[of.joint.joint].position, of.bodies,
                 time, {a.way_of(time, moved[of.a]), b.way_of(time, moved[of.b])}, of.joint);
  }
}

void SoftJoints::add_due(std::span<SoftMotion> velocities) {
  change(velocities, [](const SoftJoint& joint, JointMotion& y) { dynamics::add_due(joint, y); });
}

void SoftJoints::sum_up() {
  for (Joined& of : joints_) dynamics::sum_up(of.joint);
}

void SoftJoints::visit(std::span<SoftMotion> velocities, bool is_soft) {
  const Softness* const soft = is_soft ? &numbers_->softness : nullptr;
  change(velocities, [&](SoftJoint& joint, JointMotion& y) { visit_joint(joint, y, numbers_->h, soft); });
}

void SoftJoints::write(std::span<JointMemory> memory) const {
  for (const Joined& of : joints_) write_joint(*numbers_, unit_root_, of.joint, memory[of.joint.joint]);
}

}  // namespace tandem::dynamics
