#include <gtest/gtest.h>

#include <cmath>

#include "analytic_contacts.h"

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kGravity = 9.81, kRadius = 0.5, kMass = 3;

// A ball on a plane that falls towards +x, for solvers that know rolling resistance.
class Rolling : public testing::TestWithParam<SolverKind> {
 protected:
  Simulator ball(double slope, double resistance, const Vector3d& velocity = Vector3d::Zero(),
                 const Vector3d& spin = Vector3d::Zero(), Motion plane = Motion::fixed,
                 const Vector3d& plane_spin = Vector3d::Zero()) const {
    SimulatorOptions options;
    options.solver.kind = GetParam();
    options.solver.rolling_resistance = resistance;
    const Vector3d normal = {std::sin(slope), 0, std::cos(slope)};
    std::vector<BodyProperties> bodies = {fixed_body(), ball_body(kRadius, kMass)};
    bodies[0].motion = plane;
    std::vector<BodyState> states(2);
    states[0].angular_velocity = plane_spin;
    states[1].position = (kRadius - options.solver.slop) * normal;
    states[1].velocity = velocity;
    states[1].angular_velocity = spin;
    return Simulator(bodies, states, balls_on_plane(normal, kRadius), options);
  }

  static const BodyState& after(Simulator& simulator, double seconds) {
    for (int i = 0; i < std::lround(60 * seconds); ++i) simulator.step();
    return simulator.states()[1];
  }
};

INSTANTIATE_TEST_SUITE_P(Solvers, Rolling,
                         testing::Values(SolverKind::automatic, SolverKind::soft, SolverKind::newton),
                         [](const testing::TestParamInfo<SolverKind>& tested) -> std::string {
                           return tested.param == SolverKind::automatic ? "automatic"
                                  : tested.param == SolverKind::soft    ? "soft"
                                                                        : "newton";
                         });

TEST_P(Rolling, ABallRollsDownASlopeAsTheClosedFormSays) {
  for (const double slope : {0.1, 0.3}) {
    for (const double resistance : {0.0, 0.0005, 0.02}) {
      Simulator simulator = ball(slope, resistance);
      const BodyState& end = after(simulator, 3);
      const double speed =
          5.0 / 7 * kGravity * (std::sin(slope) - resistance / kRadius * std::cos(slope)) * 3;
      EXPECT_NEAR(end.velocity.norm() / speed, 1, 1e-3) << slope << " " << resistance;
      EXPECT_NEAR(end.angular_velocity.y() * kRadius / speed, 1, 1e-3) << slope << " " << resistance;
    }
  }
}

TEST_P(Rolling, ABallStaysOnASlopeThatIsNoSteeperThanItsLever) {
  Simulator held = ball(0.99 * std::atan(0.02 / kRadius), 0.02);
  const Vector3d start = held.states()[1].position;
  EXPECT_LT((after(held, 3).position - start).norm(), 1e-4);
  Simulator rolls = ball(1.05 * std::atan(0.02 / kRadius), 0.02);
  EXPECT_GT((after(rolls, 3).position - start).norm(), 0.04);
}

TEST_P(Rolling, ABallThatRollsOnAPlaneStopsWhereTheClosedFormSays) {
  constexpr double kSpeed = 1, kResistance = 0.05;
  const double way = 0.7 * kSpeed * kSpeed * kRadius / (kGravity * kResistance);
  const Vector3d velocity = kSpeed * Vector3d(0.6, 0.8, 0);
  Simulator simulator = ball(0, kResistance, velocity, Vector3d::UnitZ().cross(velocity) / kRadius);
  const BodyState& end = after(simulator, 3);
  EXPECT_NEAR(end.position.head<2>().norm() / way, 1, 0.005);
  EXPECT_NEAR(end.position.head<2>().normalized().dot(velocity.head<2>() / kSpeed), 1, 1e-6);
  EXPECT_LT(end.velocity.norm(), 1e-5);
  EXPECT_LT(end.angular_velocity.norm(), 1e-5);
}

TEST_P(Rolling, ABallThatSpinsOnTheSpotStopsAfterTheTimeOfTheClosedForm) {
  constexpr double kSpin = 4, kResistance = 0.02;
  const double time = kSpin * 0.4 * kRadius * kRadius / (kGravity * kResistance);
  Simulator simulator = ball(0, kResistance, Vector3d::Zero(), kSpin * Vector3d::UnitZ());
  EXPECT_NEAR(after(simulator, time / 2).angular_velocity.z() / kSpin, 0.5, 0.005);
  EXPECT_LT(after(simulator, time / 2 + 0.1).angular_velocity.norm(), 1e-5);
}

TEST_P(Rolling, ATableThatTurnsTakesABallAlong) {
  constexpr double kSpin = 0.3;
  Simulator simulator =
      ball(0, 0.02, Vector3d::Zero(), Vector3d::Zero(), Motion::kinematic, kSpin * Vector3d::UnitZ());
  const BodyState& end = after(simulator, 2);
  EXPECT_NEAR(end.angular_velocity.z(), kSpin, 1e-6);
}

}  // namespace
}  // namespace tandem::simulation
