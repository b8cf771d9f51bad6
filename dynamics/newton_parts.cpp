#include "dynamics/newton_parts.h"

#include <algorithm>
#include <memory>
#include <numeric>
#include <vector>

#include "dynamics/joint_rules.h"
#include "dynamics/part_contacts.h"

namespace tandem::dynamics {
namespace {

// An island by itself: its contacts are numbered anew, bodies and joints keep their numbers.
class Parts {
 public:
  Parts(const StepInput& input, std::size_t island, std::uint32_t parts, std::span<const BodyState> states,
        std::span<const ContactImpulse> impulses)
      : input_(input), count_(parts), states_(states.size()) {
    const auto bodies = input.islands.bodies_of(island), joints = input.islands.joints_of(island),
               contacts = input.islands.contacts_of(island);
    one_.bodies.assign(bodies.begin(), bodies.end());
    one_.joints.assign(joints.begin(), joints.end());
    one_.contacts.resize(contacts.size());
    std::iota(one_.contacts.begin(), one_.contacts.end(), 0);
    one_.body_begin = {0, static_cast<std::uint32_t>(bodies.size())};
    one_.joint_begin = {0, static_cast<std::uint32_t>(joints.size())};
    one_.contact_begin = {0, static_cast<std::uint32_t>(contacts.size())};
    // Only these are read: others may be written meanwhile.
    for (const std::uint32_t body : bodies) states_[body] = states[body];
    const auto take = [&](std::uint32_t body) {
      if (body == kNoIndex || input.bodies[body].motion == Motion::moving) return;
      states_[body] = states[body];
      if (input.bodies[body].motion == Motion::kinematic) driven_.push_back(body);
    };
    for (const std::uint32_t i : contacts) take(input.contacts[i].body_a), take(input.contacts[i].body_b);
    for (const std::uint32_t joint : joints) take(input.joints[joint].a), take(input.joints[joint].b);
    std::sort(driven_.begin(), driven_.end());
    driven_.erase(std::unique(driven_.begin(), driven_.end()), driven_.end());
    Carver counting(nullptr);
    contacts_.carve(counting, contacts.size());
    memory_ = std::make_unique_for_overwrite<std::byte[]>(counting.bytes());
    Carver carver(memory_.get());
    contacts_.carve(carver, contacts.size());
    for (std::uint32_t i = 0; i < contacts.size(); ++i)
      contacts_.begin(i, input.contacts[contacts[i]], impulses[contacts[i]], parts, states_);
  }

  // Makes a part.
  std::optional<Residual> step(const SolverOptions& options, std::span<const std::uint32_t> layers,
                               std::span<std::uint32_t> place, std::span<const std::uint32_t> order,
                               JointRule rule, bool* turned_far) {
    const double dt = input_.dt / count_;
    StepInput part = {{input_.bodies, contacts_.contacts, dt, input_.pulls},
                      one_,
                      input_.number,
                      input_.is_cold,
                      input_.threads};
    part.joints = input_.joints, part.joint_memory = input_.joint_memory;
    IslandProblem problem =
        make_island_problem(part, 0, {states_, contacts_.impulses}, options, layers, place, order);
    const std::optional<Residual> residual = solve_newton_step(problem, part, options, rule, turned_far);
    if (!residual) return {};
    apply_solution(problem, part, states_, contacts_.impulses);
    for (const std::uint32_t body : driven_) advance(input_.bodies[body], states_[body], {}, {}, dt);
    for (std::uint32_t i = 0; i < contacts_.contacts.size(); ++i) contacts_.end_part(i, states_);
    for (const std::uint32_t i : one_.joints) {
      const Joint& joint = input_.joints[i];
      follow(joint, state_of(joint.a, states_), state_of(joint.b, states_), dt, input_.joint_memory[i]);
    }
    return residual;
  }

  std::span<const BodyState> states() const { return states_; }

  // Returns what the contacts did in all parts so far.
  std::span<const ContactImpulse> sums() const { return contacts_.sums; }

 private:
  const StepInput& input_;
  std::uint32_t count_;
  Islands one_;
  std::vector<BodyState> states_;
  std::vector<std::uint32_t> driven_;  // kinematic bodies that the island meets
  std::unique_ptr<std::byte[]> memory_;
  PartContacts contacts_;
};

}  // namespace

std::optional<Residual> solve_newton_parts(const StepInput& input, std::size_t island, std::uint32_t parts,
                                           const SolverOptions& options,
                                           std::span<const std::uint32_t> layers,
                                           std::span<std::uint32_t> place,
                                           std::span<const std::uint32_t> order, JointRule rule,
                                           std::span<BodyState> states, std::span<ContactImpulse> impulses,
                                           bool* turned_far) {
  Parts island_parts(input, island, parts, states, impulses);
  const auto contacts = input.islands.contacts_of(island), joints = input.islands.joints_of(island);
  std::vector<JointMemory> before;
  for (const std::uint32_t i : joints) {
    before.push_back(input.joint_memory[i]);
    for (double& impulse : input.joint_memory[i].impulse) impulse /= parts;
  }
  std::vector<std::array<double, kMostJointRows>> joint_sum(joints.size());
  std::optional<Residual> residual;
  for (std::uint32_t part = 0; part < parts; ++part) {
    residual = island_parts.step(options, layers, place, order, rule, turned_far);
    if (!residual) break;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      for (std::size_t k = 0; k < kMostJointRows; ++k)
        joint_sum[i][k] += input.joint_memory[joints[i]].impulse[k];
    }
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    input.joint_memory[joints[i]] = before[i];
    if (residual) input.joint_memory[joints[i]].impulse = joint_sum[i];
  }
  if (!residual) return {};
  for (const std::uint32_t body : input.islands.bodies_of(island)) states[body] = island_parts.states()[body];
  for (std::size_t i = 0; i < contacts.size(); ++i) impulses[contacts[i]] = island_parts.sums()[i];
  return residual;
}

}  // namespace tandem::dynamics
