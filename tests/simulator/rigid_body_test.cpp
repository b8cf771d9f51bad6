#include "bvhbench/simulator/rigid_body.h"

#include <gtest/gtest.h>

#include "analytic_contacts.h"

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kRounding = 1e-12;

// A plate that turns mostly about its middle axis, about which rotation is unstable.
BodyState tumbling() {
  BodyState state;
  state.position = {1, 2, 3};
  state.velocity = {0.5, -1, 0.25};
  state.angular_velocity = {0.01, 6, 0.02};
  return state;
}

SimulatorOptions weightless() {
  SimulatorOptions options;
  options.gravity.setZero();
  return options;
}

TEST(RigidBody, FreeFlightKeepsMomentumToRounding) {
  const BodyProperties plate = box_body({1, 2, 0.1}, 7);
  Simulator simulator({plate}, {tumbling()}, no_contacts(), weightless());
  const Vector3d linear = 7 * tumbling().velocity, angular = angular_momentum(plate, tumbling());
  for (int i = 0; i < 3600; ++i) {
    const StepRecord record = simulator.step();
    ASSERT_LE((record.linear_momentum - linear).norm(), kRounding * linear.norm());
    ASSERT_LE((record.angular_momentum - angular).norm(), 10 * kRounding * angular.norm()) << i;
  }
}

TEST(RigidBody, FreeRotationKeepsItsEnergyWithinTheBoundsOfItsMomentum) {
  const BodyProperties plate = box_body({1, 2, 0.1}, 7);
  for (const double dt : {1.0 / 240, 1.0 / 60, 0.5}) {
    BodyState state = tumbling();
    const double momentum = (plate.inertia * state.angular_velocity).squaredNorm();
    for (int i = 0; i < 2000; ++i) {
      advance(plate, state, Vector3d::Zero(), Vector3d::Zero(), dt);
      BodyState still = state;
      still.velocity.setZero();
      const double energy = kinetic_energy(plate, still);
      ASSERT_LE(energy, (1 + 1e-9) * momentum / (2 * plate.inertia.diagonal().minCoeff()));
      ASSERT_GE(energy, (1 - 1e-9) * momentum / (2 * plate.inertia.diagonal().maxCoeff()));
    }
  }
}

TEST(RigidBody, FreeRotationKeepsItsEnergyWhereStepsAreSmall) {
  const BodyProperties plate = box_body({1, 2, 0.1}, 7);
  BodyState state = tumbling();
  const double before = kinetic_energy(plate, state);
  for (int i = 0; i < 2400; ++i) advance(plate, state, Vector3d::Zero(), Vector3d::Zero(), 1.0 / 240);
  EXPECT_NEAR(kinetic_energy(plate, state) / before, 1, 1e-3);
}

TEST(RigidBody, FallsAsSemiImplicitEulerDoes) {
  SimulatorOptions options;
  Simulator simulator({box_body({1, 1, 1}, 2)}, {BodyState()}, no_contacts(), options);
  constexpr int kSteps = 120;
  for (int i = 0; i < kSteps; ++i) simulator.step();
  const double dt = options.dt;
  EXPECT_NEAR(simulator.states()[0].velocity.z(), -9.81 * kSteps * dt, 1e-12);
  EXPECT_NEAR(simulator.states()[0].position.z(), -9.81 * dt * dt * kSteps * (kSteps + 1) / 2, 1e-11);
}

TEST(RigidBody, PosesAreRigidAfterManySteps) {
  const BodyProperties plate = box_body({1, 2, 0.1}, 7);
  BodyState state = tumbling();
  for (int i = 0; i < 100'000; ++i) advance(plate, state, Vector3d::Zero(), Vector3d::Zero(), 1.0 / 60);
  EXPECT_TRUE(is_rigid(pose_of(plate, state).pose));
}

TEST(RigidBody, StateOfAPoseGivesThePose) {
  BodyProperties body = box_body({1, 2, 3}, 1);
  body.center = {0.25, -0.5, 4};
  BodyState state = tumbling();
  state.orientation = Eigen::Quaterniond(0.1, -0.7, 0.3, 0.5).normalized();
  const Pose pose = pose_of(body, state).pose, again = pose_of(body, state_of(body, pose)).pose;
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(pose.translation[i], again.translation[i], 1e-14);
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(pose.rotation[i][j], again.rotation[i][j], 1e-15);
  }
}

}  // namespace
}  // namespace tandem::simulation
