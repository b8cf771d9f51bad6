#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "dynamics/world_on_ground.h"

/// What is no scene gets a named error, and what is a strange one a state of finite numbers.
namespace tandem::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNoNumbers[] = {kNan, kInfinity, -kInfinity};

template <typename... Vectors>
bool are_finite(const Vectors&... vectors) {
  return (std::ranges::all_of(vectors, [](double x) { return std::isfinite(x); }) && ...);
}

void expect_finite(const World& world) {
  for (const BodyMotion& body : world.bodies()) {
    const auto& turned = body.pose.rotation;
    EXPECT_TRUE(are_finite(turned[0], turned[1], turned[2], body.pose.translation, body.centre, body.velocity,
                           body.angular_velocity));
  }
  for (const WorldContact& contact : world.contacts())
    EXPECT_TRUE(are_finite(contact.position, contact.normal, contact.impulse) &&
                std::isfinite(contact.depth));
}

// Steps until the end or an error, which has to be that of a body that left the range of numbers.
void expect_finite_steps(World& world, int steps, double dt = kStep) {
  for (int i = 0; i < steps; ++i) {
    const Status status = world.step(dt);
    expect_finite(world);
    if (status == Status::kOk) continue;
    EXPECT_EQ(status, Status::kOutOfRange);
    EXPECT_LT(world.where(), world.bodies().size());
    return;
  }
}

Mesh turned_inside_out(Mesh mesh, std::size_t triangles) {
  for (std::size_t i = 0; i < triangles; ++i) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
  return mesh;
}

Mesh without_last(Mesh mesh, std::size_t triangles) {
  mesh.triangles.resize(mesh.triangles.size() - triangles);
  return mesh;
}

TEST(WrongInput, ABodyThatIsNoneIsRefusedByName) {
  WorldOnGround scene(box(1, 1, 1));
  scene.add(shift(0, 0, 5));
  World& world = scene.begin();
  const auto refused = [&](const std::function<void(BodyDescription&)>& change, Status expected) {
    std::vector<BodyDescription> bodies = scene.bodies;
    change(bodies[1]);
    EXPECT_EQ(world.set_bodies(bodies), expected);
    EXPECT_EQ(world.where(), 1u);
    EXPECT_TRUE(world.bodies().empty());
  };
  for (const double x : kNoNumbers) {
    refused([=](BodyDescription& body) { body.pose.translation[1] = x; }, Status::kPoseNotRigid);
    refused([=](BodyDescription& body) { body.pose.rotation[1][2] = x; }, Status::kPoseNotRigid);
    refused([=](BodyDescription& body) { body.density = x; }, Status::kNoMass);
    refused([=](BodyDescription& body) { body.velocity[1] = x; }, Status::kOutOfRange);
    refused([=](BodyDescription& body) { body.angular_velocity[2] = x; }, Status::kOutOfRange);
    refused([=](BodyDescription& body) { body.gravity_scale = x; }, Status::kOutOfRange);
  }
  refused([](BodyDescription& body) { body.asset = 2; }, Status::kUnknownAsset);
  refused([](BodyDescription& body) { body.pose.rotation[0][0] = 2; }, Status::kPoseNotRigid);
  refused([](BodyDescription& body) { body.density = 0; }, Status::kNoMass);
  refused([](BodyDescription& body) { body.density = 1e-300; }, Status::kOutOfRange);
  refused([](BodyDescription& body) { body.density = 1e300; }, Status::kOutOfRange);
  refused([](BodyDescription& body) { body.velocity[1] = 1e11; }, Status::kOutOfRange);
  refused([](BodyDescription& body) { body.angular_velocity[0] = -1e200; }, Status::kOutOfRange);
  refused([](BodyDescription& body) { body.gravity_scale = 1e300; }, Status::kOutOfRange);
  for (const double x : {kNan, kInfinity}) {
    refused([=](BodyDescription& body) { body.material.friction = x; }, Status::kOutOfRange);
    refused([=](BodyDescription& body) { body.material.restitution = x; }, Status::kOutOfRange);
    refused([=](BodyDescription& body) { body.material.rolling_resistance = x; }, Status::kOutOfRange);
  }
  refused([](BodyDescription& body) { body.material.restitution = 1.1; }, Status::kOutOfRange);
  refused([](BodyDescription& body) { body.material.rolling_resistance = 2e6; }, Status::kOutOfRange);
}

TEST(WrongInput, OptionsThatAreNoneAreRefusedByName) {
  WorldOnGround scene(box(1, 1, 1));
  World& world = scene.begin();
  for (const double x : {kNan, kInfinity}) {
    for (const WorldOptions& options :
         {WorldOptions{.gravity = {0, 0, x}}, WorldOptions{.friction = x}, WorldOptions{.restitution = x},
          WorldOptions{.slop = x}, WorldOptions{.rolling_resistance = x}})
      EXPECT_EQ(world.set_bodies(scene.bodies, options), Status::kBadOption);
  }
  for (const WorldOptions& options :
       {WorldOptions{.friction = -1}, WorldOptions{.restitution = 1.1}, WorldOptions{.substeps = 0},
        WorldOptions{.substeps = 10'001}, WorldOptions{.threads = 0}})
    EXPECT_EQ(world.set_bodies(scene.bodies, options), Status::kBadOption);
}

TEST(WrongInput, AStepOfNoDurationChangesNothing) {
  WorldOnGround scene(box(1, 1, 1));
  scene.add(shift(0, 0, 5));
  World& world = scene.begin();
  for (const double dt : {0.0, -0.0, -kStep, kNan, kInfinity, -kInfinity, 1000.1, 1e300}) {
    EXPECT_EQ(world.step(dt), Status::kBadDuration);
    EXPECT_EQ(world.time(), 0);
    EXPECT_EQ(world.bodies()[1].centre[2], 5);
  }
}

TEST(WrongInput, StepsOfAnyDurationLeaveFiniteNumbers) {
  for (const double dt : {5e-324, 1e-300, 1e-9, 0.5, 10.0, 1000.0}) {
    WorldOnGround scene(box(1, 1, 1));
    scene.add(shift(0, 0, 0.5));
    scene.add(shift(0.1, 0, 1.6));
    expect_finite_steps(scene.begin(), 20, dt);
    EXPECT_GT(scene.world.time(), 0);
  }
}

TEST(WrongInput, ChangesThatAreNoneAreRefusedByName) {
  WorldOnGround scene(box(1, 1, 1));
  scene.add(shift(0, 0, 5));
  World& world = scene.begin();
  const BodyMotion motion = world.bodies()[1];
  const double none[3] = {};
  EXPECT_EQ(world.set(2, motion), Status::kUnknownInstance);
  EXPECT_EQ(world.push(9, {1, 0, 0}, none), Status::kUnknownInstance);
  EXPECT_EQ(world.set_force(9, {1, 0, 0}, none), Status::kUnknownInstance);
  for (const double x : kNoNumbers) {
    BodyMotion changed = motion;
    changed.pose.translation[0] = x;
    EXPECT_EQ(world.set(1, changed), Status::kPoseNotRigid);
    changed = motion, changed.velocity[2] = x;
    EXPECT_EQ(world.set(1, changed), Status::kOutOfRange);
    changed = motion, changed.angular_velocity[0] = x;
    EXPECT_EQ(world.set(1, changed), Status::kOutOfRange);
    EXPECT_EQ(world.push(1, {x, 0, 0}, none), Status::kOutOfRange);
    EXPECT_EQ(world.push(1, {1, 0, 0}, {0, x, 0}), Status::kOutOfRange);
    EXPECT_EQ(world.set_force(1, {0, 0, x}, none), Status::kOutOfRange);
    EXPECT_EQ(world.set_force(1, none, {0, 0, x}), Status::kOutOfRange);
  }
  EXPECT_EQ(world.push(1, {1e15, 0, 0}, none), Status::kOutOfRange);
  EXPECT_EQ(world.set_force(1, {1e300, 0, 0}, none), Status::kOutOfRange);
  EXPECT_EQ(world.set_force(1, none, {0, 1e15, 0}), Status::kOutOfRange);
  EXPECT_EQ(world.bodies()[1].velocity[0], 0);
  EXPECT_EQ(world.step(kStep), Status::kOk);
  EXPECT_NEAR(world.bodies()[1].velocity[2], -kGravity * kStep, 1e-12);
}

// Where a triangle is missing, lines through the hole tell no depth: such boxes may throw each other about.
TEST(WrongInput, MeshesThatAreNotClosedOrInsideOutComeToRestOrKeepFinite) {
  const Mesh cube = box(1, 1, 1);
  const struct {
    const char* name;
    Mesh mesh;
    double mass;  // of a shell: area * thickness, a hundredth of the diagonal
    bool rests = true;
  } cases[] = {{"closed", cube, 1000},
               {"inside out", turned_inside_out(cube, 12), 1000},
               {"half inside out", turned_inside_out(cube, 6), 1000},
               {"without a side", without_last(cube, 2), 5000 * 0.01 * std::sqrt(3)},
               {"without a triangle", without_last(cube, 1), 5500 * 0.01 * std::sqrt(3), false}};
  for (const auto& [name, mesh, mass, rests] : cases) {
    for (const bool continuous : {false, true}) {
      SCOPED_TRACE(std::string(name) + (continuous ? ", continuous" : ""));
      WorldOnGround scene(mesh);
      scene.add(shift(0, 0, 1));
      scene.add(shift(0.2, 0.1, 2.5));
      World& world = scene.begin({.continuous = continuous});
      EXPECT_NEAR(world.mass_of(1), mass, 1e-6 * mass);
      expect_finite_steps(world, 300);
      if (!rests) continue;
      EXPECT_LT(scene.fastest(), 1e-6);
      EXPECT_NEAR(world.bodies()[1].pose.translation[2], 0.5, 0.01);
      // Nothing keeps a shell out of a hole of another one.
      const double height = world.bodies()[2].pose.translation[2];
      EXPECT_NEAR(height, mass == 1000 || height > 1 ? 1.5 : 0.5, 0.01);
    }
  }
}

TEST(WrongInput, BodiesInsideEachOtherComeApart) {
  for (const Mesh& mesh : {box(1, 1, 1), turned_inside_out(box(1, 1, 1), 12), sphere(0.5, 2)}) {
    for (const bool continuous : {false, true}) {
      for (const double apart : {0.0, 0.1}) {
        WorldOnGround scene(mesh);
        RandomPoses random(5);
        const auto offset = [&] { return random.symmetric(apart); };
        for (int i = 0; i < 20; ++i) scene.add(shift(offset(), offset(), 1.5 + offset()));
        World& world = scene.begin({.continuous = continuous});
        expect_finite_steps(world, 180);
        double widest = 0;
        for (const BodyMotion& body : world.bodies().subspan(1))
          widest = std::max(widest, std::fabs(body.centre[0]) + std::fabs(body.centre[1]));
        EXPECT_GT(widest, 0.5);  // a heap of 20 cannot be as narrow
      }
    }
  }
}

TEST(WrongInput, ABodyThatStartsInsideTheGroundStaysFinite) {
  for (const double height : {-0.3, -1.0, -1.7}) {
    WorldOnGround scene(box(1, 1, 1));
    scene.add(shift(0, 0, height));
    expect_finite_steps(scene.begin(), 240);
  }
}

TEST(WrongInput, AMillionMetresASecondAgainstAWallOfAPlate) {
  for (const double speed : {1e3, 1e6, 1e9}) {
    for (const bool continuous : {false, true}) {
      SCOPED_TRACE(std::to_string(speed) + (continuous ? ", continuous" : ""));
      WorldOnGround scene(box(1, 1, 1));
      scene.add(shift(-20.1, 0.1, 0.2)).velocity[0] = speed;
      scene.bodies[0].pose = turn(1, std::acos(0.0));
      World& world = scene.begin({.gravity = {0, 0, 0}, .continuous = continuous});
      expect_finite_steps(world, 60);
      const double x = world.bodies()[1].centre[0];
      if (continuous)
        EXPECT_NEAR(x, -1.5, 0.01);  // on the near side of the slab
      else
        EXPECT_GT(x, 2);  // it is past the slab after its first step
    }
  }
}

TEST(WrongInput, FastSpinsAndHeavyOrLightBodiesStayFinite) {
  for (const double x : {1e3, 1e6, 1e9}) {
    WorldOnGround scene(box(1, 1, 1));
    BodyDescription& spun = scene.add(shift(0, 0, 0.9));
    spun.angular_velocity[0] = x, spun.angular_velocity[1] = 0.3 * x, spun.angular_velocity[2] = 0.1 * x;
    scene.add(shift(0.1, 0, 2.5));
    expect_finite_steps(scene.begin(), 60);
    for (const double density : {x, 1 / x, x * x, 1 / (x * x), x * x * x, 1 / (x * x * x)}) {
      scene.bodies[1].density = density;
      expect_finite_steps(scene.begin(), 60);
    }
  }
}

TEST(WrongInput, WhatLeavesTheRangeOfNumbersIsToldAndTheRestStaysAsItWas) {
  WorldOnGround scene(box(1, 1, 1));
  scene.add(shift(0, 0, 0.5));
  scene.add(shift(5, 0, 5)).velocity[2] = 0.99e10;
  World& world = scene.begin({.sleeping = false});
  ASSERT_EQ(world.step(kStep), Status::kOk);
  ASSERT_FALSE(world.contacts().empty());
  const double before = world.bodies()[2].centre[2];
  ASSERT_EQ(world.set_force(2, {0, 0, 9e12}, {0, 0, 0}), Status::kOk);
  EXPECT_EQ(world.step(kStep, 3), Status::kOutOfRange);
  EXPECT_EQ(world.where(), 2u);
  EXPECT_EQ(world.bodies()[2].centre[2], before);
  EXPECT_TRUE(world.contacts().empty());
  expect_finite(world);
  ASSERT_EQ(world.set_force(2, {0, 0, 0}, {0, 0, 0}), Status::kOk);
  EXPECT_EQ(world.step(kStep), Status::kOk);
  EXPECT_GT(world.bodies()[2].centre[2], before);
}

}  // namespace
}  // namespace tandem::test
