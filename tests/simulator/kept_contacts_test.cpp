#include <gtest/gtest.h>

#include "analytic_contacts.h"
#include "simulator/impulse_cache.h"

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

// Two unit boxes, one on the other, with one contact in the middle of the plane between them.
struct Pair {
  std::vector<BodyProperties> bodies = {box_body({1, 1, 1}, 1), box_body({1, 1, 1}, 1)};
  std::vector<BodyState> states = std::vector<BodyState>(2);
  ContactPoint contact = {0, 1, {0, 0, 0.5}, Vector3d::UnitZ(), 0.001, 7};
  ImpulseCache cache;

  Pair() { states[1].position.z() = 0.999; }

  void remember(const std::vector<ContactPoint>& contacts, double impulse) {
    KeptContacts kept;
    for (const ContactPoint& one : contacts) kept.add(one, KeptContacts::kFound);
    cache.remember(kept, std::vector<ContactImpulse>(contacts.size(), {impulse, Vector3d::Zero()}), states,
                   {});
  }
  KeptContacts kept(const std::vector<ContactPoint>& found, std::span<const std::uint8_t> idle = {}) const {
    return cache.with_those_just_lost(found, bodies, states, idle, 0.005, kSlop);
  }

  static constexpr double kSlop = 0.006;
};

TEST(KeptContacts, AContactThatIsNotFoundIsKeptAsAGap) {
  Pair pair;
  pair.remember({pair.contact}, 3);
  pair.states[1].position.z() += 0.003;
  const KeptContacts kept = pair.kept({});
  ASSERT_EQ(kept.contacts.size(), 1u);
  EXPECT_NEAR(kept.contacts[0].depth, -0.002, 1e-15);
  EXPECT_NEAR((kept.contacts[0].position - Vector3d(0, 0, 0.5015)).norm(), 0, 1e-15);
  EXPECT_EQ(kept.entry[0], 0u);
}

TEST(KeptContacts, AContactIsForgottenOnceItsBodiesAreApart) {
  Pair pair;
  pair.remember({pair.contact}, 3);
  pair.states[1].position.z() += 0.007;
  EXPECT_TRUE(pair.kept({}).contacts.empty());
  pair.states[1].position.z() -= 0.004;
  pair.states[1].position.x() += 0.02;
  EXPECT_TRUE(pair.kept({}).contacts.empty());
}

TEST(KeptContacts, WhatBodiesSlideInManyStepsAddsUp) {
  Pair pair;
  pair.remember({pair.contact}, 3);
  pair.states[1].position.z() += 0.003;
  int steps = 0;
  for (; steps < 20; ++steps) {
    const KeptContacts kept = pair.kept({});
    if (kept.contacts.empty()) break;
    pair.cache.remember(kept, std::vector<ContactImpulse>(1), pair.states, {});
    pair.states[1].position.x() += 0.004;
  }
  EXPECT_EQ(steps, 5);  // a fiftieth of the radius, sqrt(3) / 2, is 0.0173
}

TEST(KeptContacts, AContactStaysAsLongAsItPushesAndEightStepsMore) {
  Pair pair;
  pair.remember({pair.contact}, 3);
  pair.states[1].position.z() += 0.003;
  const auto next = [&](double impulse) {
    const KeptContacts kept = pair.kept({});
    pair.cache.remember(kept, std::vector<ContactImpulse>(kept.contacts.size(), {impulse, Vector3d::Zero()}),
                        pair.states, {});
    return !kept.contacts.empty();
  };
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(next(i % 7 == 6 ? 1e-9 : 0)) << i;
  int steps = 0;
  while (next(0)) ++steps;
  EXPECT_EQ(steps, 8 - 20 % 7);
}

// That it is not found is rounding then, or the little by which a vertex beside it lies elsewhere.
TEST(KeptContacts, AContactIsKeptDownToATenthOfTheSlop) {
  Pair pair;
  pair.remember({pair.contact}, 3);
  EXPECT_TRUE(pair.kept({}).contacts.empty());
  pair.states[1].position.z() += 0.0005;
  const KeptContacts kept = pair.kept({});
  ASSERT_EQ(kept.contacts.size(), 1u);
  EXPECT_NEAR(kept.contacts[0].depth, 0.0005, 1e-15);
}

TEST(Jumps, OfWhatIsFoundDeeperThanBodiesMovedATenthCounts) {
  Pair pair;
  pair.remember({pair.contact}, 3);
  pair.states[1].position.z() -= 0.0001;
  const auto depth_of = [&](double depth, const Vector3d& position, const Vector3d& normal) {
    ContactPoint found = pair.contact;
    found.feature = 8;
    found.depth = depth, found.position = position, found.normal = normal;
    return pair.cache.without_jumps(std::vector{found}, pair.bodies, pair.states, 0.01)[0].depth;
  };
  const Vector3d there = pair.contact.position, up = Vector3d::UnitZ();
  EXPECT_NEAR(depth_of(0.0022, there, up), 0.0012 + 0.1 * 0.001, 1e-15);  // 0.001, and twice what it moved
  EXPECT_NEAR(depth_of(0.0012, there, up), 0.0012, 1e-15);
  EXPECT_EQ(depth_of(0.0003, there, up), 0.0003);
  EXPECT_NEAR(depth_of(0.0022, there + Vector3d(0.017, 0, 0), up), 0.0013, 1e-15);
  EXPECT_EQ(depth_of(0.0022, there + Vector3d(0.018, 0, 0), up), 0.0022);  // elsewhere
  EXPECT_EQ(depth_of(0.0022, there, Vector3d::UnitX()), 0.0022);           // pushes elsewhere
  pair.states[1].velocity.x() = 0.05;                                      // with dt 0.01 half a millimetre
  EXPECT_NEAR(depth_of(0.0022, there, up), 0.0017 + 0.1 * 0.0005, 1e-15);
  pair.states[1].velocity.x() = 1;
  EXPECT_EQ(depth_of(0.0022, there, up), 0.0022);
}

TEST(Jumps, AnotherPairOrTheFirstContactOfOneCountsAtOnce) {
  Pair pair;
  EXPECT_EQ(pair.cache.without_jumps(std::vector{pair.contact}, pair.bodies, pair.states, 0.01)[0].depth,
            0.001);
  pair.bodies.push_back(pair.bodies[0]), pair.states.push_back(pair.states[0]);
  pair.remember({pair.contact}, 3);
  ContactPoint other = pair.contact;
  other.body_b = 2, other.depth = 1;
  EXPECT_EQ(pair.cache.without_jumps(std::vector{other}, pair.bodies, pair.states, 0.01)[0].depth, 1);
}

TEST(KeptContacts, AContactThatIsFoundTakesTheKeptOnesPlace) {
  Pair pair;
  pair.remember({pair.contact}, 3);
  pair.states[1].position.z() += 0.003;
  ContactPoint found = pair.contact;
  found.position.x() = 0.01;
  const KeptContacts near = pair.kept({found});
  ASSERT_EQ(near.contacts.size(), 1u);
  EXPECT_EQ(near.entry[0], KeptContacts::kFound);
  found.position.x() = 0.1;
  EXPECT_EQ(pair.kept({found}).contacts.size(), 2u);
}

TEST(KeptContacts, PairsThatSleepAreRememberedAsTheyWere) {
  Pair pair;
  pair.remember({pair.contact}, 3);
  const std::uint8_t idle[] = {1, 1};
  pair.states[1].position.z() += 0.003;
  const KeptContacts kept = pair.kept({}, idle);
  EXPECT_TRUE(kept.contacts.empty());
  pair.cache.remember(kept, {}, pair.states, idle);
  ASSERT_EQ(pair.cache.entries().size(), 1u);
  EXPECT_EQ(pair.cache.entries()[0].impulse.normal, 3);
}

TEST(WarmStart, ImpulsesFollowFeaturesThenPlacesAndTheRestIsSharedOut) {
  Pair pair;
  ContactPoint second = pair.contact, third = pair.contact;
  second.feature = 8, second.position.x() = 0.3;
  third.feature = 9, third.position.x() = -0.3;
  KeptContacts kept;
  for (const ContactPoint& one : {pair.contact, second, third}) kept.add(one, KeptContacts::kFound);
  const std::vector<ContactImpulse> impulses = {
      {1, Vector3d::Zero()}, {2, Vector3d::Zero()}, {4, Vector3d::Zero()}};
  pair.cache.remember(kept, impulses, pair.states, {});

  ContactPoint same = second, near = pair.contact, far = third;
  same.position.x() = 0.5;
  near.feature = 10, near.position.x() = 0.05;
  far.feature = 11, far.position.x() = -0.45;
  const auto matched = pair.cache.match(std::vector{same, near, far}, pair.bodies, pair.states);
  EXPECT_EQ(matched[0].normal, 2);
  EXPECT_EQ(matched[1].normal, 1);
  EXPECT_EQ(matched[2].normal, 4);
}

// A block that is lifted off by a hair lands within the slop instead of falling through a step.
TEST(KeptContacts, ABlockLiftedByAHairLandsWithinTheSlop) {
  for (const SolverKind solver :
       {SolverKind::automatic, SolverKind::soft, SolverKind::newton, SolverKind::sweeps}) {
    SimulatorOptions options;
    options.solver.kind = solver;
    // Sweeps stop a gap from closing any further, the others let it close to the slop.
    const double deepest = solver == SolverKind::sweeps ? 1e-11 : options.solver.slop + 1e-5;
    std::vector<BodyProperties> bodies = {fixed_body(), box_body({1, 1, 1}, 1)};
    std::vector<BodyState> states(2);
    states[1].position.z() = 0.5 - options.solver.slop;
    Simulator simulator(bodies, states, boxes_on_plane(Vector3d::UnitZ(), {1, 1, 1}), options);
    simulator.step();
    BodyState lifted = simulator.states()[1];
    lifted.position.z() += options.solver.slop + 1e-4;
    simulator.place(1, lifted);
    for (int i = 0; i < 30; ++i) {
      const StepRecord record = simulator.step();
      EXPECT_LE(record.penetration_max, deepest);
      EXPECT_GE(simulator.states()[1].position.z(), 0.5 - 1e-9 - deepest);
    }
  }
}

}  // namespace
}  // namespace tandem::simulation
