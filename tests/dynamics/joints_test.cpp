#include <algorithm>
#include <cmath>
#include <limits>

#include "jointed_scene.h"

/// Bodies that joints hold, beside closed forms.
namespace tandem::test {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = INFINITY;

TEST(Joints, APendulumKeepsItsEnergyAndPeriod) {
  for (const JointKind kind : {JointKind::ball, JointKind::hinge}) {
    Pendulum pendulum(kind);
    World& world = pendulum.begin();
    const double energy = pendulum.sums().energy(), depth = pendulum.mass() * kGravity * 0.5;
    std::vector<double> lowest;  // times at which it passes there
    double before = 0;
    while (world.time() < 10) {
      ASSERT_EQ(world.step(kStep), Status::kOk);
      EXPECT_NEAR(pendulum.sums().energy(), energy, 1e-3 * depth);  // 7e-4, where it is fastest
      EXPECT_LT(pendulum.most_apart(), 2e-11);
      const double x = world.bodies()[0].centre[0];
      if (x * before < 0) lowest.push_back(world.time() - kStep * x / (x - before));
      before = x;
    }
    // The period is 4 K(sin(amplitude / 2)) / omega_0; K(sqrt(1/2)).
    const double period =
        4 * 1.8540746773013719 * std::sqrt(pendulum.inertia() / (pendulum.mass() * kGravity * 0.5));
    const double measured = 2 * (lowest.back() - lowest.front()) / static_cast<double>(lowest.size() - 1);
    EXPECT_NEAR(measured / period, 1, 2e-3);
  }
}

TEST(Joints, ABallJointLetsARodTurnInACone) {
  Pendulum pendulum(JointKind::ball);
  const double angle = 0.5, axial = 0.04 / 6, across = 1.04 / 12 + 0.25;
  const double speed = std::sqrt(kGravity * 0.5 / (std::cos(angle) * (across - axial)));
  BodyDescription& rod = pendulum.bodies[0];
  rod.pose = after(turn(1, kPi / 2 - angle), shift(0.5, 0, 0));
  rod.angular_velocity[2] = speed;
  rod.velocity[1] = speed * 0.5 * std::sin(angle);
  World& world = pendulum.begin();
  for (int i = 0; i < 600; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_NEAR(world.bodies()[0].centre[2], -0.5 * std::cos(angle), 2e-3);
  }
  const double turned = std::atan2(world.bodies()[0].centre[1], world.bodies()[0].centre[0]);
  EXPECT_NEAR(std::remainder(turned - speed * world.time(), 2 * kPi), 0, 0.1);  // of 47 rad
}

TEST(Joints, AMotorSpeedsUpAsItsTorqueSaysAndIsStoppedByALimit) {
  Pendulum flywheel(JointKind::hinge);
  JointDescription& hinge = flywheel.joints[0];
  hinge.speed = 3, hinge.most_effort = 100, hinge.most = 7;
  World& world = flywheel.begin({.gravity = {0, 0, 0}, .sleeping = false});
  const double gain = hinge.most_effort / flywheel.inertia();
  bool stopped = false;
  while (world.time() < 5) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    const WorldJoint& joint = world.joints()[0];
    stopped = stopped || joint.position > 7 - 1e-6;
    EXPECT_LT(joint.position, 7 + 1e-9);
    if (!stopped && joint.position < 6.9) {
      EXPECT_NEAR(joint.speed, std::min(3.0, gain * world.time()), 6e-4);
      if (joint.speed < 2.999) {
        EXPECT_NEAR(joint.motor_effort, 100, 1e-9);
      }
    }
  }
  EXPECT_TRUE(stopped);
  EXPECT_NEAR(world.joints()[0].position, 7, 1e-9);
  EXPECT_NEAR(world.joints()[0].speed, 0, 1e-9);
  EXPECT_NEAR(world.joints()[0].motor_effort, 100, 1e-6);
  // The other way, from what it rests at.
  ASSERT_EQ(world.set_motor(0, -3, 1e6), Status::kOk);
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  EXPECT_NEAR(world.joints()[0].speed, -3, 1e-8);
  EXPECT_NEAR(world.joints()[0].position, 7 - 3 + 1.5 * kStep, 1e-3);
}

TEST(Joints, ASliderSlidesAsTheSlopeSaysUntilItsLimit) {
  const double slope = 0.5;
  JointedScene scene;
  scene.add_box({0.4, 0.2, 0.2}, shift(0, 0, 3));
  scene.joints.push_back({.kind = JointKind::slider,
                          .b = 0,
                          .anchor = {0, 0.3, 3},
                          .axis = {2 * std::cos(slope), 0, -2 * std::sin(slope)},
                          .most = 5});
  World& world = scene.begin();
  const double gain = kGravity * std::sin(slope);
  while (world.time() < 2) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    const double way = std::min(5.0, 0.5 * gain * world.time() * world.time());
    EXPECT_NEAR(world.joints()[0].position, way, 1e-9);
    EXPECT_NEAR(world.bodies()[0].centre[2], 3 - way * std::sin(slope), 1e-9);
  }
  EXPECT_NEAR(world.joints()[0].speed, 0, 1e-9);
  EXPECT_NEAR(world.joints()[0].impulse[2], world.mass_of(0) * kGravity * kStep, 1e-6);
}

TEST(Joints, TwoBodiesThatAreFixedMoveAsOne) {
  JointedScene two, one;
  two.add_box({1, 0.2, 0.2}, shift(0, 0, 0));
  two.add_box({0.2, 0.6, 0.2}, shift(0.6, 0.2, 0));
  two.joints.push_back({.kind = JointKind::fixed, .a = 0, .b = 1, .anchor = {0.5, 0, 0}});
  one.add(joined(box(1, 0.2f, 0.2f), moved(box(0.2f, 0.6f, 0.2f), 0.6f, 0.2f, 0)), shift(0, 0, 0));
  World& whole = one.begin();
  const Vector3 centre = vector_of(whole.bodies()[0].centre), spin = {1, 2, 3};
  for (BodyDescription& body : two.bodies) {
    const Vector3 v = cross(spin, vector_of(body.pose.translation) - centre);
    for (int k = 0; k < 3; ++k)
      body.velocity[k] = k == 0 ? v.x : k == 1 ? v.y : v.z, body.angular_velocity[k] = k + 1;
  }
  BodyMotion motion = whole.bodies()[0];
  for (int k = 0; k < 3; ++k) motion.angular_velocity[k] = k + 1;
  ASSERT_EQ(whole.set(0, motion), Status::kOk);
  World& world = two.begin();
  double worst = 0;
  for (int i = 0; i < 300; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    ASSERT_EQ(whole.step(kStep), Status::kOk);
    const Vector3 end = {0.5, 0, 0};
    worst = std::max(worst, norm(apply(world.bodies()[0].pose, end) - apply(whole.bodies()[0].pose, end)));
  }
  EXPECT_LT(worst, 0.05);  // it has turned by 19 rad
  EXPECT_LT(two.most_apart(), 2e-11);
}

TEST(Joints, ARopeIsSlackUntilItIsTaut) {
  JointedScene scene;
  scene.add_box({0.2, 0.2, 0.2}, shift(0.5, 0, 0));
  scene.joints.push_back({.kind = JointKind::distance, .b = 0, .anchor_b = {0.5, 0, 0}, .most = 2});
  World& world = scene.begin();
  bool was_taut = false;
  while (world.time() < 3) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    const double fall = 0.5 * kGravity * world.time() * world.time();
    if (std::hypot(0.5, fall) < 1.99 && !was_taut) {
      EXPECT_NEAR(world.bodies()[0].centre[2], -fall, 1e-9);
    }
    was_taut = was_taut || norm(vector_of(world.joints()[0].impulse)) > 0;
    EXPECT_LE(world.joints()[0].position, 2 + 1e-9);
  }
  EXPECT_TRUE(was_taut);
}

TEST(Joints, ARodKeepsItsLengthAndEnergy) {
  Pendulum pendulum(JointKind::distance);
  pendulum.joints[0].anchor[2] = 1;
  World& world = pendulum.begin();
  const double energy = pendulum.sums().energy();
  for (int i = 0; i < 600; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_NEAR(pendulum.sums().energy(), energy, 0.02 * pendulum.mass() * kGravity);  // spins up to 10 rad/s
    EXPECT_NEAR(world.joints()[0].position, 1, 2e-11);
  }
}

TEST(Joints, AChainHangsStillWithAThousandTimesItsLinksBelow) {
  for (const double last : {1.0, 1000.0}) {
    Chain chain(turn(1, kPi / 2), last);
    World& world = chain.begin();
    for (int i = 0; i < 300; ++i) {
      ASSERT_EQ(world.step(kStep), Status::kOk);
      ASSERT_LT(chain.most_apart(), 1e-12);
      for (const BodyMotion& body : world.bodies()) ASSERT_LT(norm(vector_of(body.velocity)), 1e-6);
    }
    const double weight = (19 + last) * world.mass_of(0) * kGravity;
    EXPECT_NEAR(world.joints()[0].impulse[2] / kStep / weight, 1, 1e-6);
  }
}

TEST(Joints, AChainThatSwingsHoldsTogether) {
  for (const double last : {1.0, 1000.0}) {
    Chain chain(kIdentityPose, last);
    World& world = chain.begin();
    const double energy = chain.sums().energy(), depth = (19 + last) * world.mass_of(0) * kGravity * 4;
    for (int i = 0; i < 300; ++i) {
      ASSERT_EQ(world.step(kStep), Status::kOk);
      ASSERT_LT(chain.most_apart(), 2e-7);
      ASSERT_LT(chain.sums().energy() - energy, 0.02 * depth);
    }
  }
}

// Four hinges hold the three bars of a plane linkage, which has one freedom, three times as much as it takes.
TEST(Joints, AFourBarLinkageKeepsItsLoopClosed) {
  JointedScene scene;
  const auto bar = [&](double x, double z, double to_x, double to_z, double y) {
    scene.add_box({std::hypot(to_x - x, to_z - z), 0.05, 0.05},
                  after(shift((x + to_x) / 2, y, (z + to_z) / 2), turn(1, -std::atan2(to_z - z, to_x - x))));
  };
  bar(0, 0, 0, 1, 0), bar(0, 1, 2, 1.5, 0.1), bar(2, 1.5, 2, 0, 0);
  const auto hinge = [&](std::uint32_t a, std::uint32_t b, double x, double z) {
    scene.joints.push_back(
        {.kind = JointKind::hinge, .a = a, .b = b, .anchor = {x, 0.05, z}, .axis = {0, 1, 0}});
  };
  hinge(kNoIndex, 0, 0, 0), hinge(0, 1, 0, 1), hinge(1, 2, 2, 1.5), hinge(2, kNoIndex, 2, 0);
  scene.joints[0].speed = 5, scene.joints[0].most_effort = 1e4;
  World& world = scene.begin();
  for (int i = 0; i < 3600; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    ASSERT_LT(scene.most_apart(), 1e-6);
    ASSERT_NEAR(world.joints()[0].speed, 5, 1e-3);
    // What the hinges do against each other stays as small as what they have to.
    for (const WorldJoint& joint : world.joints())
      ASSERT_LT(norm(vector_of(joint.impulse)), i == 0 ? 50 : 15);
  }
  EXPECT_NEAR(world.joints()[0].position, 300, 0.5);  // 47 turns
}

TEST(Joints, FreeBodiesKeepTheirMomentumAndEnergy) {
  RandomPoses random(3);
  for (const JointKind kind :
       {JointKind::ball, JointKind::hinge, JointKind::slider, JointKind::fixed, JointKind::distance}) {
    JointedScene scene;
    for (std::uint32_t i = 0; i < 5; ++i) {
      BodyDescription& body =
          scene.add_box({0.5, 0.3, 0.1}, after(shift(0.6 * i, 0, 0), any_motion(random, 0)));
      body.filter.mask = 0;
      for (int k = 0; k < 3; ++k)
        body.velocity[k] = random.symmetric(1), body.angular_velocity[k] = random.symmetric(3);
      if (i == 0) continue;
      scene.joints.push_back({.kind = kind,
                              .a = i - 1,
                              .b = i,
                              .anchor = {0.6 * i - 0.3, 0.1, 0},
                              .anchor_b = {0.6 * i, 0.1, 0.1},
                              .axis = {0.3, 1, 0}});
    }
    World& world = scene.begin({.gravity = {0, 0, 0}, .sleeping = false});
    const Vector3 momentum = scene.sums().momentum;
    ASSERT_EQ(world.step(kStep), Status::kOk);  // makes velocities such as the joints allow
    const JointedScene::Sums before = scene.sums();
    ASSERT_EQ(world.step(kStep, 600), Status::kOk);
    const JointedScene::Sums after = scene.sums();
    const int of = static_cast<int>(kind);
    EXPECT_LT(norm(after.momentum - momentum) / norm(momentum), 1e-13) << of;
    EXPECT_LT(norm(after.angular_momentum - before.angular_momentum) / norm(before.angular_momentum), 5e-4)
        << of;
    EXPECT_NEAR(after.kinetic / before.kinetic, 1, 0.01) << of;
  }
}

TEST(Joints, ACarDrivesOnItsWheels) {
  JointedScene scene;
  scene.add_box({60, 20, 2}, shift(20, 0, -1)).filter.motion = Motion::fixed;
  scene.add_box({2, 0.8, 0.3}, shift(0, 0, 0.5));
  const Pose lying = turn(0, kPi / 2);
  for (const double x : {-0.7, 0.7}) {
    for (const double y : {-0.6, 0.6}) {
      scene.add(regular_prism(48, 0.3, 0.2f), after(shift(x, y, 0.3), lying));
      scene.joints.push_back({.kind = JointKind::hinge,
                              .a = 1,
                              .b = static_cast<std::uint32_t>(scene.bodies.size() - 1),
                              .anchor = {x, y, 0.3},
                              .axis = {0, 1, 0},
                              .speed = 5,
                              .most_effort = 200});
    }
  }
  World& world = scene.begin();
  double worst = 0;
  for (int i = 0; i < 300; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    worst = std::max(worst, scene.most_apart());
  }
  EXPECT_LT(worst, 1e-3);  // in steps that Newton does not solve, where wheels slip
  const BodyMotion& car = world.bodies()[1];
  EXPECT_NEAR(car.velocity[0], 5 * 0.3, 0.05);
  EXPECT_NEAR(car.centre[2], 0.5, 0.01);
  for (const WorldJoint& wheel : world.joints()) EXPECT_NEAR(wheel.speed, 5, 0.05);
}

// Boxes that are joined by twos and fall in a heap: an island that is not slender.
TEST(Joints, AHeapOfJoinedBodiesHoldsTogether) {
  JointedScene scene;
  scene.add_box({20, 20, 2}, shift(0, 0, -1)).filter.motion = Motion::fixed;
  RandomPoses random(5);
  for (int i = 0; i < 60; ++i) {
    const Pose pose = after(shift(0.7 * (i % 3), 0.7 * (i / 3 % 3), 0.8 + 0.25 * i), any_motion(random, 0));
    const auto first = static_cast<std::uint32_t>(scene.bodies.size());
    for (const double x : {-0.2, 0.2}) scene.add_box({0.36, 0.2, 0.2}, after(pose, shift(x, 0, 0)));
    scene.joints.push_back(
        {.kind = i % 2 == 0 ? JointKind::ball : JointKind::hinge, .a = first, .b = first + 1});
    std::copy_n(pose.translation, 3, scene.joints.back().anchor);
  }
  World& world = scene.begin();
  double worst = 0;
  for (int i = 0; i < 480; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    worst = std::max(worst, scene.most_apart());
  }
  // Some meet 14 cm deep, at 9 m/s. By most seeds it is 0.03.
  EXPECT_LT(worst, 0.08);
  EXPECT_LT(scene.most_apart(), 1e-3);
  EXPECT_LT(scene.sums().kinetic, 0.01 * scene.sums().potential);
  for (const BodyMotion& body : world.bodies().subspan(1)) EXPECT_GT(body.centre[2], 0.05);
}

// Four layers of boxes are solved by soft steps.
TEST(Joints, AJointInAHeapTellsWhatMomentumSays) {
  JointedScene scene;
  scene.add_box({40, 40, 2}, shift(0, 0, -1)).filter.motion = Motion::fixed;
  for (int i = 0; i < 100; ++i)
    scene.add_box({1, 1, 1}, shift(i % 5, i / 5 % 5, 0.8 + i / 25)).velocity[2] = i == 37 ? 0 : -3;
  scene.joints.push_back({.b = 38});
  std::copy_n(scene.bodies[38].pose.translation, 3, scene.joints[0].anchor);
  World& world = scene.begin();
  Vector3 before;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    const Vector3 now = vector_of(world.bodies()[38].velocity);
    Vector3 needed = world.mass_of(38) * (now - before + kStep * Vector3{0, 0, kGravity});
    double all = norm(needed);
    for (const WorldContact& contact : world.contacts()) {
      const Vector3 impulse = vector_of(contact.impulse);
      if (contact.a == 38) needed = needed + impulse;
      if (contact.b == 38) needed = needed - impulse;
      if (contact.a == 38 || contact.b == 38) all += norm(impulse);
    }
    EXPECT_NEAR(norm(vector_of(world.joints()[0].impulse) - needed), 0, 1e-3 * all) << i;
    before = now;
  }
}

// Where each body was stopped by itself, anchors parted by up to two links.
TEST(Joints, AChainThatAThinPlateLeadsHoldsTogetherWhereContinuousMotionStopsIt) {
  for (const JointKind kind : {JointKind::ball, JointKind::hinge}) {
    for (const double tilt : {0.0, 0.05, 0.2, 0.6}) {
      JointedScene scene;
      scene.add_box({0.1, 6, 6}, shift(3.05, 0, 0)).filter.motion = Motion::fixed;
      const Pose pose = turn(1, tilt);
      scene.add_box({0.01, 0.5, 0.5}, pose);
      for (std::uint32_t i = 2; i < 12; ++i) {
        scene.add_box({0.2, 0.05, 0.05}, after(pose, shift(0.29 - 0.2 * i, 0, 0)));
        const Vector3 at = apply(pose, {0.39 - 0.2 * i, 0, 0});
        scene.joints.push_back(
            {.kind = kind, .a = i - 1, .b = i, .anchor = {at.x, at.y, at.z}, .axis = {0, 1, 0}});
      }
      for (std::size_t i = 1; i < scene.bodies.size(); ++i) scene.bodies[i].velocity[0] = 30;
      World& world = scene.begin({.gravity = {0, 0, 0}, .sleeping = false, .continuous = true});
      const double energy = scene.sums().kinetic;
      int last = 0;  // step in which anchors are apart
      for (int i = 0; i < 60; ++i) {
        ASSERT_EQ(world.step(kStep), Status::kOk);
        ASSERT_LT(scene.most_apart(), 0.05) << tilt << ' ' << i;
        ASSERT_LT(scene.sums().kinetic, (1 + 1e-9) * energy);
        for (const BodyMotion& body : world.bodies().subspan(1)) ASSERT_LT(body.centre[0], 3);
        if (scene.most_apart() > 1e-3 * 0.2) last = i;
      }
      if (tilt < 0.4) {
        EXPECT_LT(last, 12);  // it meets the wall in the sixth; a steeper one thrashes for up to a second
      }
    }
  }
}

TEST(Joints, AKinematicBodyCarriesWhatIsJoinedToIt) {
  JointedScene scene;
  BodyDescription& table = scene.add_box({1, 1, 0.1}, shift(0, 0, 0));
  table.filter.motion = Motion::kinematic;
  table.angular_velocity[2] = 2;
  scene.add_box({0.2, 0.2, 0.2}, shift(1, 0, 0));
  scene.joints.push_back({.kind = JointKind::fixed, .a = 0, .b = 1, .anchor = {0.5, 0, 0}});
  World& world = scene.begin();
  ASSERT_EQ(world.step(kStep, 120), Status::kOk);
  const double* centre = world.bodies()[1].centre;
  EXPECT_NEAR(centre[0], std::cos(4), 1e-9);
  EXPECT_NEAR(centre[1], std::sin(4), 1e-9);
  EXPECT_NEAR(world.bodies()[1].angular_velocity[2], 2, 1e-6);
}

TEST(Joints, WhatHangsStillSleepsUntilItsMotorIsAskedToTurn) {
  Pendulum pendulum(JointKind::hinge);
  pendulum.bodies[0].pose = after(turn(1, kPi / 2), shift(0.5, 0, 0));
  pendulum.joints[0].most_effort = 1;
  World& world = pendulum.begin({});
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  EXPECT_TRUE(world.bodies()[0].sleeps);
  ASSERT_EQ(world.set_motor(0, 0.01, 1e4), Status::kOk);
  ASSERT_EQ(world.step(kStep, 120), Status::kOk);
  EXPECT_FALSE(world.bodies()[0].sleeps);
  EXPECT_NEAR(world.joints()[0].position, 0.02, 1e-3);
}

TEST(Joints, JoinedBodiesTouchOnlyIfTheyMay) {
  for (const bool may_touch : {false, true}) {
    JointedScene scene;
    scene.add_box({1, 1, 1}, shift(0, 0, 0));
    scene.add_box({1, 1, 1}, shift(0, 0, 0.99));
    scene.joints.push_back({.a = 0, .b = 1, .anchor = {0, 0, 0.5}, .may_touch = may_touch});
    World& world = scene.begin();
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_EQ(world.contacts().empty(), !may_touch);
  }
}

TEST(Joints, GoOnFromWhatWasSavedAndDoNotDependOnThreads) {
  std::vector<BodyMotion> ends[3];
  for (int run = 0; run < 2; ++run) {
    JointedScene scene;
    scene.add_box({20, 20, 2}, shift(0, 0, -1)).filter.motion = Motion::fixed;
    for (std::uint32_t i = 0; i < 20; ++i) {
      scene.add_box({0.3, 0.2, 0.2}, shift(0.32 * i, 0, 1 + 0.01 * i));
      if (i % 5 == 0) continue;
      scene.joints.push_back({.kind = i % 2 == 0 ? JointKind::hinge : JointKind::ball, .a = i, .b = i + 1});
      scene.joints.back().anchor[0] = 0.32 * i - 0.16, scene.joints.back().anchor[2] = 1;
    }
    scene.joints[1].speed = 2, scene.joints[1].most_effort = 50;
    World& world = scene.begin({.threads = run == 0 ? 1u : 3u});
    ASSERT_EQ(world.step(kStep, 40), Status::kOk);
    std::shared_ptr<const World::State> state;
    ASSERT_EQ(world.save(state), Status::kOk);
    for (const int end : {run, 2}) {
      ASSERT_EQ(world.restore(*state), Status::kOk);
      ASSERT_EQ(world.step(kStep, 40), Status::kOk);
      ends[end].assign(world.bodies().begin(), world.bodies().end());
      ASSERT_EQ(world.set_motor(1, -9, 1e3), Status::kOk);  // which restoring takes back
    }
    for (std::size_t i = 0; i < ends[2].size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(ends[run][i].centre[k], ends[2][i].centre[k]);
        EXPECT_EQ(ends[0][i].centre[k], ends[run][i].centre[k]);
      }
    }
  }
}

TEST(Joints, RefusesWhatItCannotJoin) {
  JointedScene scene;
  scene.add_box({1, 1, 1}, shift(0, 0, 0));
  scene.add_box({1, 1, 1}, shift(2, 0, 0)).filter.motion = Motion::fixed;
  scene.joints.push_back({.a = 0, .b = 1});
  World& world = scene.begin();
  const auto refused = [&](const JointDescription& joint, Status expected) {
    EXPECT_EQ(world.set_bodies(scene.bodies, {}, {}, std::vector{scene.joints[0], joint}), expected);
    EXPECT_EQ(world.where(), 1u);
    EXPECT_TRUE(world.bodies().empty() && world.joints().empty());
  };
  refused({.a = 0, .b = 2}, Status::kUnknownInstance);
  refused({.a = 0, .b = 0}, Status::kJoinsNothing);
  refused({.a = 1}, Status::kJoinsNothing);
  refused({}, Status::kJoinsNothing);
  refused({.kind = JointKind::hinge, .a = 0, .axis = {0, 0, 0}}, Status::kNoAxis);
  refused({.kind = JointKind::slider, .a = 0, .axis = {0, kInfinity, 0}}, Status::kBadJoint);
  refused({.a = 0, .anchor = {kNan, 0, 0}}, Status::kBadJoint);
  refused({.kind = JointKind::distance, .a = 0, .anchor_b = {0, kNan, 0}}, Status::kBadJoint);
  refused({.kind = JointKind::hinge, .a = 0, .least = 1, .most = 0}, Status::kBadJoint);
  refused({.kind = JointKind::hinge, .a = 0, .least = kNan}, Status::kBadJoint);
  refused({.kind = JointKind::hinge, .a = 0, .speed = kNan}, Status::kBadJoint);
  refused({.kind = JointKind::hinge, .a = 0, .most_effort = -1}, Status::kBadJoint);
  refused({.kind = JointKind::ball, .a = 0, .most = 1}, Status::kBadJoint);
  refused({.kind = JointKind::fixed, .a = 0, .most_effort = 1}, Status::kBadJoint);
  refused({.kind = static_cast<JointKind>(9), .a = 0}, Status::kBadJoint);
  scene.begin();
  EXPECT_EQ(world.set_motor(1, 1, 1), Status::kBadJoint);
  EXPECT_EQ(world.set_motor(0, 1, 1), Status::kBadJoint);  // a ball has no motor
}

}  // namespace
}  // namespace tandem::test
