#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "dynamics/host_questions.h"
#include "dynamics/parallel/parallel_simulation.h"
#include "dynamics/scene_contacts.h"
#include "dynamics/simulation.h"
#include "dynamics/world_setup.h"

namespace tandem::test {

template <typename T>
bool same_bytes(const T& p, const T& q) {
  return std::memcmp(&p, &q, sizeof p) == 0;
}

/// Moves the same bodies by a Simulation and by a parallel simulation on threads of the CPU.
class BothWays {
 public:
  /// of: has assets and descriptions of bodies.
  template <typename Bodies>
  explicit BothWays(const Bodies& of, const WorldOptions& options = {}, std::uint32_t threads = 1,
                    std::span<const JointDescription> joints = {})
      : threads_(threads),
        executor_(threads_),
        questions_(of.assets.views(), &filter_),
        parallel(executor_, questions_) {
    dynamics::WorldSetup setup;
    std::uint64_t where = 0;
    EXPECT_EQ(set_up(of.assets.views(), of.descriptions, options, joints, setup, where), Status::kOk);
    setup.options.solver.kind = dynamics::SolverKind::soft;
    keep_apart(setup.joints);
    const std::vector<double> inner = dynamics::inner_radii(of.assets.views());
    std::vector<AssetBox> boxes;
    for (const AssetView& view : of.assets.views())
      boxes.push_back(asset_box(view.header->lower, view.header->upper, view.header->origin));
    EXPECT_EQ(parallel.set_bodies({setup.properties, setup.states, inner, boxes, setup.joints},
                                  {setup.options.gravity, setup.options.solver, setup.options.sleep}),
              Status::kOk);
    dynamics::SimulationParts parts;
    parts.contacts = dynamics::make_scene_contacts(of.assets.views(), 1, &filter_);
    parts.ahead = std::make_unique<dynamics::ContactsAhead>(of.assets.views(), 1, &filter_);
    parts.joints = std::move(setup.joints);
    simulation = std::make_unique<dynamics::Simulation>(std::move(setup.properties), std::move(setup.states),
                                                        std::move(parts), setup.options);
  }

  /// Makes a step both ways, and compares all that bodies and joints are.
  void step(int number) {
    simulation->step();
    ASSERT_EQ(parallel.step(1.0 / 60), Status::kOk) << number;
    for (std::uint32_t i = 0; i < parallel.bodies(); ++i) {
      ASSERT_TRUE(same_bytes(states()[i], simulation->states()[i])) << "step " << number << " body " << i;
      ASSERT_EQ(parallel.arrays().group[i] != dynamics::Sleep::kAwake, simulation->sleeps(i))
          << number << " " << i;
    }
    compare_joints(number);
    if (!simulation->broken().empty()) keep_apart(simulation->joints());
    const dynamics::StepCounts& counts = parallel.counts();
    middle += counts.middle, ahead += counts.approaches, missed += counts.missed;
    touching += counts.touching;
  }

  std::uint32_t add_joint(const JointDescription& description) {
    const dynamics::Joint joint = make_joint(description, simulation->states());
    const std::uint32_t place = simulation->add_joint(joint);
    std::uint32_t other = kNoIndex;
    EXPECT_EQ(parallel.add_joint(joint, simulation->bodies(), states(), other), Status::kOk);
    EXPECT_EQ(other, place);
    keep_apart(simulation->joints());
    return place;
  }
  void remove_joint(std::uint32_t joint) {
    simulation->remove_joint(joint);
    EXPECT_EQ(parallel.remove_joint(joint), Status::kOk);
    keep_apart(simulation->joints());
  }
  void set_motor(std::uint32_t joint, double speed, double most_effort) {
    simulation->set_motor(joint, speed, most_effort);
    EXPECT_EQ(parallel.set_motor(joint, speed, most_effort), Status::kOk);
  }
  void place(std::uint32_t body, const dynamics::BodyState& state) {
    simulation->place(body, state);
    parallel.arrays().start[body] = state;
    wake_body(executor_, parallel.arrays(), body);
  }

  std::span<const dynamics::BodyState> states() const { return {parallel.arrays().start, parallel.bodies()}; }
  std::uint32_t sleeping() const {
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < parallel.bodies(); ++i) count += simulation->sleeps(i) ? 1 : 0;
    return count;
  }

 private:
  void compare_joints(int number) {
    std::vector<dynamics::JointMemory> memory;
    ASSERT_EQ(parallel.joint_memory(memory), Status::kOk);
    ASSERT_EQ(memory.size(), simulation->joints().size());
    for (std::size_t i = 0; i < memory.size(); ++i) {
      ASSERT_TRUE(same_bytes(memory[i], simulation->joint_memory()[i])) << "step " << number << " joint " << i;
      ASSERT_EQ(parallel.joints()[i].holds, simulation->joints()[i].holds) << number << " " << i;
      ASSERT_EQ(parallel.arrays().joints.joints[i].holds, simulation->joints()[i].holds) << number << " " << i;
    }
    ASSERT_TRUE(std::ranges::equal(parallel.broken(), simulation->broken())) << number;
  }

  // Joined bodies do not meet, unless they may.
  void keep_apart(std::span<const dynamics::Joint> joints) {
    EXPECT_EQ(exclude_joined({}, joints, apart_), Status::kOk);
    filter_.excluded = apart_.view();
  }

  ExcludedPairTable apart_;
  PairFilter filter_;
  dynamics::Threads threads_;
  dynamics::HostExecutor executor_;
  dynamics::HostQuestions questions_;

 public:
  std::unique_ptr<dynamics::Simulation> simulation;
  dynamics::ParallelSimulation<dynamics::HostExecutor, dynamics::HostQuestions> parallel;
  std::uint32_t middle = 0, ahead = 0, missed = 0, touching = 0;
};

}  // namespace tandem::test
