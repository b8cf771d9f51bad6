#include "dynamics/soft_joints.h"

#include <algorithm>

#include "dynamics/island_joints.h"

namespace tandem::dynamics {
namespace {

Vector6 of_masses(const MassScale& scale, const SoftMotion& motion) {
  return {scale.root_mass * first_three(motion.centre), first_three(motion.spin)};
}

}  // namespace

void SoftJoints::start(const StepInput& input, std::span<const std::uint32_t> islands,
                       std::span<const BodyState> states, std::span<const std::uint32_t> place,
                       std::span<const SteppedBody> bodies, double substeps, double unit) {
  input_ = &input;
  scale_ = 1 / (substeps * unit), unit_ = unit;
  problem_ = {}, place_.assign(1, 0), at_start_.clear();
  problem_.states = states;
  for (const std::uint32_t island : islands) {
    const auto joints = input.islands.joints_of(island);
    problem_.joints.insert(problem_.joints.end(), joints.begin(), joints.end());
  }
  const auto is_moved = [&](std::uint32_t body) {
    return body != kNoIndex && input.bodies[body].motion == Motion::moving;
  };
  for (const std::uint32_t joint : problem_.joints) {
    for (const std::uint32_t body : {input.joints[joint].a, input.joints[joint].b}) {
      if (is_moved(body)) place_.push_back(place[body]);
    }
  }
  std::ranges::sort(place_);
  place_.erase(std::unique(place_.begin(), place_.end()), place_.end());
  stepped_.clear();
  for (const std::uint32_t i : place_) {
    stepped_.push_back(bodies[i]);
    at_start_.push_back(bodies[i].velocity);
  }
  velocity_ = at_start_;
  displacement_.assign(place_.size(), Vector6{}), due_.assign(place_.size(), Vector6{});
  problem_.stepped = stepped_, problem_.velocity = velocity_, problem_.displacement = displacement_;
  const auto own_place = [&](std::uint32_t body) {
    if (!is_moved(body)) return 0u;
    return static_cast<std::uint32_t>(std::ranges::lower_bound(place_, place[body]) - place_.begin());
  };
  for (const std::uint32_t joint : problem_.joints)
    add_joint_rows(problem_, input, joint, own_place(input.joints[joint].a),
                   own_place(input.joints[joint].b));
  for (JointRow& row : problem_.joint_rows) {
    for (double* of_step : {&row.impulse, &row.least_push, &row.most_push}) *of_step *= scale_;
  }
  blocks_ = joint_blocks(problem_.joint_rows);
  sum_.assign(problem_.joint_rows.size(), 0);
}

void SoftJoints::push(std::span<SoftMotion> velocities) {
  read(velocities);
  add_impulses(1, problem_.velocity);
  write(velocities);
}

void SoftJoints::follow(std::span<const SoftMotion> moved, double time) {
  for (std::size_t i = 1; i < place_.size(); ++i)
    problem_.displacement[i] = time * at_start_[i] + of_masses(problem_.stepped[i].scale, moved[place_[i]]);
  due_.assign(place_.size(), Vector6{});
  add_impulses(-1, due_);
  follow_joints(problem_, *input_, problem_.displacement, time, problem_.joint_rows);
  for (JointBlock& block : blocks_) factorise(block, problem_.joint_rows);
  add_impulses(1, due_);
}

void SoftJoints::add_due(std::span<SoftMotion> velocities) {
  read(velocities);
  for (std::size_t i = 1; i < place_.size(); ++i) problem_.velocity[i] += due_[i];
  write(velocities);
}

void SoftJoints::visit(std::span<SoftMotion> velocities, double h, const Softness* soft) {
  read(velocities);
  for (const JointBlock& block : blocks_) visit_joint(block, problem_.joint_rows, problem_.velocity, h, soft);
  write(velocities);
}

void SoftJoints::sum_up() {
  for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] += problem_.joint_rows[i].impulse;
}

void SoftJoints::write(std::span<JointMemory> memory) const {
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    const JointRow& row = problem_.joint_rows[i];
    memory[row.joint].impulse[row.slot] = row.impulse / scale_;
    memory[row.joint].done[row.slot] = unit_ * sum_[i];
  }
}

void SoftJoints::read(std::span<const SoftMotion> velocities) {
  for (std::size_t i = 1; i < place_.size(); ++i)
    problem_.velocity[i] = at_start_[i] + of_masses(problem_.stepped[i].scale, velocities[place_[i]]);
}

void SoftJoints::write(std::span<SoftMotion> velocities) const {
  for (std::size_t i = 1; i < place_.size(); ++i) {
    const Vector6 added = problem_.velocity[i] - at_start_[i];
    put(added.linear / problem_.stepped[i].scale.root_mass, velocities[place_[i]].centre);
    put(added.angular, velocities[place_[i]].spin);
  }
}

void SoftJoints::add_impulses(double sign, std::span<Vector6> to) const {
  for (const JointRow& row : problem_.joint_rows) {
    to[row.a] += sign * row.impulse * row.gradient.a;
    to[row.b] += sign * row.impulse * row.gradient.b;
  }
}

}  // namespace tandem::dynamics
