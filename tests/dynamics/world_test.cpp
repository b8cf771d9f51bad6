#include <algorithm>
#include <cmath>
#include <filesystem>

#include "dynamics/linear.h"
#include "dynamics/world_on_ground.h"

/// Bodies that move, beside closed forms.
namespace tandem::test {
namespace {

double mean(const double (&x)[3]) {
  return (x[0] + x[1] + x[2]) / 3;
}

TEST(World, ABodyFallsAsGalileiSays) {
  WorldOnGround scene(box(1, 1, 1));
  scene.add(shift(0, 0, 100)).velocity[0] = 3;
  World& world = scene.begin();
  ASSERT_EQ(world.step(kStep, 120), Status::kOk);
  EXPECT_NEAR(world.time(), 2, 1e-12);
  EXPECT_NEAR(world.bodies()[1].centre[2], 100 - 0.5 * kGravity * 4, 1e-10);
  EXPECT_NEAR(world.bodies()[1].centre[0], 6, 1e-10);
  EXPECT_NEAR(world.mass_of(1), 1000, 1e-9);
  EXPECT_EQ(world.mass_of(0), 0);
}

TEST(World, ATowerWithGapsComesToRestAsItStands) {
  WorldOnGround scene(box(1, 1, 1));
  for (int i = 0; i < 30; ++i) scene.add(shift(0, 0, 0.5 + 1.00001 * i + 1e-5));
  World& world = scene.begin({.sleeping = false});
  double deepest = 0;
  for (int i = 0; i < 300; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    for (const WorldContact& contact : world.contacts()) deepest = std::max(deepest, contact.depth);
  }
  EXPECT_LT(deepest, 1e-4);
  EXPECT_LT(scene.fastest(), 1e-6);
  for (int i = 1; i <= 30; ++i) EXPECT_NEAR(world.bodies()[i].centre[2], i - 0.5, 1e-3);
}

// Nothing tells before the step that the box in the middle will move.
TEST(World, ABodyThatIsPushedStopsAtTheNextOne) {
  constexpr double kGap = 1e-3;
  WorldOnGround scene(box(1, 1, 1));
  scene.add(shift(0, 0, 5)).filter.motion = Motion::fixed;
  scene.add(shift(1 + kGap, 0, 5));
  scene.add(shift(2 + 2 * kGap, 0, 5)).velocity[0] = -3;
  World& world = scene.begin({.gravity = {0, 0, 0}});
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_GT(world.bodies()[2].centre[0], 1 - kGap) << i;
  }
}

// Each is nearest to the next in one place, but stands in it all around.
TEST(World, FunnelsThatFallIntoEachOtherStandWhereTheyMeet) {
  constexpr double kGap = 3e-4, kWall = 0.01, kSlope = 0.2;
  const auto radius = [](double height) { return static_cast<float>(0.3 + kSlope * height); };
  const auto wall = static_cast<float>(kWall);
  WorldOnGround scene(revolved(
      {{0, 0}, {radius(0), 0}, {radius(1), 1}, {radius(1) - wall, 1}, {radius(wall) - wall, wall}, {0, wall}},
      48));
  for (int i = 0; i < 8; ++i) scene.add(shift(0, 0, kGap + i * (kWall / kSlope + kGap)));
  World& world = scene.begin();
  double fastest = 0;
  for (int i = 0; i < 60; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    fastest = std::max(fastest, scene.fastest());
  }
  EXPECT_LT(fastest, 0.35);
  EXPECT_LT(scene.fastest(), 1e-3);
}

TEST(World, ContactsCarryTheWeight) {
  WorldOnGround scene(box(1, 1, 1));
  scene.add(shift(0, 0, 0.5));
  scene.add(shift(0.2, 0.1, 1.5));
  World& world = scene.begin({.sleeping = false});
  ASSERT_EQ(world.step(kStep, 120), Status::kOk);
  double on_ground = 0, between = 0;
  for (const WorldContact& contact : world.contacts())
    (contact.a == 0 ? on_ground : between) += contact.impulse[2] / kStep;
  EXPECT_NEAR(on_ground, 2000 * kGravity, 0.01 * on_ground);
  EXPECT_NEAR(between, 1000 * kGravity, 0.01 * on_ground);
}

TEST(World, ABounceIsAsHighAsRestitutionSays) {
  for (const auto& [restitution, of_floor] : {std::pair{1.0, -1.0}, {0.8, -1.0}, {0.5, -1.0}, {0.8, 0.0}}) {
    for (double drop = 0.5; drop < 2; drop += 0.17) {
      WorldOnGround scene(sphere(0.5, 3));
      scene.add(shift(0.3, 0.2, 0.5 + drop)).material.restitution = of_floor < 0 ? -1 : restitution;
      World& world = scene.begin({.restitution = of_floor < 0 ? restitution : of_floor});
      double highest = 0;
      for (bool rises = false; world.time() < 2;) {
        ASSERT_EQ(world.step(kStep), Status::kOk);
        const BodyMotion& ball = world.bodies()[1];
        if (rises && ball.velocity[2] < 0) break;
        rises = ball.velocity[2] > 0;
        if (rises) highest = std::max(highest, ball.centre[2] - 0.5);
      }
      EXPECT_NEAR(highest / (restitution * restitution * drop), 1, 0.02) << drop;
    }
  }
}

TEST(World, ABallRollsOn) {
  WorldOnGround scene(sphere(0.5, 6));
  BodyDescription& ball = scene.add(shift(-15, 0, 0.5));
  ball.velocity[0] = 2, ball.angular_velocity[1] = 4;
  World& world = scene.begin({.rolling_resistance = 0});
  ASSERT_EQ(world.step(kStep, 300), Status::kOk);
  EXPECT_NEAR(world.bodies()[1].centre[0], -5, 0.1);  // 10 m; by contacts of a step's start, 9.8
}

// The coin's axis n leans by `lean` and goes round at a steady pace; e points down its side to where it
// touches. What turns the angular momentum is the moment of gravity and of the force that keeps the centre on
// its circle.
TEST(World, ACoinRollsInACircle) {
  constexpr double kRadius = 0.5, kHalf = 0.025, kPace = 1.2, kLean = 70 * 3.14159265358979 / 180;
  const auto radius = static_cast<float>(kRadius), half = static_cast<float>(kHalf);
  const double sine = std::sin(kLean), cosine = std::cos(kLean);
  const double along = kRadius * kRadius / 2, across = along / 2 + kHalf * kHalf / 3;  // inertia of unit mass
  const double lever = kRadius * sine + kHalf * cosine;
  const double gravity = kGravity * (kRadius * cosine - kHalf * sine);
  const double spin = (sine * (across * cosine + kHalf * lever) * kPace * kPace - gravity) /
                      (kPace * (along * sine + kRadius * lever));
  const Vector3 n = {-sine, 0, cosine}, e = {-cosine, 0, -sine};
  const Vector3 omega = spin * n - kPace * sine * e, down = kRadius * e - kHalf * n;
  const Vector3 velocity = -cross(omega, down);
  WorldOnGround scene(revolved({{0, -half}, {radius, -half}, {radius, half}, {0, half}}, 512));
  BodyDescription& coin = scene.add(shift(0, 0, -down.z));
  const Vector3 axes[3] = {cross(n, e), -e, n};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) coin.pose.rotation[i][k] = dynamics::at(axes[k], i);
    coin.velocity[i] = dynamics::at(velocity, i), coin.angular_velocity[i] = dynamics::at(omega, i);
  }
  World& world = scene.begin({.rolling_resistance = 0});
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  const auto& end = world.bodies()[1].pose.rotation;
  const double turned = std::atan2(end[1][2], end[0][2]) - std::atan2(n.y, n.x);
  EXPECT_NEAR(std::remainder(turned - kPace, 6.28318530717959), 0, 0.05 * kPace);
}

TEST(World, ABlockSlidesOnASlopeThatIsSteeperThanTheMeanOfFrictions) {
  const double friction = 0.4;  // of 0.2 and 0.8
  for (const double part : {0.9, 1.1}) {
    const double angle = std::atan(part * friction);
    WorldOnGround scene(box(1, 1, 0.5f));
    scene.bodies[0].material.friction = 0.2;
    scene.add(shift(0, 0, 0.25)).material.friction = 0.8;
    World& world = scene.begin({.gravity = {kGravity * std::sin(angle), 0, -kGravity * std::cos(angle)}});
    ASSERT_EQ(world.step(kStep, 120), Status::kOk);
    const double gained = std::max(0.0, kGravity * (std::sin(angle) - friction * std::cos(angle)));
    EXPECT_NEAR(world.bodies()[1].velocity[0], 2 * gained, 0.02 * gained + 1e-6);
    EXPECT_EQ(world.bodies()[1].sleeps, part < 1);
  }
}

TEST(World, AForceLastsUntilItIsChanged) {
  WorldOnGround scene(box(1, 1, 1));  // a tonne
  scene.add(shift(-10, 0, 0.5)).material.friction = 0.32;
  scene.add(shift(0, 0, 20));
  scene.add(shift(5, 0, 20)).gravity_scale = 0;
  scene.bodies[0].material.friction = 0.5;
  World& world = scene.begin();
  const double friction = 0.4, weight = 1000 * kGravity;
  ASSERT_EQ(world.set_force(1, {6000, 0, 0}, {0, 0, 0}), Status::kOk);
  ASSERT_EQ(world.set_force(2, {0, 0, weight}, {0, 0, 1000.0 / 6}), Status::kOk);
  ASSERT_EQ(world.set_force(0, {0, 0, 1e9}, {0, 0, 0}), Status::kOk);  // it stays where it is
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  EXPECT_NEAR(world.bodies()[1].velocity[0], 6 - friction * kGravity, 1e-3);
  EXPECT_NEAR(world.bodies()[1].centre[0], -10 + 0.5 * (6 - friction * kGravity), 0.02);
  EXPECT_NEAR(world.bodies()[2].angular_velocity[2], 1, 1e-9);
  EXPECT_NEAR(std::atan2(world.bodies()[2].pose.rotation[1][0], world.bodies()[2].pose.rotation[0][0]), 0.5,
              1e-9);
  for (const std::uint32_t body : {2, 3}) EXPECT_NEAR(world.bodies()[body].centre[2], 20, 1e-9);
  EXPECT_EQ(world.bodies()[3].velocity[2], 0);

  // Saved states have their forces.
  std::shared_ptr<const World::State> state;
  ASSERT_EQ(world.save(state), Status::kOk);
  ASSERT_EQ(world.step(kStep, 10), Status::kOk);
  const double then = world.bodies()[1].centre[0];
  ASSERT_EQ(world.set_force(1, {3000, 0, 0}, {0, 0, 0}), Status::kOk);
  ASSERT_EQ(world.step(kStep, 240), Status::kOk);
  EXPECT_TRUE(world.bodies()[1].sleeps);  // friction has stopped it
  ASSERT_EQ(world.set_force(1, {3000, 0, 0}, {0, 0, 0}), Status::kOk);
  EXPECT_TRUE(world.bodies()[1].sleeps);
  ASSERT_EQ(world.set_force(1, {6000, 0, 0}, {0, 0, 0}), Status::kOk);
  EXPECT_FALSE(world.bodies()[1].sleeps);
  ASSERT_EQ(world.restore(*state), Status::kOk);
  ASSERT_EQ(world.step(kStep, 10), Status::kOk);
  EXPECT_EQ(world.bodies()[1].centre[0], then);
}

using Pairs = std::vector<ObjectPair>;

template <typename Row>
Pairs copied(std::span<const Row> rows) {
  Pairs pairs;
  for (const Row& row : rows) pairs.push_back({row.a, row.b});
  return pairs;
}

TEST(World, ABallThatBouncesTwiceBeginsAndEndsToTouchInTheStepsOfTheClosedForm) {
  constexpr double kDrop = 1.3, kRestitution = 0.8;
  constexpr int kSteps = 100;
  // Until a ball meets the ground that is so high above it and rises so fast, in steps.
  const auto falls = [](double height, double rises) {
    const double time = (rises + std::sqrt(rises * rises + 2 * kGravity * height)) / kGravity;
    return static_cast<int>(time / kStep);
  };
  const Pairs touching = {{0, 1}}, none;
  for (const bool in_one_call : {false, true}) {
    WorldOnGround scene(sphere(0.5, 3));
    scene.add(shift(0.3, 0.2, 0.5 + kDrop)).material.restitution = kRestitution;
    World& world = scene.begin();
    if (in_one_call) {
      ASSERT_EQ(world.step(kStep, kSteps), Status::kOk);
      EXPECT_EQ(copied(world.began()), touching);
      EXPECT_EQ(copied(world.ended()), touching);
      EXPECT_TRUE(world.touching().empty());
      ASSERT_EQ(world.step(kStep, 0), Status::kOk);
      EXPECT_TRUE(world.began().empty() && world.ended().empty());
      continue;
    }
    const int first = falls(kDrop, 0);
    int second = kSteps;
    for (int i = 0; i < kSteps; ++i) {
      ASSERT_EQ(world.step(kStep), Status::kOk);
      const bool meets = i == first || i == second;
      EXPECT_EQ(copied(world.touching()), meets ? touching : none) << i;
      EXPECT_EQ(copied(world.began()), meets ? touching : none) << i;
      const BodyMotion& ball = world.bodies()[1];
      if (i == first) second = i + 1 + falls(ball.centre[2] - 0.5, ball.velocity[2]);
      EXPECT_EQ(copied(world.ended()), i == first + 1 || i == second + 1 ? touching : none) << i;
    }
  }
}

// One ball is an island that Newton's method solves, four layers of boxes are not.
TEST(World, WhatTouchesTellsHowHardAsMomentumSays) {
  WorldOnGround ball(sphere(0.5, 3));
  constexpr double kDrop = 1.3, kRestitution = 0.6;
  ball.add(shift(0.3, 0.2, 0.5 + kDrop)).material.restitution = kRestitution;
  World& world = ball.begin();
  double before = 0, hardest = 0, fastest = 0;
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    const double now = world.bodies()[1].velocity[2],
                 needed = world.mass_of(1) * (now - before + kGravity * kStep);
    EXPECT_EQ(world.touching().empty(), world.contacts().empty());
    if (!world.touching().empty()) {
      EXPECT_NEAR(world.touching()[0].impulse, needed, 1e-3 * needed + 1e-9);
      EXPECT_NEAR(std::hypot(world.touching()[0].position[0] - 0.3, world.touching()[0].position[1] - 0.2), 0,
                  0.03);
      EXPECT_NEAR(world.touching()[0].position[2], 0, 0.5 * 5.1 * kStep);  // half-way to where it will be
      hardest = std::max(hardest, world.touching()[0].impulse);
    }
    if (!world.began().empty()) {
      EXPECT_EQ(world.began()[0].impulse, world.touching()[0].impulse);
      EXPECT_EQ(world.began()[0].speed, -before);
      fastest = std::max(fastest, -before);
    }
    before = now;
  }
  const double speed = std::sqrt(2 * kGravity * kDrop);
  EXPECT_NEAR(hardest / (world.mass_of(1) * (1 + kRestitution) * speed), 1, 0.05);
  ASSERT_EQ(ball.begin().step(kStep, 100), Status::kOk);
  EXPECT_EQ(world.began()[0].impulse, hardest);  // of all bounces of the call
  EXPECT_EQ(world.began()[0].speed, fastest);
  EXPECT_NEAR(fastest, speed, kGravity * kStep);

  WorldOnGround heap(box(1, 1, 1));
  for (int i = 0; i < 100; ++i) heap.add(shift(i % 5, i / 5 % 5, 0.8 + i / 25)).velocity[2] = -3;
  World& falls = heap.begin();
  before = -3 * 100;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(falls.step(kStep), Status::kOk);
    double now = 0, told = 0, by_contacts = 0;
    for (const BodyMotion& body : falls.bodies()) now += body.velocity[2];
    const double needed = falls.mass_of(1) * (now - before + 100 * kGravity * kStep);
    for (const WorldTouch& touch : falls.touching()) told += touch.a == 0 ? touch.impulse : 0;
    for (const WorldContact& contact : falls.contacts())
      by_contacts += contact.a == 0 ? contact.impulse[2] : 0;
    EXPECT_NEAR(told, needed, 1e-4 * needed + 1);
    EXPECT_NEAR(by_contacts, needed, 1e-4 * needed + 1);
    before = now;
  }
}

TEST(World, BodiesThatSleepOnEachOtherGoOnTouching) {
  WorldOnGround scene(box(1, 1, 1));
  scene.add(shift(0, 0, 0.5));
  scene.add(shift(0.2, 0.1, 1.5));
  scene.add(shift(4, 0, 0.6));
  World& world = scene.begin();
  ASSERT_EQ(world.step(kStep, 30), Status::kOk);
  const Pairs all = {{0, 1}, {0, 3}, {1, 2}};
  EXPECT_EQ(copied(world.began()), all);
  while (!world.bodies()[2].sleeps || !world.bodies()[3].sleeps) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    ASSERT_LT(world.time(), 5);
  }
  std::shared_ptr<const World::State> state;
  ASSERT_EQ(world.save(state), Status::kOk);
  BodyMotion away = world.bodies()[2];
  away.pose.translation[2] += 2;
  for (const bool again : {false, true}) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_TRUE(world.contacts().empty() && world.began().empty() && world.ended().empty()) << again;
    EXPECT_EQ(copied(world.touching()), all);
    ASSERT_EQ(world.set(2, away), Status::kOk);
    ASSERT_EQ(world.step(kStep), Status::kOk);
    EXPECT_EQ(copied(world.touching()), (Pairs{{0, 1}, {0, 3}}));
    EXPECT_EQ(copied(world.ended()), (Pairs{{1, 2}}));
    ASSERT_EQ(world.restore(*state), Status::kOk);
    EXPECT_TRUE(world.ended().empty());
    EXPECT_EQ(copied(world.touching()), all);
  }
}

// Newton's method solves a box alone, and the soft step a stack of 64.
TEST(World, WhatATurntableCarriesStaysWhereItStands) {
  constexpr double kRadius = 1, kSeconds = 5;
  for (const int boxes : {1, 4}) {
    const double spin = boxes == 1 ? 1.5 : 0.5;  // a stack would fall over
    WorldOnGround scene(box(0.1F, 0.1F, 0.1F));
    scene.bodies[0].filter.motion = Motion::kinematic;
    scene.bodies[0].angular_velocity[2] = spin;
    for (int i = 0; i < boxes * boxes * boxes; ++i) {
      const double x = kRadius + 0.1 * (i % boxes), y = 0.1 * (i / boxes % boxes);
      BodyDescription& body = scene.add(shift(x, y, 0.05 + 0.1 * (i / (boxes * boxes))));
      body.velocity[0] = -spin * y, body.velocity[1] = spin * x, body.angular_velocity[2] = spin;
    }
    World& world = scene.begin();
    for (double t = 0; t < kSeconds - 0.5 * kStep; t += kStep) ASSERT_EQ(world.step(kStep), Status::kOk);
    for (std::uint32_t i = 1; i < world.bodies().size(); ++i) {
      const double* start = scene.bodies[i].pose.translation;
      const double* end = world.bodies()[i].pose.translation;
      EXPECT_NEAR(std::hypot(end[0], end[1]), std::hypot(start[0], start[1]), 1e-3) << boxes;
    }
  }
}

TEST(World, AFixedOrKinematicBodyThatIsSetWakesWhatRestsOnItAndWhatItMeets) {
  for (const Motion motion : {Motion::fixed, Motion::kinematic}) {
    WorldOnGround scene(box(1, 1, 1));
    scene.add(shift(0, 0, 0.5)).filter.motion = motion;
    scene.add(shift(0.2, 0, 1.5));
    scene.add(shift(0.2, 0, 2.5));
    scene.add(shift(6, 0, 0.5));
    World& world = scene.begin();
    const auto sleeps = [&](std::uint32_t body) { return world.bodies()[body].sleeps; };
    ASSERT_EQ(world.step(kStep, 60), Status::kOk);
    if (motion == Motion::fixed) {
      ASSERT_TRUE(sleeps(2) && sleeps(3));
    }
    ASSERT_TRUE(sleeps(4));
    // It is put into the box that stands by itself, and those on it fall.
    BodyMotion there = world.bodies()[1];
    there.pose.translation[0] = 5.01, there.velocity[0] = motion == Motion::fixed ? 1 : 0;
    std::shared_ptr<const World::State> state;
    ASSERT_EQ(world.set(1, there), Status::kOk);
    EXPECT_EQ(world.bodies()[1].velocity[0], 0);
    EXPECT_FALSE(sleeps(2) || sleeps(3));
    EXPECT_TRUE(sleeps(4));
    ASSERT_EQ(world.save(state), Status::kOk);
    for (const bool again : {false, true}) {
      ASSERT_EQ(world.step(kStep), Status::kOk);
      EXPECT_FALSE(sleeps(4)) << again;  // by contact, so a step later
      if (!again) {
        ASSERT_EQ(world.restore(*state), Status::kOk);
      }
    }
    ASSERT_EQ(world.step(kStep, 60), Status::kOk);
    EXPECT_NEAR(world.bodies()[2].centre[2], 0.5, 1e-3);
    EXPECT_GT(world.bodies()[4].centre[0], 6.009);  // out of it, but for the slop
    for (const WorldTouch& pair : world.touching())
      EXPECT_FALSE(pair.a == 0 && pair.b == 1 && motion == Motion::fixed);
  }
}

TEST(World, MaterialsAndGravityMayChangeAndWake) {
  const double slope = std::atan(0.3);
  WorldOnGround scene(box(1, 1, 0.5f));
  scene.add(shift(0, 0, 0.25));
  World& world = scene.begin({.gravity = {kGravity * std::sin(slope), 0, -kGravity * std::cos(slope)}});
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  ASSERT_TRUE(world.bodies()[1].sleeps);
  std::shared_ptr<const World::State> state;
  ASSERT_EQ(world.save(state), Status::kOk);
  ASSERT_EQ(world.set_material(1, {}), Status::kOk);
  EXPECT_TRUE(world.bodies()[1].sleeps);  // it is what it was
  for (const std::uint32_t body : {1, 0}) {
    // Of the block, or of the ground, which is fixed: the mean with 0.5 is 0.2.
    ASSERT_EQ(world.set_material(body, {.friction = 0.08}), Status::kOk);
    EXPECT_FALSE(world.bodies()[1].sleeps);
    ASSERT_EQ(world.step(kStep, 60), Status::kOk);
    const double gained = kGravity * (std::sin(slope) - 0.2 * std::cos(slope));
    EXPECT_NEAR(world.bodies()[1].velocity[0], gained, 0.02 * gained);
    ASSERT_EQ(world.restore(*state), Status::kOk);
    ASSERT_EQ(world.step(kStep, 60), Status::kOk);
    EXPECT_TRUE(world.bodies()[1].sleeps) << body;  // which has its friction again
  }
  ASSERT_EQ(world.set_gravity_scale(1, -0.5), Status::kOk);
  ASSERT_EQ(world.step(kStep, 60), Status::kOk);
  EXPECT_NEAR(world.bodies()[1].velocity[2], 0.5 * kGravity * std::cos(slope), 1e-9);
  ASSERT_EQ(world.restore(*state), Status::kOk);
  EXPECT_TRUE(world.bodies()[1].sleeps);
  EXPECT_EQ(world.set_gravity_scale(2, 1), Status::kUnknownInstance);
  EXPECT_EQ(world.set_gravity_scale(1, kNan), Status::kOutOfRange);
  EXPECT_EQ(world.set_material(1, {.restitution = 1.5}), Status::kOutOfRange);
}

TEST(World, ARodThatSpinsFastKeepsItsEnergy) {
  WorldOnGround scene(box(1, 0.04f, 0.04f));
  BodyDescription& rod = scene.add(shift(0, 0, 5));
  rod.angular_velocity[0] = 3, rod.angular_velocity[2] = 60;
  World& world = scene.begin({.gravity = {0, 0, 0}});
  const double spin = norm(vector_of(world.bodies()[1].angular_velocity));
  for (int i = 0; i < 300; ++i) {
    ASSERT_EQ(world.step(kStep), Status::kOk);
    ASSERT_NEAR(norm(vector_of(world.bodies()[1].angular_velocity)) / spin, 1, 0.01) << i;
  }
}

// Adds 40 bodies in layers of three by three, turned at random, whose heights `height` gives.
template <typename Height>
void strew(WorldOnGround& scene, std::uint64_t seed, double apart, const Height& height) {
  RandomPoses random(seed);
  for (int i = 0; i < 40; ++i) {
    const Pose turned = any_motion(random, 0);
    scene.add(after(shift(apart * (i % 3 - 1), apart * (i / 3 % 3 - 1), height(i)), turned));
  }
}

bool all_sleep(const World& world) {
  return std::all_of(world.bodies().begin() + 1, world.bodies().end(),
                     [](const BodyMotion& body) { return body.sleeps; });
}

TEST(World, HeapsComeToRestAndSleep) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    SCOPED_TRACE(seed);
    WorldOnGround scene(box(1, 0.4f, 0.25f));
    strew(scene, seed, 0.4, [](int i) { return 1 + 0.5 * i / 9; });
    World& world = scene.begin();
    ASSERT_EQ(world.step(kStep, 900), Status::kOk);
    EXPECT_TRUE(std::all_of(world.bodies().begin() + 1, world.bodies().end(),
                            [](const BodyMotion& body) { return body.centre[2] > 0.12; }));
    EXPECT_TRUE(all_sleep(world));
    EXPECT_EQ(scene.fastest(), 0);
    const double up[3] = {0, 0, 5};
    ASSERT_EQ(world.push(7, up, world.bodies()[7].centre), Status::kOk);
    EXPECT_FALSE(world.bodies()[7].sleeps);
    EXPECT_NEAR(world.bodies()[7].velocity[2], 5 / world.mass_of(7), 1e-12);
  }
}

// Plates that lie on edges of others would rock for ever if only one end of an edge were a deep contact.
TEST(World, HeapsOfPlatesComeToRest) {
  for (const std::uint64_t seed : {3, 6, 8, 17, 20, 23}) {
    SCOPED_TRACE(seed);
    WorldOnGround scene(box(0.5f, 0.5f, 0.02f));
    strew(scene, seed, 0.5, [](int i) { return 0.6 + 0.6 * (i / 9); });
    ASSERT_EQ(scene.begin().step(kStep, 600), Status::kOk);
    EXPECT_TRUE(all_sleep(scene.world));
  }
}

TEST(World, ContinuousMotionBringsNoEnergy) {
  RandomPoses random(2);
  for (int heap = 0; heap < trials(4, 10); ++heap) {
    WorldOnGround scene(heap % 2 == 0 ? box(1, 0.04f, 0.04f) : box(0.5f, 0.5f, 0.02f));
    for (int i = 0; i < 20; ++i)
      scene.add(after(shift(0.5 * (i % 3), 0.5 * (i / 3 % 3), 0.8 + 0.3 * i), any_motion(random, 0)));
    World& world = scene.begin({.continuous = true});
    const auto energy = [&] {
      double sum = scene.kinetic_energy();
      for (std::uint32_t i = 1; i < scene.bodies.size(); ++i)
        sum += world.mass_of(i) * kGravity * world.bodies()[i].centre[2];
      return sum;
    };
    const double start = energy();
    for (int i = 0; i < 180; ++i) {
      ASSERT_EQ(world.step(kStep), Status::kOk);
      ASSERT_LT(energy(), 1.01 * start) << i;
    }
  }
}

// A spin about the long axis, kept in the world while the rod is stopped before it has turned so far, would
// be one about another axis, with 300 times the energy.
TEST(World, ARodThatSpinsAboutItsAxisGainsNothingWhereItIsStopped) {
  RandomPoses random(4);
  for (int trial = 0; trial < trials(20, 10); ++trial) {
    WorldOnGround scene(box(1, 0.04f, 0.04f));
    BodyDescription& rod = scene.add(after(shift(0, 0, 2), any_motion(random, 0)));
    const Vector3 spin = rotate(rod.pose, {300, random.symmetric(20), random.symmetric(20)});
    rod.angular_velocity[0] = spin.x, rod.angular_velocity[1] = spin.y, rod.angular_velocity[2] = spin.z;
    rod.velocity[2] = -30;
    World& world = scene.begin({.gravity = {0, 0, 0}, .sleeping = false, .continuous = true});
    const auto energy = [&] {
      const Pose& pose = world.bodies()[1].pose;
      const Vector3 w = vector_of(world.bodies()[1].angular_velocity);
      const double mass = world.mass_of(1), thin = mass / 6 * 0.04 * 0.04,
                   across = mass / 12 * (1 + 0.04 * 0.04);
      const double along = dot(w, rotate(pose, {1, 0, 0}));
      return scene.kinetic_energy() + 0.5 * (thin * along * along + across * (dot(w, w) - along * along));
    };
    const double start = energy();
    for (int i = 0; i < 30; ++i) {
      ASSERT_EQ(world.step(kStep), Status::kOk);
      ASSERT_LT(energy(), 1.5 * start) << trial << ' ' << i;
    }
  }
}

TEST(World, GoesBackToWhatWasSavedAndDoesNotDependOnThreads) {
  std::vector<BodyMotion> ends[3];
  for (int run = 0; run < 2; ++run) {
    WorldOnGround scene(tetrahedron());
    RandomPoses random(3);
    for (int i = 0; i < 30; ++i)
      scene.add(after(shift(0.7 * (i % 3), 0.7 * (i / 3 % 3), 1 + 0.3 * i), any_motion(random, 0)));
    World& world = scene.begin({.threads = run == 0 ? 1u : 3u});
    ASSERT_EQ(world.step(kStep, 60), Status::kOk);
    std::shared_ptr<const World::State> state;
    ASSERT_EQ(world.save(state), Status::kOk);
    for (const int end : {run, 2}) {
      ASSERT_EQ(world.restore(*state), Status::kOk);
      ASSERT_EQ(world.step(kStep, 60), Status::kOk);
      ends[end].assign(world.bodies().begin(), world.bodies().end());
      EXPECT_NEAR(world.time(), 2, 1e-12);
    }
    for (std::size_t i = 0; i < ends[2].size(); ++i) {
      EXPECT_EQ(mean(ends[run][i].centre), mean(ends[2][i].centre));
      EXPECT_EQ(mean(ends[0][i].centre), mean(ends[run][i].centre));
    }
    ASSERT_EQ(world.set_bodies(scene.bodies), Status::kOk);
    EXPECT_EQ(world.restore(*state), Status::kKeptMismatch);
  }
}

#ifdef __linux__

// The scenes of a world and its solver work by turns, and share their threads.
TEST(World, StartsNoMoreThreadsThanItWasTold) {
  const auto threads = [] {
    std::size_t count = 0;
    for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task"))
      count += thread.exists();
    return count;
  };
  const std::size_t before = threads();
  WorldOnGround scene(tetrahedron());
  for (int i = 0; i < 200; ++i) scene.add(shift(i % 14, i / 14 % 14, 0.4));
  ASSERT_EQ(scene.begin({.continuous = true, .threads = 4}).step(kStep, 20), Status::kOk);
  EXPECT_EQ(threads(), before + 3);
}

#endif

}  // namespace
// A plate that stands on the ground to the last bit, or barely above it, slides by v^2 / (2 friction g).
TEST(World, ContinuousMotionLetsPlatesSlide) {
  constexpr double kSpeed = 8, kFriction = 0.5;
  for (const double gap : {0.0, 1e-9, 1e-6, 1e-4}) {
    SCOPED_TRACE(gap);
    WorldOnGround scene(box(1, 1, 0.02f));
    scene.add(shift(0, 0, 0.01 + gap)).velocity[0] = kSpeed;
    World& world = scene.begin({.friction = kFriction, .continuous = true});
    EXPECT_EQ(world.step(kStep, 150), Status::kOk);
    EXPECT_NEAR(world.bodies()[1].centre[0], kSpeed * kSpeed / (2 * kFriction * kGravity), 0.1);
    EXPECT_NEAR(world.bodies()[1].centre[2], 0.01, 1e-3);
  }
}

// Their edges land in turn, and what pushes an edge out again must not keep them rolling.
TEST(World, CoarseBodiesThatRollComeToRest) {
  for (const Mesh& mesh : {cup(12, 0.15F, 0.3F, 0.03F), sphere(0.2, 2)}) {
    WorldOnGround scene(mesh);
    RandomPoses random(7);
    for (int i = 0; i < 8; ++i) {
      BodyDescription& body = scene.add(any_motion(random, 0.01));
      body.pose.translation[0] += 2 * i - 8, body.pose.translation[2] += 0.4;
      body.velocity[1] = 0.5 + 0.1 * i;
    }
    World& world = scene.begin();
    ASSERT_EQ(world.step(kStep, 1500), Status::kOk);
    for (const BodyMotion& body : world.bodies().subspan(1)) EXPECT_TRUE(body.sleeps);
  }
}

}  // namespace tandem::test
