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
  explicit BothWays(const FallingBodies& of, const WorldOptions& options = {}, std::uint32_t threads = 1,
                    SolverKind kind = SolverKind::soft)
      : threads_(threads),
        executor_(threads_),
        questions_(of.assets.views()),
        parallel(executor_, questions_) {
    WorldSetup setup;
    std::uint64_t where = 0;
    EXPECT_EQ(set_up(of.assets.views(), of.descriptions, options, {}, setup, where), Status::kOk);
    setup.options.solver.kind = kind;
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

// Boxes on each other, askew, in a tower.
void add_tower(FallingBodies& to, double x, double y, int count) {
  for (int i = 0; i < count; ++i) {
    BodyDescription& body = to.descriptions.emplace_back();
    body.asset = 3, body.pose = shift(x + 1e-3 * (i % 3), y, 0.1 + 0.20001 * i);
  }
}

TEST(ParallelStep, SolvesATowerByNewtonsMethod) {
  FallingBodies tower(1);
  add_tower(tower, 0, 0, 30);
  BothWays both(tower, {.sleeping = false}, 1, SolverKind::automatic);
  for (int step = 0; step < 120 && !HasFatalFailure(); ++step) {
    both.step(step);
    if (step > 1) {
      ASSERT_EQ(both.parallel.newton().solved, 1u) << step;
    }
  }
  EXPECT_NEAR(both.states()[30].position.z, 0.1 + 29 * 0.20001, 1e-3);
}

TEST(ParallelStep, HeavyStandsOnLightAsInASimulation) {
  FallingBodies tower(1);
  add_tower(tower, 0, 0, 3);
  tower.descriptions.back().density = 1e7;
  BothWays both(tower, {.sleeping = false}, 1, SolverKind::automatic);
  for (int step = 0; step < 240 && !HasFatalFailure(); ++step) both.step(step);
  EXPECT_NEAR(both.states()[3].position.z, 0.1 + 2 * 0.20001, 1e-3);
}

// A heap of soft contacts beside towers, and bodies that fall asleep.
TEST(ParallelStep, SolvesTowersBesideAHeapAsASimulationDoes) {
  FallingBodies bodies(40, 3);
  add_tower(bodies, 8, 0, 10), add_tower(bodies, 10, 0, 6);
  BothWays both(bodies, {}, 2, SolverKind::automatic);
  std::uint32_t islands = 0, solved = 0;
  for (int step = 0; step < 240 && !HasFatalFailure(); ++step) {
    both.step(step);
    islands += both.parallel.newton().islands, solved += both.parallel.newton().solved;
  }
  EXPECT_GT(solved, 1000u);
  EXPECT_GT(islands, solved);
}

TEST(ParallelStep, IsMadeAgainWhereNewtonsMethodHasTooLittleRoom) {
  FallingBodies towers(1);
  for (int i = 0; i < 150; ++i) add_tower(towers, 0.7 * (i % 10) - 3, 0.6 * (i / 10) - 4, 8);
  BothWays both(towers, {}, 2, SolverKind::automatic);
  std::uint32_t units = 0;
  for (int step = 0; step < 3 && !HasFatalFailure(); ++step) {
    both.step(step);
    units = std::max(units, both.parallel.newton().units);
  }
  EXPECT_GT(units, (4u << 20) / NewtonNeeds::kUnit);
}

}  // namespace
}  // namespace tandem::test
