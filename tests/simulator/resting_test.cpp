#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "analytic_contacts.h"
#include "kernels/manifold/manifold_scene.h"

namespace tandem::simulation {
namespace {

// Boxes on top of each other on the plane, each as deep in the next as the slop.
std::vector<BodyState> tower(int boxes, double height, double slop) {
  std::vector<BodyState> states(static_cast<std::size_t>(boxes) + 1);
  for (int i = 1; i <= boxes; ++i) states[i].position.z = height * (i - 0.5) - slop * i;
  return states;
}

std::vector<BodyProperties> bodies_with(int boxes, const Vector3& size) {
  std::vector<BodyProperties> bodies(static_cast<std::size_t>(boxes) + 1, box_body(size, 1));
  bodies[0] = fixed_body();
  return bodies;
}

SimulatorOptions options_of(SolverMethod solver) {
  SimulatorOptions options;
  options.solver.method = solver;
  return options;
}

// Tests of what holds whatever solves the steps.
class EverySolver : public testing::TestWithParam<SolverMethod> {};

std::string name_of(const testing::TestParamInfo<SolverMethod>& tested) {
  switch (tested.param) {
    case SolverMethod::automatic:
      return "automatic";
    case SolverMethod::soft:
      return "soft";
    case SolverMethod::newton:
      return "newton";
    default:
      return "sweeps";
  }
}

INSTANTIATE_TEST_SUITE_P(Solvers, EverySolver,
                         testing::Values(SolverMethod::automatic, SolverMethod::soft, SolverMethod::newton,
                                         SolverMethod::sweeps),
                         name_of);

// A block on a slope that falls towards +x.
struct Slope {
  explicit Slope(double degrees) : angle(degrees * M_PI / 180), normal{std::sin(angle), 0, std::cos(angle)} {}

  Vector3 downhill() const { return {std::cos(angle), 0, -std::sin(angle)}; }
  BodyState resting(double height, double slop) const {
    BodyState state;
    state.orientation = rotation_by({0, angle, 0});
    state.position = (0.5 * height - slop) * normal;
    return state;
  }

  double angle;
  Vector3 normal;
};

Simulator block_on(const Slope& slope, const Vector3& size, const SimulatorOptions& options,
                   const Material& ground = {}, const Material& block = {}) {
  std::vector<BodyProperties> bodies = bodies_with(1, size);
  bodies[0].material = ground, bodies[1].material = block;
  return Simulator(std::move(bodies), {BodyState(), slope.resting(size.z, options.solver.slop)},
                   boxes_on_plane(slope.normal, size), options);
}

TEST_P(EverySolver, ABlockSlidesAsTheClosedFormSays) {
  for (const auto& [degrees, friction] : {std::pair{30.0, 0.3}, {20.0, 0.1}, {40.0, 0.0}}) {
    const Slope slope(degrees);
    SimulatorOptions options = options_of(GetParam());
    options.solver.friction = friction;
    const Vector3 flat = {1, 1, 0.2};
    Simulator simulator = block_on(slope, flat, options);
    const Vector3 start = simulator.states()[1].position;
    constexpr int kSteps = 300;
    for (int i = 0; i < kSteps; ++i) simulator.step();
    const double time = kSteps * options.dt;
    const double acceleration = kGravity * (std::sin(slope.angle) - friction * std::cos(slope.angle));
    const BodyState& end = simulator.states()[1];
    EXPECT_NEAR(dot(end.velocity, slope.downhill()) / (acceleration * time), 1, 1e-4);
    EXPECT_NEAR(dot(end.position - start, slope.downhill()) / (0.5 * acceleration * time * time), 1, 0.01);
  }
}

TEST_P(EverySolver, ABlockSticksBelowTheAngleOfFrictionAndSlipsAbove) {
  const Vector3 flat = {1, 1, 0.2};
  for (const double friction : {0.2, 0.5, 0.8}) {
    const double limit = std::atan(friction) * 180 / M_PI;
    SimulatorOptions options = options_of(GetParam());
    options.solver.friction = friction;
    // The geometric mean of their materials' frictions is that of the options.
    const Material rough = {.friction = 2 * friction}, smooth = {.friction = friction / 2};
    for (const auto& [degrees, ground, block] : {std::tuple{0.99 * limit, Material(), Material()},
                                                 {1.01 * limit, Material(), Material()},
                                                 {0.99 * limit, rough, smooth},
                                                 {1.01 * limit, smooth, rough}}) {
      Simulator simulator = block_on(Slope(degrees), flat, options, ground, block);
      const Vector3 start = simulator.states()[1].position;
      for (int i = 0; i < 600; ++i) simulator.step();
      const double moved = norm(simulator.states()[1].position - start);
      if (degrees < limit) {
        EXPECT_LT(moved, 1e-4) << friction;
      } else {
        EXPECT_GT(moved, 0.5) << friction;
      }
    }
  }
}

TEST_P(EverySolver, ABlockGainsNoEnergyInAMinute) {
  SimulatorOptions options = options_of(GetParam());
  Simulator simulator(bodies_with(1, kCube), tower(1, 1, options.solver.slop), boxes_on_plane(kUp, kCube),
                      options);
  const double start = simulator.step().potential_energy;
  for (int i = 1; i < 3600; ++i) {
    const StepRecord record = simulator.step();
    ASSERT_LE(record.kinetic_energy, i < 60 && GetParam() == SolverMethod::soft ? 1e-12 : 1e-18) << i;
    ASSERT_LE(record.kinetic_energy + record.potential_energy, start + 1e-9);
  }
}

TEST_P(EverySolver, AFallenBlockIsLiftedToTheSlopWithoutSpeed) {
  SimulatorOptions options = options_of(GetParam());
  std::vector<BodyState> states = tower(1, 1, 0);
  states[1].position.z += 0.5;
  Simulator simulator(bodies_with(1, kCube), states, boxes_on_plane(kUp, kCube), options);
  StepRecord record;
  double energy = 1e9;
  for (int i = 0; i < 600; ++i) {
    record = simulator.step();
    // Correction lifts, so potential energy may grow; speed must not.
    if (record.contacts > 0) {
      ASSERT_LE(record.kinetic_energy, energy + (GetParam() == SolverMethod::soft ? 1e-9 : 1e-12));
      energy = record.kinetic_energy;
    }
  }
  EXPECT_LE(record.kinetic_energy, 1e-18);
  EXPECT_NEAR(record.penetration_max, options.solver.slop, GetParam() == SolverMethod::soft ? 1e-5 : 1e-6);
}

TEST_P(EverySolver, RestitutionGivesTheSpeedBack) {
  SimulatorOptions options = options_of(GetParam());
  options.solver.restitution = 0.5;
  std::vector<BodyState> states = tower(1, 1, 0);
  states[1].position.z += 1e-9;
  states[1].velocity.z = -4;
  options.gravity = {};
  Simulator simulator(bodies_with(1, kCube), states, boxes_on_plane(kUp, kCube), options);
  for (int i = 0; i < 2; ++i) simulator.step();
  EXPECT_NEAR(simulator.states()[1].velocity.z, 2, GetParam() == SolverMethod::soft ? 1e-3 : 1e-9);
}

TEST_P(EverySolver, ABodyBouncesAsTheLargerRestitutionSays) {
  for (const double floor : {0.0, 0.9}) {
    SimulatorOptions options = options_of(GetParam());
    options.solver.restitution = floor;
    options.gravity = {};
    std::vector<BodyState> states = tower(1, 1, 0);
    states[1].position.z += 1e-9;
    states[1].velocity.z = -4;
    std::vector<BodyProperties> bodies = bodies_with(1, kCube);
    bodies[1].material.restitution = 0.5;
    Simulator simulator(bodies, states, boxes_on_plane(kUp, kCube), options);
    for (int i = 0; i < 2; ++i) simulator.step();
    EXPECT_NEAR(simulator.states()[1].velocity.z, 4 * std::max(floor, 0.5),
                GetParam() == SolverMethod::soft ? 2e-3 : 1e-9);
  }
}

TEST_P(EverySolver, ALastingForceMovesABlockAgainstFriction) {
  const Vector3 flat = {1, 1, 0.2};
  for (const double force : {4.0, 9.0}) {  // the weight times friction is 4.9
    Simulator simulator = block_on(Slope(0), flat, options_of(GetParam()));
    const Vector3 start = simulator.states()[1].position;
    simulator.set_force(1, {{0.6 * force, 0.8 * force, 0}, {}});
    for (int i = 0; i < 120; ++i) simulator.step();
    const Vector3 way = simulator.states()[1].position - start;
    const double gained = std::max(0.0, force - 0.5 * kGravity);
    EXPECT_NEAR(norm(way), 0.5 * gained * 4, gained > 0 ? 0.02 * norm(way) : 1e-4);
    EXPECT_NEAR(norm(simulator.states()[1].velocity), gained * 2, 1e-3);
    EXPECT_NEAR(dot(way, {0.6, 0.8, 0}), norm(way), gained > 0 ? 1e-6 : 1e-4);
  }
}

// A world without gravity whose bodies are as heavy by forces moves like one with it: nothing depends on
// gravity alone.
TEST_P(EverySolver, ForcesActAsGravityDoes) {
  Vector3 ends[2], speeds[2];
  for (const bool by_force : {false, true}) {
    SimulatorOptions options = options_of(GetParam());
    auto states = tower(3, 1, options.solver.slop);
    states[3].position.z += 0.3;
    options.solver.restitution = 0.4;
    if (by_force) options.gravity = {};
    Simulator simulator(bodies_with(3, kCube), states, boxes_on_plane(kUp, kCube), options);
    for (std::uint32_t i = 1; by_force && i < 4; ++i) simulator.set_force(i, {{0, 0, -kGravity}, {}});
    for (int i = 0; i < 60; ++i) simulator.step();
    ends[by_force] = simulator.states()[3].position, speeds[by_force] = simulator.states()[3].velocity;
  }
  EXPECT_LT(norm(ends[0] - ends[1]), 1e-9);
  EXPECT_LT(norm(speeds[0] - speeds[1]), 1e-9);
}

TEST(Resting, ATowerStands) {
  constexpr int kBoxes = 10;
  for (const bool shock : {false, true}) {
    SCOPED_TRACE(shock ? "with shock propagation" : "without");
    SimulatorOptions options;
    options.solver.method = SolverMethod::sweeps;
    options.solver.shock_propagation = shock;
    const auto start = tower(kBoxes, 1, options.solver.slop);
    Simulator simulator(bodies_with(kBoxes, kCube), start, boxes_on_plane(kUp, kCube), options);
    StepRecord record;
    for (int i = 0; i < 3600; ++i) record = simulator.step();
    for (int i = 1; i <= kBoxes; ++i) {
      EXPECT_LT(norm(simulator.states()[i].position - start[i].position), 0.01) << "box " << i;
    }
    EXPECT_LT(record.speed_max, 0.01);
  }
}

TEST(Resting, WarmStartLeavesASmallerResidual) {
  double residual[2];
  for (const bool warm : {false, true}) {
    SimulatorOptions options;
    options.solver.method = SolverMethod::sweeps;
    options.solver.warm_start = warm;
    Simulator simulator(bodies_with(10, kCube), tower(10, 1, options.solver.slop), boxes_on_plane(kUp, kCube),
                        options);
    for (int i = 0; i < 100; ++i) residual[warm] = simulator.step().residual_max;
  }
  EXPECT_LT(residual[1], 0.05 * residual[0]);
}

TEST(Resting, MoreIterationsLeaveASmallerResidual) {
  double last = 1e9;
  for (const std::uint32_t iterations : {5u, 20u, 80u}) {
    SimulatorOptions options;
    options.solver.method = SolverMethod::sweeps;
    options.solver.iterations = iterations;
    Simulator simulator(bodies_with(10, kCube), tower(10, 1, options.solver.slop), boxes_on_plane(kUp, kCube),
                        options);
    const double residual = simulator.step().residual_max;
    EXPECT_LT(residual, last);
    last = residual;
  }
}

// Towers side by side are islands.
std::vector<BodyState> fallen_boxes(std::size_t count) {
  std::vector<BodyState> states(count + 1);
  for (std::size_t i = 1; i <= count; ++i) {
    const double turn = static_cast<double>(i);
    states[i].position = {3.0 * static_cast<double>(i / 4), 0.05 * std::sin(turn),
                          0.6 + 1.2 * static_cast<double>(i % 4)};
    states[i].orientation = rotation_by(0.02 * std::cos(turn) * normalized(Vector3{1, 2, 3}));
  }
  return states;
}

Simulator falling(std::uint32_t threads, const SimulatorOptions& common) {
  constexpr int kBoxes = 39;
  SimulatorOptions options = common;
  options.threads = threads;
  return Simulator(bodies_with(kBoxes, kCube), fallen_boxes(kBoxes), boxes_on_plane(kUp, kCube), options);
}

TEST_P(EverySolver, ThreadsDoNotChangeABit) {
  for (const ContactOrder order : {ContactOrder::found, ContactOrder::shuffled}) {
    if (order == ContactOrder::shuffled && GetParam() != SolverMethod::sweeps) continue;
    SimulatorOptions options = options_of(GetParam());
    options.solver.order = order;
    options.solver.shock_propagation = order == ContactOrder::found;
    options.sleep.enabled = true;
    Simulator one = falling(1, options), four = falling(4, options);
    for (int i = 0; i < 200; ++i) {
      one.step(), four.step();
      ASSERT_TRUE(test::same_bytes(one.states(), four.states())) << "step " << i;
    }
  }
}

TEST(Determinism, TheSeedOfTheOrderMatters) {
  SimulatorOptions options;
  options.solver.method = SolverMethod::sweeps;
  options.solver.order = ContactOrder::shuffled;
  Simulator first = falling(1, options);
  options.solver.seed = 2;
  Simulator second = falling(1, options);
  for (int i = 0; i < 100; ++i) first.step(), second.step();
  EXPECT_FALSE(test::same_bytes(first.states(), second.states()));
}

TEST_P(EverySolver, ARestoredSimulatorGoesOnWithTheSameBytes) {
  SimulatorOptions options = options_of(GetParam());
  options.sleep.enabled = true;
  Simulator whole = falling(1, options), second = falling(1, options);
  for (int i = 0; i < 90; ++i) whole.step();
  second.restore(whole.save());
  for (int i = 0; i < 90; ++i) whole.step(), second.step();
  EXPECT_TRUE(test::same_bytes(whole.states(), second.states()));
}

TEST_P(EverySolver, ATowerFallsAsleepAndATouchWakesIt) {
  SimulatorOptions options = options_of(GetParam());
  options.sleep.enabled = true;
  auto states = tower(3, 1, options.solver.slop);
  states[3].position.z += 20;
  Simulator simulator(bodies_with(3, kCube), states, boxes_on_plane(kUp, kCube), options);
  StepRecord record;
  for (int i = 0; i < 60; ++i) record = simulator.step();
  EXPECT_EQ(record.sleeping, 2u);
  for (int i = 0; i < 70; ++i) record = simulator.step();
  EXPECT_EQ(record.sleeping, 0u);
  for (int i = 0; i < 200; ++i) record = simulator.step();
  EXPECT_EQ(record.sleeping, 3u);
  EXPECT_EQ(record.kinetic_energy, 0);
}

constexpr double kRadius = 0.5, kMass = 3;

// A ball on a plane that falls towards +x, for solvers that know rolling resistance.
class Rolling : public testing::TestWithParam<SolverMethod> {
 protected:
  Simulator ball(double slope, double resistance, const Vector3& velocity = Vector3{},
                 const Vector3& spin = Vector3{}, Motion plane = Motion::fixed,
                 const Vector3& plane_spin = Vector3{}) const {
    SimulatorOptions options;
    options.solver.method = GetParam();
    options.solver.rolling_resistance = 0.5 * resistance;
    const Vector3 normal = {std::sin(slope), 0, std::cos(slope)};
    std::vector<BodyProperties> bodies = {fixed_body(), ball_body(kRadius, kMass)};
    bodies[0].motion = plane;
    bodies[1].material.rolling_resistance = resistance;  // the larger one
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
                         testing::Values(SolverMethod::automatic, SolverMethod::soft, SolverMethod::newton),
                         [](const testing::TestParamInfo<SolverMethod>& tested) -> std::string {
                           return tested.param == SolverMethod::automatic ? "automatic"
                                  : tested.param == SolverMethod::soft    ? "soft"
                                                                          : "newton";
                         });

TEST_P(Rolling, ABallRollsDownASlopeAsTheClosedFormSays) {
  for (const double slope : {0.1, 0.3}) {
    for (const double resistance : {0.0, 0.0005, 0.02}) {
      Simulator simulator = ball(slope, resistance);
      const BodyState& end = after(simulator, 3);
      const double speed =
          5.0 / 7 * kGravity * (std::sin(slope) - resistance / kRadius * std::cos(slope)) * 3;
      EXPECT_NEAR(norm(end.velocity) / speed, 1, 1e-3) << slope << " " << resistance;
      EXPECT_NEAR(end.angular_velocity.y * kRadius / speed, 1, 1e-3) << slope << " " << resistance;
    }
  }
}

TEST_P(Rolling, ABallStaysOnASlopeThatIsNoSteeperThanItsLever) {
  Simulator held = ball(0.99 * std::atan(0.02 / kRadius), 0.02);
  const Vector3 start = held.states()[1].position;
  EXPECT_LT(norm(after(held, 3).position - start), 1e-4);
  Simulator rolls = ball(1.05 * std::atan(0.02 / kRadius), 0.02);
  EXPECT_GT(norm(after(rolls, 3).position - start), 0.04);
}

TEST_P(Rolling, ABallThatRollsOnAPlaneStopsWhereTheClosedFormSays) {
  constexpr double kSpeed = 1, kResistance = 0.05;
  const double way = 0.7 * kSpeed * kSpeed * kRadius / (kGravity * kResistance);
  const Vector3 velocity = kSpeed * Vector3{0.6, 0.8, 0};
  Simulator simulator = ball(0, kResistance, velocity, cross(kUp, velocity) / kRadius);
  const BodyState& end = after(simulator, 3);
  const Vector3 rolled = {end.position.x, end.position.y, 0};
  EXPECT_NEAR(norm(rolled) / way, 1, 0.005);
  EXPECT_NEAR(dot(normalized(rolled), velocity / kSpeed), 1, 1e-6);
  EXPECT_LT(norm(end.velocity), 1e-5);
  EXPECT_LT(norm(end.angular_velocity), 1e-5);
}

TEST_P(Rolling, ABallThatSpinsOnTheSpotStopsAfterTheTimeOfTheClosedForm) {
  constexpr double kSpin = 4, kResistance = 0.02;
  const double time = kSpin * 0.4 * kRadius * kRadius / (kGravity * kResistance);
  Simulator simulator = ball(0, kResistance, Vector3{}, kSpin * kUp);
  EXPECT_NEAR(after(simulator, time / 2).angular_velocity.z / kSpin, 0.5, 0.005);
  EXPECT_LT(norm(after(simulator, time / 2 + 0.1).angular_velocity), 1e-5);
}

TEST_P(Rolling, ATableThatTurnsTakesABallAlong) {
  constexpr double kSpin = 0.3;
  Simulator simulator = ball(0, 0.02, Vector3{}, Vector3{}, Motion::kinematic, kSpin * kUp);
  const BodyState& end = after(simulator, 2);
  EXPECT_NEAR(end.angular_velocity.z, kSpin, 1e-6);
}

}  // namespace
}  // namespace tandem::simulation
