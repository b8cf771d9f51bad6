#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "jointed_scene.h"

/// Joints that come, go and break while a world runs.
namespace tandem::test {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::uint32_t kNone = kNoIndex;

std::vector<std::uint32_t> copied(std::span<const std::uint32_t> joints) {
  return {joints.begin(), joints.end()};
}

TEST(ChangingJoints, ARodThatIsJoinedSwingsAndFliesOnWhereItIsLetGo) {
  Pendulum pendulum(JointKind::ball);
  const JointDescription joint = pendulum.joints[0];
  pendulum.joints.clear();
  World& world = pendulum.begin({.gravity = {0, 0, 0}});
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  std::uint32_t place = 7;
  BodyMotion rod = world.bodies()[0];
  rod.velocity[2] = -2;
  ASSERT_EQ(world.set(0, rod), Status::kOk);
  ASSERT_EQ(world.add_joint(joint, place), Status::kOk);
  EXPECT_EQ(place, 0u);
  ASSERT_EQ(world.joints().size(), 1u);
  EXPECT_TRUE(world.joints()[0].holds);
  pendulum.joints.push_back(joint);
  // The joint takes m v l / 2 about its anchor.
  const double spin = pendulum.mass() * 2 * 0.5 / pendulum.inertia();
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_NEAR(world.bodies()[0].angular_velocity[1], spin, 3e-4 * spin);
    EXPECT_LT(pendulum.most_apart(), 2e-11);
  }
  ASSERT_EQ(world.remove_joint(0), Status::kOk);
  EXPECT_FALSE(world.joints()[0].holds);
  const BodyMotion let_go = world.bodies()[0];
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(world.bodies()[0].centre[k], let_go.centre[k] + let_go.velocity[k], 1e-9);
  EXPECT_NEAR(world.bodies()[0].angular_velocity[1], spin, 3e-4 * spin);
  EXPECT_TRUE(world.broken().empty());
}

TEST(ChangingJoints, WhatSleepsWakesWhereItIsJoinedOrLetGo) {
  JointedScene scene;
  scene.add_box({20, 20, 2}, shift(0, 0, -1)).filter.motion = Motion::fixed;
  scene.add_box({1, 1, 1}, shift(0, 0, 0.5));
  World& world = scene.begin({});
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  ASSERT_TRUE(world.bodies()[1].sleeps);
  std::uint32_t joint = kNone;
  ASSERT_EQ(world.add_joint({.kind = JointKind::fixed, .a = kNone, .b = 1}, joint), Status::kOk);
  EXPECT_FALSE(world.bodies()[1].sleeps);
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  ASSERT_TRUE(world.bodies()[1].sleeps);
  ASSERT_EQ(world.remove_joint(joint), Status::kOk);
  EXPECT_FALSE(world.bodies()[1].sleeps);
}

// Link i of a hanging chain carries those below and itself.
TEST(ChangingJoints, TheJointsOfAHangingChainBreakThatCarryMoreThanTheirForce) {
  for (const bool in_one_call : {false, true}) {
    Chain chain(turn(1, kPi / 2), 1);
    const double weight = 1000 * 0.2 * 0.05 * 0.05 * kGravity;
    for (JointDescription& joint : chain.joints) joint.breaking_force = 10.5 * weight;
    chain.joints[2].breaking_force = 18.1 * weight;
    World& world = chain.begin();
    std::vector<std::uint32_t> broken(10);
    std::iota(broken.begin(), broken.end(), 0u);
    broken.erase(broken.begin() + 2);
    if (in_one_call) {
      ASSERT_EQ(world.step(kStep, 120), Status::kOk);
      EXPECT_EQ(copied(world.broken()), broken);
    } else {
      ASSERT_EQ(world.step(kStep), Status::kOk);
      EXPECT_EQ(copied(world.broken()), broken);
      EXPECT_NEAR(world.joints()[1].impulse[2], 19 * weight * kStep, 1e-6 * weight);  // of its last step
      EXPECT_FALSE(world.joints()[1].holds);
      for (int i = 1; i < 120; ++i) {
        ASSERT_EQ(world.step(kStep), Status::kOk);
        EXPECT_TRUE(world.broken().empty());
        EXPECT_EQ(world.joints()[1].impulse[2], 0);
        EXPECT_NEAR(norm(vector_of(world.joints()[10].impulse)), 0, 1e-6 * weight * kStep);  // all fall alike
      }
    }
    // In its first step all hung still.
    for (const BodyMotion& body : world.bodies())
      EXPECT_NEAR(body.velocity[2], -kGravity * 119 * kStep, 1e-6);
  }
}

TEST(ChangingJoints, ABeamBreaksOffByItsTorqueAndASavedStateHoldsIt) {
  const double torque = 40 * kGravity * 0.5;  // 40 kg, half a metre from the wall
  for (const double part : {0.99, 1.01}) {
    Pendulum beam(JointKind::fixed);
    beam.joints[0].breaking_torque = part * torque;
    World& world = beam.begin();
    std::shared_ptr<const World::State> state;
    ASSERT_EQ(world.save(state), Status::kOk);
    ASSERT_EQ(world.step(kStep, 60), Status::kOk);
    EXPECT_EQ(world.joints()[0].holds, part > 1);
    EXPECT_NEAR(world.bodies()[0].velocity[2], part > 1 ? 0 : -kGravity * 59 * kStep, 1e-6);
    if (part > 1) {
      // As if it were heavier by 1.1 %.
      ASSERT_EQ(world.set_force(0, {0, 0, -0.011 * 40 * kGravity}, {0, 0, 0}), Status::kOk);
      ASSERT_EQ(world.step(kStep), Status::kOk);
    }
    EXPECT_FALSE(world.joints()[0].holds);
    EXPECT_EQ(copied(world.broken()), (std::vector<std::uint32_t>{0}));
    EXPECT_EQ(world.set_motor(0, 1, 1), Status::kBadJoint);
    ASSERT_EQ(world.restore(*state), Status::kOk);
    EXPECT_TRUE(world.broken().empty());
    EXPECT_TRUE(world.joints()[0].holds);
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_EQ(copied(world.broken()).size(), part > 1 ? 0u : 1u);
  }
}

// Two boxes that overlap by a tenth, far above the ground.
class TwoInEachOther : public JointedScene {
 public:
  TwoInEachOther() {
    add_box({1, 1, 1}, shift(0, 0, 0));
    add_box({1, 1, 1}, shift(0, 0, 0.9));
  }
  const JointDescription joint = {.a = 1, .b = 0, .anchor = {0, 0, 0.45}};
};

TEST(ChangingJoints, BodiesTouchWhileNoJointKeepsThemFromIt) {
  TwoInEachOther scene;
  World& world = scene.begin({.gravity = {0, 0, 0}});
  const auto touch = [&] { return !world.touching().empty() && !world.contacts().empty(); };
  std::uint32_t joint = kNone;
  for (const bool breaks : {false, true}) {
    ASSERT_EQ(world.set_bodies(scene.bodies, {.gravity = {0, 0, 0}}), Status::kOk);
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_TRUE(touch());
    // A joint that comes and goes between two steps takes no contacts away.
    ASSERT_EQ(world.add_joint(scene.joint, joint), Status::kOk);
    ASSERT_EQ(world.remove_joint(joint), Status::kOk);
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_TRUE(touch());
    JointDescription held = scene.joint;
    held.breaking_force = breaks ? 100 : INFINITY;
    ASSERT_EQ(world.add_joint(held, joint), Status::kOk);
    ASSERT_EQ(world.step(kStep, 3), Status::kOk);
    EXPECT_TRUE(!touch() && world.contacts().empty() && world.touching().empty());
    if (breaks) {
      ASSERT_EQ(world.push(1, {0, 0, 10000}, {0, 0, 0}), Status::kOk);
      ASSERT_EQ(world.step(kStep), Status::kOk);
      EXPECT_EQ(copied(world.broken()), (std::vector<std::uint32_t>{joint}));
    } else {
      ASSERT_EQ(world.remove_joint(joint), Status::kOk);
    }
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_TRUE(touch()) << breaks;
  }
}

TEST(ChangingJoints, PlacesAreUsedAgainAndStatesBringJointsBack) {
  TwoInEachOther scene;
  scene.joints = {scene.joint, {.kind = JointKind::hinge, .a = 0}};
  World& world = scene.begin({.gravity = {0, 0, 0}});
  std::shared_ptr<const World::State> state;
  ASSERT_EQ(world.save(state), Status::kOk);
  std::uint32_t joint = 7;
  EXPECT_EQ(world.add_joint({.kind = JointKind::slider, .a = 0}, joint), Status::kOk);
  EXPECT_EQ(joint, 2u);
  EXPECT_EQ(world.remove_joint(0), Status::kOk);
  EXPECT_EQ(world.remove_joint(0), Status::kBadJoint);
  EXPECT_EQ(world.remove_joint(3), Status::kBadJoint);
  EXPECT_EQ(world.where(), 3u);
  EXPECT_EQ(world.set_motor(1, 1, 1), Status::kOk);
  ASSERT_EQ(world.step(kStep), Status::kOk);
  EXPECT_FALSE(world.contacts().empty());
  EXPECT_EQ(world.add_joint(scene.joint, joint), Status::kOk);
  EXPECT_EQ(joint, 0u);
  EXPECT_EQ(world.remove_joint(0), Status::kOk);
  ASSERT_EQ(world.restore(*state), Status::kOk);
  ASSERT_EQ(world.joints().size(), 2u);
  EXPECT_TRUE(world.joints()[0].holds && world.joints()[1].holds);
  ASSERT_EQ(world.step(kStep), Status::kOk);
  EXPECT_TRUE(world.contacts().empty());
}

TEST(ChangingJoints, RefusesWhatItCannotJoin) {
  TwoInEachOther scene;
  std::uint32_t joint = 7;
  EXPECT_NE(World().add_joint({.a = 0}, joint), Status::kOk);
  World& world = scene.begin();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(world.add_joint({.a = 0, .b = 2}, joint), Status::kUnknownInstance);
  EXPECT_EQ(world.add_joint({.a = 0, .b = 0}, joint), Status::kJoinsNothing);
  EXPECT_EQ(world.add_joint({}, joint), Status::kJoinsNothing);
  EXPECT_EQ(world.add_joint({.kind = JointKind::hinge, .a = 0, .axis = {0, 0, 0}}, joint), Status::kNoAxis);
  EXPECT_EQ(world.add_joint({.a = 0, .breaking_force = nan}, joint), Status::kBadJoint);
  EXPECT_EQ(world.add_joint({.a = 0, .breaking_torque = -1}, joint), Status::kBadJoint);
  EXPECT_EQ(joint, 7u);
  EXPECT_TRUE(world.joints().empty());
}

// A bridge of planks on hinges, under boxes that fall.
TEST(ChangingJoints, WhatBreaksDoesNotDependOnCallsOrThreads) {
  std::vector<BodyMotion> first;
  std::vector<std::uint32_t> broken;
  for (const auto& [threads, at_once] : {std::pair{1u, 1u}, {3u, 1u}, {1u, 120u}}) {
    JointedScene scene;
    for (std::uint32_t i = 0; i < 12; ++i) {
      scene.add_box({0.38, 1, 0.06}, shift(0.4 * i, 0, 0));
      scene.joints.push_back(
          {.kind = JointKind::hinge, .a = i == 0 ? kNone : i - 1, .b = i, .axis = {0, 1, 0}});
      scene.joints.back().anchor[0] = 0.4 * i - 0.2, scene.joints.back().breaking_force = 9000;
    }
    scene.joints.push_back({.kind = JointKind::hinge, .a = 11, .anchor = {4.6, 0, 0}, .axis = {0, 1, 0}});
    for (int i = 0; i < 6; ++i)
      scene.add_box({0.4, 0.4, 0.4}, shift(1 + 0.5 * i, 0.1 * i - 0.2, 1.5 + 0.4 * i));
    World& world = scene.begin({.threads = threads});
    std::vector<std::uint32_t> all;
    for (std::uint32_t i = 0; i < 120; i += at_once) {
      ASSERT_EQ(world.step(kStep, at_once), Status::kOk);
      all.insert(all.end(), world.broken().begin(), world.broken().end());
    }
    std::ranges::sort(all);
    EXPECT_FALSE(all.empty());
    if (first.empty()) first.assign(world.bodies().begin(), world.bodies().end()), broken = all;
    EXPECT_EQ(all, broken);
    for (std::size_t i = 0; i < first.size(); ++i) {
      for (int k = 0; k < 3; ++k) EXPECT_EQ(world.bodies()[i].centre[k], first[i].centre[k]);
    }
  }
}

}  // namespace
}  // namespace tandem::test
