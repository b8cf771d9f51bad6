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
  std::size_t most_bounced = 0;
  for (int step = 0; step < 240 && !HasFatalFailure(); ++step) {
    if (step % 40 == 0) both.begin_call();
    both.step(step);
    most_bounced = std::max(most_bounced, std::min(both.began.size(), both.ended.size()));
  }
  EXPECT_GT(most_bounced, 8u);
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

// A platform that rises lifts boxes that sleep in the air, and a bar sweeps them off: bodies that contacts do
// not move meet such as sleep, and pairs part for good within the call.
TEST(ParallelStep, FollowsPairsThatKinematicBodiesMeet) {
  FallingBodies many(1);
  for (int i = 0; i < 10; ++i) {
    BodyDescription& body = many.descriptions.emplace_back();
    body.asset = 3, body.pose = shift(0.5 * (i % 5) - 1, 0.5 * (i / 5), 0.1 + (i % 2) * 0.21);
  }
  for (const bool rises : {false, true}) {
    BodyDescription& body = many.descriptions.emplace_back();
    body.asset = 3, body.filter.motion = Motion::kinematic;
    body.pose = rises ? shift(0, 0, -1) : shift(-4, 0, 0.1);
    body.velocity[rises ? 2 : 0] = rises ? 0.5 : 1;
  }
  BothWays both(many);
  std::uint32_t slept = 0;
  for (int step = 0; step < 400 && !HasFatalFailure(); ++step) {
    both.step(step);
    for (std::uint32_t i = 0; i < both.parallel.bodies(); ++i) slept += both.simulation->sleeps(i) ? 1 : 0;
  }
  EXPECT_GT(slept, 100u);
  EXPECT_GT(both.ended.size(), 3u);
}

// A bar that strikes a row of boxes, which fall side by side. The second box is missed first, and the third
// when the step is solved again.
void add_struck_row(FallingBodies& to) {
  for (int i = 0; i < 4; ++i) {
    BodyDescription& body = to.descriptions.emplace_back();
    body.asset = 3, body.pose = shift(0.404 * i, 0, 2);
  }
  BodyDescription& bar = to.descriptions.emplace_back();
  bar.asset = 3, bar.filter.motion = Motion::kinematic;
  bar.pose = shift(-0.8, 0, 1.95), bar.velocity[0] = 6;
}

// The contacts of the second box are not lost by those of the third.
TEST(ParallelStep, MissesContactsTwiceAsASimulationDoes) {
  FallingBodies row(1);
  add_struck_row(row);
  BothWays both(row, {.sleeping = false});
  both.steps(10, [](int) {});
  EXPECT_GT(both.missed, 0u);
  EXPECT_GT(both.states()[3].velocity.x, 1);
}

// Boxes sleep on a floor and beside each other, and callers change them, one after the other.
TEST(ParallelStep, IsToldOfChangesAsASimulationIs) {
  FallingBodies heap(1);
  for (int i = 0; i < 8; ++i) {
    BodyDescription& body = heap.descriptions.emplace_back();
    body.asset = 3, body.pose = shift(1.1 * (i / 2) - 2, 0, 0.1 + 0.2 * (i % 2));
  }
  BodyDescription& held = heap.descriptions.emplace_back();
  held.asset = 3, held.pose = shift(-2, 0, 0.5), held.filter.motion = Motion::fixed;
  BothWays both(heap);
  std::uint32_t slept = 0, woke = 0;
  both.steps(720, [&](int step) {
    const auto sleeping = [&] {
      std::uint32_t count = 0;
      for (std::uint32_t i = 0; i < both.parallel.bodies(); ++i) count += both.simulation->sleeps(i) ? 1 : 0;
      return count;
    };
    if (step % 60 != 59) return;
    const std::uint32_t before = sleeping(), body = 1 + step / 60 % 9;
    slept += before;
    BodySettings settings = both.simulation->bodies()[body];
    BodyState state = both.simulation->states()[body];
    if (step / 60 == 6) {
      settings.material.friction = 0.1;
      both.change(0, settings);  // the floor: all that lies on it wakes
    } else if (step / 60 % 3 == 0) {
      both.set_force(body, {{0.5, 0, 0}, {}});
    } else if (step / 60 % 3 == 1) {
      settings.gravity_scale = settings.gravity_scale == 1 ? 1.25 : 1;
      both.change(body, settings);
    } else {
      state.position.z += 0.01;
      both.place(body, state);
    }
    const std::uint32_t after = sleeping();
    woke += before > after ? 1 : 0;
  });
  EXPECT_GT(slept, 30u);
  EXPECT_GE(woke, 6u);
}

// What is not new wakes nobody.
TEST(ParallelStep, SleepsOnWhereNothingChanges) {
  FallingBodies one(1);
  one.descriptions.emplace_back().asset = 3;
  one.descriptions.back().pose = shift(0, 0, 0.1);
  BothWays both(one);
  both.steps(60, [](int) {});
  ASSERT_TRUE(both.simulation->sleeps(1));
  both.change(1, both.simulation->bodies()[1]);
  both.set_force(1, {});
  EXPECT_TRUE(both.simulation->sleeps(1));
  EXPECT_NE(both.parallel.arrays().group[1], Sleep::kAwake);
}

// Rings, cups and balls are shot at a wall of 2 cm, and at each other.
TEST(ParallelStep, LimitsFastBodiesAsASimulationDoes) {
  for (const bool continuous : {false, true}) {
    FallingBodies bodies(9, 2);
    const std::uint32_t wall = static_cast<std::uint32_t>(bodies.assets.views().size());
    bodies.assets.add(box(0.02F, 6, 6));
    BodyDescription& in_the_way = bodies.descriptions.emplace_back();
    in_the_way.asset = wall, in_the_way.pose = shift(3, 0, 3), in_the_way.filter.motion = Motion::fixed;
    for (std::uint32_t i = 1; i < 9; ++i) {
      BodyDescription& body = bodies.descriptions[i];
      body.velocity[0] = 100 + 20 * i;
      body.pose.translation[2] = 0.5 + 0.25 * i;
    }
    BothWays both(bodies, {.continuous = continuous});
    both.steps(60, [](int) {});
    std::uint32_t behind = 0;
    for (std::uint32_t i = 1; i < 9; ++i) behind += both.states()[i].position.x > 3 ? 1 : 0;
    EXPECT_EQ(behind > 0, !continuous);
    EXPECT_EQ(both.fast > 0, continuous);
  }
}

// Going back gives the steps that followed, whatever happened meanwhile.
TEST(ParallelStep, GoesBackToAState) {
  const FallingBodies bodies(40, 7);
  BothWays both(bodies, {}, 2);
  both.set_force(5, {{0.2, 0, 0}, {}});
  both.steps(50, [](int) {});
  BothWays::State state;
  both.save(state);
  both.begin_call();
  for (int run = 0; run < 2; ++run) {
    both.steps(90, [&](int step) {
      if (run > 0 || step != 20) return;
      BodySettings settings = both.simulation->bodies()[3];
      settings.gravity_scale = 3, settings.material.friction = 0;
      both.change(3, settings);
      both.change(0, settings);
      both.set_force(4, {{0, 1, 0}, {}});
      BodyState moved = both.simulation->states()[0];
      moved.position.z -= 0.05;
      both.place(0, moved);
    });
    both.restore(state);
    both.compare_touches(run);
  }
  EXPECT_GT(both.touching, 1000u);
}

// A body of which a number is none, or becomes too fast, stops the step, which changes nothing.
TEST(ParallelStep, NamesABodyThatLeavesTheRangeOfNumbers) {
  const FallingBodies bodies(8, 3);
  BothWays both(bodies);
  both.steps(30, [](int) {});
  const BodyState good = both.states()[3];
  const auto stops = [&](const BodyState& state) {
    ASSERT_EQ(both.parallel.place(3, state), Status::kOk);
    for (int times = 0; times < 2; ++times) {
      EXPECT_EQ(both.parallel.step(1.0 / 60), Status::kOutOfRange);
      EXPECT_EQ(both.parallel.bad_body(), 3u);
    }
  };
  for (const double number : {std::nan(""), HUGE_VAL, 1e301, 1.1 * kFastest}) {
    BodyState wrong = good;
    wrong.velocity.y = number;
    stops(wrong);
    wrong = good, wrong.orientation.x = number;
    stops(wrong);
    wrong = good, wrong.position.z = number;
    if (number != 1.1 * kFastest) stops(wrong);
  }
  BodyState away = good;
  away.position.z += 1000;
  both.place(3, away);
  both.set_force(3, {{9e9 * both.simulation->bodies()[3].mass, 0, 0}, {}});
  EXPECT_EQ(both.parallel.step(1), Status::kOk);
  EXPECT_EQ(both.parallel.step(1), Status::kOutOfRange);
  EXPECT_EQ(both.parallel.bad_body(), 3u);
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

// The state lacks distances and where bodies were a step before, which are found anew.
TEST(ParallelStep, GoesOnFromWhatASimulationKept) {
  const FallingBodies bodies(24);
  BothWays one(bodies);
  for (int step = 0; step < 100; ++step) one.step(step);
  SimulationState state, end;
  ASSERT_EQ(one.parallel.save(one.simulation->bodies(), state), Status::kOk);
  EXPECT_GT(state.contacts.size(), 20u);
  EXPECT_GT(state.posed.size(), 2u);
  state.ahead = {};
  BothWays other(bodies);
  ASSERT_EQ(other.parallel.restore(other.simulation->bodies(), state), Status::kOk);
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
  ParallelState<HostExecutor> start;
  ASSERT_EQ(both.parallel.save(start), Status::kOk);
  both.steps(3, [](int) {});
  EXPECT_GT(both.parallel.counts().pairs, 8 * 700u);
  // Going back to before there was room gives the same.
  const std::vector<BodyState> states(both.states().begin(), both.states().end());
  ASSERT_EQ(both.parallel.restore(start), Status::kOk);
  for (int step = 0; step < 3; ++step) ASSERT_EQ(both.parallel.step(1.0 / 60), Status::kOk);
  EXPECT_TRUE(same_rows<BodyState>(both.states(), states));
}

// Boxes on each other, askew, in a tower.
void add_tower(FallingBodies& to, double x, double y, int count) {
  for (int i = 0; i < count; ++i) {
    BodyDescription& body = to.descriptions.emplace_back();
    body.asset = 3, body.pose = shift(x + 1e-3 * (i % 3), y, 0.1 + 0.20001 * i);
  }
}

// Two towers are solved once in a step that is solved again for the row beside them.
TEST(ParallelStep, KeepsWhatDidNotChangeWhenAStepIsSolvedAgain) {
  FallingBodies bodies(1);
  add_struck_row(bodies);
  add_tower(bodies, 0, 4, 5), add_tower(bodies, 0, 8, 5);
  BothWays both(bodies, {.sleeping = false}, 1, {}, SolverKind::automatic);
  std::uint32_t least = 100, most = 0;
  both.steps(10, [&](int step) {
    if (step < 2) return;
    least = std::min(least, both.parallel.newton().islands);
    most = std::max(most, both.parallel.newton().islands);
  });
  EXPECT_EQ(least, 1u);
  EXPECT_GE(most, 2u);
}

TEST(ParallelStep, TellsWhatABoxSolvedByNewtonsMethodTouches) {
  FallingBodies bodies(1);
  BodyDescription& body = bodies.descriptions.emplace_back();
  body.asset = 3, body.pose = shift(0, 0, 0.105);
  BothWays both(bodies, {}, 1, {}, SolverKind::automatic);
  std::uint32_t solved = 0;
  both.steps(60, [&](int) { solved += both.parallel.newton().solved; });
  EXPECT_GT(solved, 10u);
  EXPECT_EQ(both.began.size(), 1u);
}

TEST(ParallelStep, SolvesATowerByNewtonsMethod) {
  FallingBodies tower(1);
  add_tower(tower, 0, 0, 30);
  BothWays both(tower, {.sleeping = false}, 1, {}, SolverKind::automatic);
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
  BothWays both(tower, {.sleeping = false}, 1, {}, SolverKind::automatic);
  for (int step = 0; step < 240 && !HasFatalFailure(); ++step) both.step(step);
  EXPECT_NEAR(both.states()[3].position.z, 0.1 + 2 * 0.20001, 1e-3);
}

// A heap of soft contacts beside towers, and bodies that fall asleep.
TEST(ParallelStep, SolvesTowersBesideAHeapAsASimulationDoes) {
  FallingBodies bodies(40, 3);
  add_tower(bodies, 8, 0, 10), add_tower(bodies, 10, 0, 6);
  BothWays both(bodies, {}, 2, {}, SolverKind::automatic);
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
  BothWays both(towers, {}, 2, {}, SolverKind::automatic);
  std::uint32_t units = 0;
  for (int step = 0; step < 3 && !HasFatalFailure(); ++step) {
    both.step(step);
    units = std::max(units, both.parallel.newton().units);
  }
  EXPECT_GT(units, (4u << 20) / NewtonNeeds::kUnit);
}

}  // namespace
}  // namespace tandem::test
