#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "dynamics/host_questions.h"
#include "dynamics/lists_of_steps.h"
#include "dynamics/parallel/parallel_simulation.h"
#include "dynamics/scene_contacts.h"
#include "dynamics/simulation.h"
#include "dynamics/world_setup.h"

namespace tandem::test {

template <typename T>
bool same_bytes(const T& p, const T& q) {
  return std::memcmp(&p, &q, sizeof p) == 0;
}

template <typename Row>
bool same_rows(std::span<const Row> p, std::span<const Row> q) {
  return p.size() == q.size() && (p.empty() || std::memcmp(p.data(), q.data(), p.size_bytes()) == 0);
}

/// Moves the same bodies by a Simulation and by a parallel simulation on threads of the CPU.
class BothWays {
 public:
  /// of: has assets and descriptions of bodies.
  template <typename Bodies>
  explicit BothWays(const Bodies& of, const WorldOptions& options = {}, std::uint32_t threads = 1,
                    std::span<const JointDescription> joints = {},
                    dynamics::SolverKind kind = dynamics::SolverKind::soft)
      : threads_(threads),
        executor_(threads_),
        questions_(of.assets.views(), &filter_),
        parallel(executor_, questions_) {
    dynamics::WorldSetup setup;
    std::uint64_t where = 0;
    EXPECT_EQ(set_up(of.assets.views(), of.descriptions, options, joints, setup, where), Status::kOk);
    setup.options.solver.kind = kind;
    keep_apart(setup.joints);
    const std::vector<double> inner = dynamics::inner_radii(of.assets.views());
    std::vector<AssetBox> boxes;
    for (const AssetView& view : of.assets.views())
      boxes.push_back(asset_box(view.header->lower, view.header->upper, view.header->origin));
    if (options.continuous)
      continuous_ = std::make_unique<dynamics::ContinuousMotion>(of.assets.views(), 1, &filter_);
    EXPECT_EQ(parallel.set_bodies(
                  {setup.properties, setup.states, inner, boxes, setup.joints},
                  {setup.options.gravity, setup.options.solver, setup.options.sleep, continuous_.get()}),
              Status::kOk);
    dynamics::SimulationParts parts;
    parts.contacts = dynamics::make_scene_contacts(of.assets.views(), 1, &filter_);
    parts.ahead = std::make_unique<dynamics::ContactsAhead>(of.assets.views(), 1, &filter_);
    if (options.continuous)
      parts.continuous = std::make_unique<dynamics::ContinuousMotion>(of.assets.views(), 1, &filter_);
    parts.joints = std::move(setup.joints);
    simulation = std::make_unique<dynamics::Simulation>(std::move(setup.properties), std::move(setup.states),
                                                        std::move(parts), setup.options);
  }

  /// Makes so many steps of a call. begin(step): before each.
  template <typename Begin>
  void steps(int count, const Begin& begin) {
    for (int step = 0; step < count && !testing::Test::HasFatalFailure(); ++step)
      begin(step), this->step(step);
  }

  /// A call of World::step() begins.
  void begin_call() {
    parallel.forget_call();
    began.clear(), ended.clear();
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
    const dynamics::Touches& touches = simulation->touches();
    dynamics::add_touches(touches.began(), touches.touching(), began);
    dynamics::add_pairs(touches.ended(), ended);
    compare_touches(number);
    if (!simulation->broken().empty()) keep_apart(simulation->joints());
    const dynamics::StepCounts& counts = parallel.counts();
    middle += counts.middle, ahead += counts.approaches, missed += counts.missed;
    touching += counts.touching, fast += counts.has_fast;
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
    EXPECT_EQ(parallel.place(body, state), Status::kOk);
  }
  void change(std::uint32_t body, const dynamics::BodySettings& settings) {
    simulation->change(body, settings);
    EXPECT_EQ(parallel.change(body, settings), Status::kOk);
  }
  void set_force(std::uint32_t body, const dynamics::BodyForce& force) {
    simulation->set_force(body, force);
    EXPECT_EQ(parallel.set_force(body, force), Status::kOk);
  }

  void compare_touches(int number) {
    std::vector<WorldTouch> rows;
    std::vector<ObjectPair> pairs;
    ASSERT_EQ(parallel.touching(rows), Status::kOk);
    ASSERT_TRUE(same_rows<WorldTouch>(rows, simulation->touches().touching())) << number;
    ASSERT_EQ(parallel.began(rows), Status::kOk);
    ASSERT_TRUE(same_rows<WorldTouch>(rows, began)) << number << " " << rows.size() << " " << began.size();
    ASSERT_EQ(parallel.ended(pairs), Status::kOk);
    ASSERT_TRUE(same_rows<ObjectPair>(pairs, ended)) << number << " " << pairs.size() << " " << ended.size();
  }

  /// Keeps both states, and goes back to them.
  struct State {
    dynamics::SimulationState simulation;
    dynamics::ParallelState<dynamics::HostExecutor> parallel;
  };
  void save(State& state) {
    state.simulation = simulation->save();
    EXPECT_EQ(parallel.save(state.parallel), Status::kOk);
  }
  void restore(const State& state) {
    simulation->restore(state.simulation);
    EXPECT_EQ(parallel.restore(state.parallel), Status::kOk);
    keep_apart(simulation->joints());
    began.clear(), ended.clear();
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
      ASSERT_TRUE(same_bytes(memory[i], simulation->joint_memory()[i]))
          << "step " << number << " joint " << i;
      ASSERT_EQ(parallel.joints()[i].holds, simulation->joints()[i].holds) << number << " " << i;
      ASSERT_EQ(parallel.arrays().joints.joints[i].holds, simulation->joints()[i].holds)
          << number << " " << i;
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
  std::unique_ptr<dynamics::ContinuousMotion> continuous_;

 public:
  std::unique_ptr<dynamics::Simulation> simulation;
  dynamics::ParallelSimulation<dynamics::HostExecutor, dynamics::HostQuestions> parallel;
  std::uint32_t middle = 0, ahead = 0, missed = 0, touching = 0, fast = 0;
  std::vector<WorldTouch> began;  // in the call
  std::vector<ObjectPair> ended;
};

}  // namespace tandem::test
