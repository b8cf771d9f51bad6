#include "dynamics/parallel/parallel_simulation.h"

#include <gtest/gtest.h>

#include <cstring>

#include "dynamics/falling_bodies.h"
#include "dynamics/host_questions.h"
#include "dynamics/world_setup.h"

namespace tandem::test {
namespace {

using namespace dynamics;

bool same_bytes(const BodyState& p, const BodyState& q) {
  return std::memcmp(&p, &q, sizeof p) == 0;
}

// Moves the same bodies by a Simulation and by a parallel simulation on threads of the CPU.
class BothWays {
 public:
  explicit BothWays(const FallingBodies& of, const WorldOptions& options = {}, std::uint32_t threads = 1)
      : threads_(threads),
        executor_(threads_),
        questions_(of.assets.views()),
        parallel(executor_, questions_) {
    WorldSetup setup;
    std::uint64_t where = 0;
    EXPECT_EQ(set_up(of.assets.views(), of.descriptions, options, {}, setup, where), Status::kOk);
    properties = setup.properties;
    setup.options.solver.kind = SolverKind::soft;
    const std::vector<double> inner = inner_radii(of.assets.views());
    std::vector<AssetBox> boxes;
    for (const AssetView& view : of.assets.views())
      boxes.push_back(asset_box(view.header->lower, view.header->upper, view.header->origin));
    EXPECT_EQ(parallel.set_bodies({setup.properties, setup.states, inner, boxes},
                                  {setup.options.gravity, setup.options.solver, setup.options.sleep}),
              Status::kOk);
    SimulationParts parts;
    parts.contacts = make_scene_contacts(of.assets.views(), 1);
    parts.ahead = std::make_unique<ContactsAhead>(of.assets.views(), 1);
    simulation = std::make_unique<Simulation>(std::move(setup.properties), std::move(setup.states),
                                              std::move(parts), setup.options);
  }

  // Makes a step both ways, and compares. Result: whether all is the same.
  void step(int number) {
    simulation->step();
    ASSERT_EQ(parallel.step(1.0 / 60), Status::kOk) << number;
    for (std::uint32_t i = 0; i < parallel.bodies(); ++i) {
      ASSERT_TRUE(same_bytes(states()[i], simulation->states()[i])) << "step " << number << " body " << i;
      ASSERT_EQ(parallel.arrays().group[i] != Sleep::kAwake, simulation->sleeps(i)) << number << " " << i;
    }
    const StepCounts& counts = parallel.counts();
    middle += counts.middle, ahead += counts.approaches, missed += counts.missed;
    touching += counts.touching;
  }

  std::span<const BodyState> states() const { return {parallel.arrays().start, parallel.bodies()}; }

 private:
  Threads threads_;
  HostExecutor executor_;
  HostQuestions questions_;

 public:
  std::vector<BodyProperties> properties;
  std::unique_ptr<Simulation> simulation;
  ParallelSimulation<HostExecutor, HostQuestions> parallel;
  std::uint32_t middle = 0, ahead = 0, missed = 0, touching = 0;
};

TEST(ParallelStep, IsTheStepOfASimulation) {
  const FallingBodies bodies(24);
  BothWays both(bodies, {.sleeping = false});
  for (int step = 0; step < 240 && !HasFatalFailure(); ++step) both.step(step);
  EXPECT_GT(both.middle, 100u);
  EXPECT_GT(both.ahead, 100u);
  EXPECT_GT(both.touching, 1000u);
}

TEST(ParallelStep, SleepsAndWakesAsASimulationDoes) {
  const FallingBodies bodies(12, 5);
  BothWays both(bodies, {}, 3);
  std::uint32_t slept = 0;
  for (int step = 0; step < 500 && !HasFatalFailure(); ++step) {
    both.step(step);
    for (std::uint32_t i = 0; i < both.parallel.bodies(); ++i) slept += both.simulation->sleeps(i) ? 1 : 0;
  }
  EXPECT_GT(slept, 100u);
}

// Boxes that stand side by side, a hair apart, and the first is pushed: of what the others do in the step
// nobody knows when it begins.
TEST(ParallelStep, FindsWhatAStepMissed) {
  FallingBodies row(1);
  for (int i = 0; i < 6; ++i) {
    BodyDescription& body = row.descriptions.emplace_back();
    body.asset = 3, body.pose = shift(0.402 * i - 1 - (i == 0 ? 0.05 : 0), 0, 0.1);
    if (i == 0) body.velocity[0] = 4;
  }
  BothWays both(row);
  for (int step = 0; step < 60 && !HasFatalFailure(); ++step) both.step(step);
  EXPECT_GT(both.missed, 0u);
}

// Like a run file, which has neither distances nor where bodies were a step before.
TEST(ParallelStep, GoesOnFromWhatASimulationKept) {
  const FallingBodies bodies(24);
  BothWays one(bodies);
  for (int step = 0; step < 100; ++step) one.step(step);
  SimulationState state, end;
  ASSERT_EQ(one.parallel.save(one.properties, state), Status::kOk);
  EXPECT_GT(state.contacts.size(), 20u);
  EXPECT_GT(state.posed.size(), 2u);
  state.ahead = {};
  BothWays other(bodies);
  ASSERT_EQ(other.parallel.resume(other.properties, state), Status::kOk);
  for (int step = 100; step < 160; ++step) {
    one.step(step);
    ASSERT_EQ(other.parallel.step(1.0 / 60), Status::kOk);
    for (std::uint32_t i = 0; i < one.parallel.bodies(); ++i)
      ASSERT_TRUE(same_bytes(one.states()[i], other.states()[i])) << "step " << step << " body " << i;
  }
}

TEST(ParallelStep, AddsUpItsContacts) {
  const FallingBodies bodies(24);
  BothWays both(bodies);
  for (int step = 0; step < 120; ++step) both.step(step);
  ContactSums sums;
  ASSERT_EQ(both.parallel.sum_contacts(sums), Status::kOk);
  double deepest = 0, sum = 0;
  for (const ContactPoint& contact : both.simulation->contacts())
    deepest = std::max(deepest, contact.depth), sum += std::max(contact.depth, 0.0);
  const auto count = both.simulation->contacts().size();
  ASSERT_GT(count, 20u);
  ASSERT_GT(sum, 0);
  EXPECT_EQ(sums.contacts, count);
  EXPECT_EQ(sums.deepest, deepest);
  const double slop = both.parallel.arrays().options.slop, mean = sum / static_cast<double>(count);
  EXPECT_NEAR(sums.mean_depth(slop), mean, 1e-5 * slop);
}

TEST(ParallelStep, IsMadeAgainWhereRoomIsShort) {
  FallingBodies many(1);
  for (int i = 0; i < 700; ++i) {
    BodyDescription& body = many.descriptions.emplace_back();
    body.asset = 3;
    body.pose = shift(0.3 * (i % 9) - 1.2, 0.3 * (i / 9 % 9) - 1.2, 0.3 + 0.19 * (i / 81));
    body.pose.translation[2] += 0.001 * (i % 7);
  }
  BothWays both(many, {}, 2);
  for (int step = 0; step < 3 && !HasFatalFailure(); ++step) both.step(step);
  EXPECT_GT(both.parallel.counts().pairs, 8 * 700u);
}

}  // namespace
}  // namespace tandem::test
