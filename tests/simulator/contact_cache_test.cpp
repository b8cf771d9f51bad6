#include "dynamics/contact_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "analytic_contacts.h"
#include "dynamics/random_heap.h"

namespace tandem::simulation {
namespace {

constexpr double kReach = 0.001, kGap = 0.005;

// A unit box on a slab, with one contact between them.
struct BoxOnSlab {
  std::vector<BodyProperties> bodies = {box_body({9, 9, 1}, 1), box_body({1, 1, 1}, 1)};
  std::vector<BodyState> states = std::vector<BodyState>(2);
  ContactPoint contact = {0, 1, {0.25, 0, 0.5}, kUp, 0.002, 7};
  ContactCache cache;
  Threads threads = 3;
  PairJudge judge;

  BoxOnSlab() { states[1].position.z = 0.998; }

  std::vector<ContactPoint> step(const std::vector<ContactPoint>& found,
                                 std::span<const std::uint8_t> idle = {}) {
    std::vector<ObjectPair> pairs = cache.pairs();
    for (const ContactPoint& point : found) pairs.push_back({point.body_a, point.body_b});
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    std::vector<BodyPose> poses;
    std::vector<double> radii;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      poses.push_back(pose_of(bodies[i], states[i]));
      radii.push_back(bodies[i].radius);
    }
    const double g = 9.81, dt = std::sqrt(kGap / (2 * g));
    const std::vector<Pull> pulls(bodies.size(), {{0, 0, -g}, {}});
    cache.update(found, judge.kept(pairs, poses, radii, kReach), {bodies, states, idle, dt, pulls, kReach},
                 threads);
    return {cache.contacts().begin(), cache.contacts().end()};
  }

  void remember(const std::vector<double>& normal) {
    std::vector<ContactImpulse> impulses;
    for (const double size : normal) impulses.push_back({size, Vector3{}, Vector3{}});
    cache.remember(impulses);
  }
};

TEST(ContactCache, AnUnmovedPairKeepsItsContactsWhateverIsFound) {
  BoxOnSlab on;
  on.step({on.contact});
  on.states[1].position += Vector3{0.0006, 0, -0.0006};
  ContactPoint other = on.contact;
  other.position.x = -0.25, other.depth = 1, other.feature = 8;
  for (const auto& found : {std::vector<ContactPoint>{}, std::vector{other}, std::vector{other, other}}) {
    const auto contacts = on.step(found);
    ASSERT_EQ(contacts.size(), 1u);
    EXPECT_EQ(contacts[0].feature, 7u);
    EXPECT_NEAR(contacts[0].depth, 0.0026, 1e-15);
    EXPECT_NEAR(norm(contacts[0].position - Vector3{0.2503, 0, 0.4997}), 0, 1e-15);
    EXPECT_NEAR(norm(contacts[0].normal - kUp), 0, 1e-15);
  }
}

TEST(ContactCache, WhatBodiesDoTogetherIsNoMotionAgainstEachOther) {
  BoxOnSlab on;
  on.step({on.contact});
  const Quaternion turn = rotation_by(2 * normalized(Vector3{1, 2, 3}));
  for (BodyState& state : on.states) {
    state.position = rotated(turn, state.position) + Vector3{5, -7, 2};
    state.orientation = turn * state.orientation;
  }
  const auto contacts = on.step({});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_NEAR(contacts[0].depth, 0.002, 1e-14);
  EXPECT_NEAR(norm(contacts[0].position - rotated(turn, on.contact.position) - Vector3{5, -7, 2}), 0, 1e-14);
  EXPECT_NEAR(norm(contacts[0].normal - rotated(turn, on.contact.normal)), 0, 1e-14);
}

TEST(ContactCache, WhatComesApartIsAGapAndThenForgotten) {
  BoxOnSlab on;
  on.step({on.contact});
  for (const double apart : {0.0029, 0.0069}) {  // 0.002 deep when found
    on.states[1].position.z = 0.998 + apart;
    const auto gap = on.step({});
    ASSERT_EQ(gap.size(), 1u);
    EXPECT_NEAR(gap[0].depth, 0.002 - apart, 1e-15);
  }
  on.states[1].position.z = 0.998 + 0.0081;
  EXPECT_TRUE(on.step({}).empty());
  EXPECT_TRUE(on.cache.entries().empty());
}

TEST(ContactCache, WhatSlidOrIsStillDeepIsNotJustLost) {
  BoxOnSlab on;
  on.step({on.contact});
  on.states[1].position += Vector3{0.02, 0, 0.003};  // a fiftieth of the radius is 0.0173
  EXPECT_TRUE(on.step({}).empty());
  BoxOnSlab deep;
  deep.step({deep.contact});
  deep.states[1].position += Vector3{0.01, 0, 0.001};
  EXPECT_TRUE(deep.step({}).empty());
}

TEST(ContactCache, WhatIsLostStaysAsLongAsItPushesAndEightStepsMore) {
  BoxOnSlab on;
  on.step({on.contact});
  on.remember({1});
  on.states[1].position.z += 0.004;
  const auto steps_until_forgotten = [&](double impulse) {
    int steps = 0;
    for (double way = 0.0011; steps < 20; ++steps, way = -way) {
      on.states[1].position.y += way;
      if (on.step({}).empty()) break;
      on.remember({impulse});
    }
    return steps;
  };
  EXPECT_EQ(steps_until_forgotten(1e-9), 20);
  EXPECT_EQ(steps_until_forgotten(0), 8);
}

TEST(ContactCache, WhatIsFoundTakesThePlaceOfWhatIsLost) {
  for (const double away : {0.01, 0.1}) {
    BoxOnSlab on;
    on.step({on.contact});
    on.remember({3});
    on.states[1].position.z += 0.003;
    ContactPoint found = on.contact;
    found.position.x -= away, found.feature = 8;
    const auto contacts = on.step({found});
    ASSERT_EQ(contacts.size(), away > 0.0173 ? 2u : 1u);
    EXPECT_EQ(contacts[0].feature, 8u);
    EXPECT_EQ(on.cache.impulses().back().normal, 3);
  }
}

TEST(ContactCache, SlowMotionAddsUp) {
  BoxOnSlab on;
  on.step({on.contact});
  int steps = 0;
  for (on.contact.feature = 8; on.step({on.contact})[0].feature == 7; ++steps) {
    on.states[1].position.x += 0.0003;
  }
  EXPECT_EQ(steps, 4);
}

TEST(ContactCache, PairsAreJudgedEachByItself) {
  BoxOnSlab on;
  on.bodies.push_back(on.bodies[1]), on.states.push_back(on.states[1]);
  on.states[2].position.x = 3;
  ContactPoint second = on.contact, third = on.contact;
  second.body_b = 2, second.position.x = 3;
  third.body_a = 1, third.body_b = 2, third.depth = 0.5;
  on.step({on.contact, second});
  on.states[2].position.x += 0.01;
  second.depth = 0.1;
  ContactPoint first = on.contact;
  first.depth = 0.1;
  const auto contacts = on.step({first, second, third});
  ASSERT_EQ(contacts.size(), 3u);
  EXPECT_NEAR(contacts[0].depth, 0.002, 1e-15);
  EXPECT_EQ(contacts[1].depth, 0.1);
  EXPECT_EQ(contacts[2].depth, 0.5);
}

TEST(ContactCache, PairsThatSleepAreRememberedAsTheyWereWhateverIsFound) {
  BoxOnSlab on;
  on.step({on.contact});
  on.remember({3});
  const std::uint8_t idle[] = {1, 1};
  EXPECT_TRUE(on.step({}, idle).empty());
  EXPECT_TRUE(on.step({on.contact, on.contact}, idle).empty());
  ASSERT_EQ(on.step({}).size(), 1u);
  EXPECT_EQ(on.cache.impulses()[0].normal, 3);
}

TEST(WarmStart, AnUnmovedPairGoesOnWithItsImpulses) {
  BoxOnSlab on;
  EXPECT_TRUE(on.cache.is_cold());
  on.step({on.contact, on.contact});
  EXPECT_TRUE(on.cache.is_cold());
  const ContactImpulse impulse = {3, {1, 2, 0}, {4, 5, 6}};
  on.cache.remember(std::vector{impulse, ContactImpulse{}});
  on.step({});
  EXPECT_FALSE(on.cache.is_cold());
  const auto impulses = on.cache.impulses();
  ASSERT_EQ(impulses.size(), 2u);
  EXPECT_EQ(impulses[0].normal, 3);
  EXPECT_EQ(norm(impulses[0].tangential - impulse.tangential), 0);
  EXPECT_EQ(norm(impulses[0].turning - impulse.turning), 0);
  EXPECT_EQ(impulses[1].normal, 0);
}

TEST(WarmStart, ImpulsesFollowFeaturesThenPlacesAndTheRestIsSharedOut) {
  BoxOnSlab on;
  ContactPoint second = on.contact, third = on.contact;
  second.feature = 8, second.position.x = 0.45;
  third.feature = 9, third.position.x = -0.3;
  on.step({on.contact, second, third});
  on.remember({1, 2, 4});

  ContactPoint same = second, near = on.contact, far = third, farther = third;
  same.position.x = 0;
  near.feature = 10, near.position.x += 0.05;
  far.feature = 11, far.position.x = -0.45;
  farther.feature = 12, farther.position.x = -0.48;
  on.states[1].position.y += 0.002;
  on.step({same, near, far, farther});
  const auto matched = on.cache.impulses();
  ASSERT_EQ(matched.size(), 4u);
  EXPECT_EQ(matched[0].normal, 2);
  EXPECT_EQ(matched[1].normal, 1);
  EXPECT_EQ(matched[2].normal, 2);
  EXPECT_EQ(matched[3].normal, 2);
}

// What two steps make of the contacts of a heap: some pairs are kept, some are new, some lose contacts, and
// some are idle.
ContactCache after_two_steps(const RandomHeap& heap, Threads threads) {
  ContactCache cache;
  std::vector<std::uint8_t> idle(heap.bodies.size());
  for (std::size_t i = 0; i < idle.size(); ++i) idle[i] = i % 4 == 0 ? 1 : 0;
  const BodiesAhead of = {heap.bodies, heap.states, idle, heap.dt, heap.pulls, kReach};
  std::vector<ContactPoint> found[2];
  std::vector<ObjectPair> kept;
  for (const ContactPoint& contact : heap.contacts) {
    const std::uint32_t kind = contact.body_a % 5;
    if (kind != 0) found[0].push_back(contact);
    if (kind != 1 && found[1].size() % 7 != 3) found[1].push_back(contact);
    const ObjectPair pair = pair_of(contact);
    if (kind == 1 && (kept.empty() || kept.back() != pair)) kept.push_back(pair);
  }
  cache.update(found[0], {}, of, threads);
  std::vector<ContactImpulse> impulses;
  for (const ContactPoint& contact : cache.contacts())
    impulses.push_back({contact.position.x, contact.normal, Vector3{}});
  cache.remember(impulses);
  cache.update(found[1], kept, of, threads);
  return cache;
}

TEST(ContactCache, RemembersTheSameByAnyNumberOfThreads) {
  const RandomHeap heap({.bodies = 400, .pairs = 1500});
  const ContactCache alone = after_two_steps(heap, 1);
  EXPECT_GT(alone.entries().size(), alone.contacts().size());
  for (const std::uint32_t threads : {2u, 5u}) {
    const ContactCache cache = after_two_steps(heap, threads);
    const auto differ = [&](std::span<const ContactPoint> p, std::span<const ContactPoint> q) {
      return p.size() != q.size() || std::memcmp(p.data(), q.data(), p.size_bytes()) != 0;
    };
    EXPECT_FALSE(differ(cache.contacts(), alone.contacts()));
    const std::vector<ContactImpulse> is = cache.impulses(), wanted = alone.impulses();
    ASSERT_EQ(is.size(), wanted.size());
    EXPECT_EQ(std::memcmp(is.data(), wanted.data(), sizeof(ContactImpulse) * is.size()), 0);
    EXPECT_TRUE(std::ranges::equal(cache.entries(), alone.entries(), [](const auto& p, const auto& q) {
      return p.pair == q.pair && p.feature == q.feature && p.quiet_steps == q.quiet_steps;
    }));
  }
}

// Contacts whose depths jump by up to 0.8 mm, found anew in each step, keep a block moving at 0.04 to 0.2
// m/s.
TEST(ContactCache, ContactsThatFlickerDoNotShakeABlock) {
  for (const SolverMethod solver :
       {SolverMethod::automatic, SolverMethod::soft, SolverMethod::newton, SolverMethod::sweeps}) {
    SimulatorOptions options;
    options.solver.method = solver;
    std::vector<BodyProperties> bodies = {fixed_body(), box_body({1, 1, 1}, 1)};
    std::vector<BodyState> states(2);
    states[1].position.z = 0.5 - options.solver.slop;
    Simulator simulator(bodies, states, boxes_on_plane(kUp, {1, 1, 1}, 4e-4), options);
    double fastest = 0;
    for (int i = 0; i < 300; ++i) {
      const StepRecord record = simulator.step();
      if (i >= 240) fastest = std::max(fastest, record.speed_max + record.spin_max);
    }
    EXPECT_LT(fastest, 1e-5) << static_cast<int>(solver);
  }
}

// What is lifted by a hair comes back onto the contacts that it had.
TEST(ContactCache, ABlockLiftedByAHairLandsWithinTheSlop) {
  for (const SolverMethod solver :
       {SolverMethod::automatic, SolverMethod::soft, SolverMethod::newton, SolverMethod::sweeps}) {
    for (const double slops : {0.9, 1.2, 4.0}) {
      SimulatorOptions options;
      options.solver.method = solver;
      std::vector<BodyProperties> bodies = {fixed_body(), box_body({1, 1, 1}, 1)};
      std::vector<BodyState> states(2);
      states[1].position.z = 0.5 - 0.1 * options.solver.slop;
      Simulator simulator(bodies, states, boxes_on_plane(kUp, {1, 1, 1}), options);
      simulator.step();
      BodyState lifted = simulator.states()[1];
      lifted.position.z += slops * options.solver.slop;
      simulator.place(1, lifted);
      for (int i = 0; i < 30; ++i) {
        const StepRecord record = simulator.step();
        EXPECT_EQ(record.contacts, 4u);
        EXPECT_LE(record.penetration_max, options.solver.slop + 1e-5);
        EXPECT_GE(simulator.states()[1].position.z, 0.5 - options.solver.slop - 1e-5);
      }
    }
  }
}

}  // namespace
}  // namespace tandem::simulation
