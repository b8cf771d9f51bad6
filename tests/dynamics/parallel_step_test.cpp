#include "dynamics/parallel/parallel_simulation.h"

#include <gtest/gtest.h>

#include "dynamics/both_ways.h"
#include "dynamics/falling_bodies.h"

namespace tandem::test {
namespace {

using namespace dynamics;

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

}  // namespace
}  // namespace tandem::test
