#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analytic_contacts.h"
#include "dynamics/island_problem.h"
#include "kernels/manifold/manifold_scene.h"

namespace tandem::simulation {
namespace {

// Boxes of these masses on each other on the plane, each as deep in the next as the slop, and askew by
// `jitter`.
struct Tower {
  explicit Tower(const std::vector<double>& masses, double slop, double jitter = 0)
      : bodies{fixed_body()}, states(1) {
    for (std::size_t i = 1; i <= masses.size(); ++i) {
      const double number = static_cast<double>(i);
      bodies.push_back(box_body(kCube, masses[i - 1]));
      states.emplace_back();
      states.back().position = {jitter * std::sin(7 * number), jitter * std::cos(5 * number),
                                number - 0.5 - slop * number};
    }
  }

  std::vector<BodyProperties> bodies;
  std::vector<BodyState> states;
};

std::vector<double> masses(std::size_t count, double highest = 1) {
  std::vector<double> all(count, 1);
  all.back() = highest;
  return all;
}

struct Outcome {
  double drift = 0;  // of the box that went farthest at any time, lengths
  StepRecord last;
};

Outcome stand(const Tower& tower, SolverMethod solver, int steps) {
  SimulatorOptions options;
  options.solver.method = solver;
  Simulator simulator(tower.bodies, tower.states, boxes_on_plane(kUp, kCube), options);
  Outcome outcome;
  for (int i = 0; i < steps; ++i) {
    outcome.last = simulator.step();
    for (std::size_t j = 1; j < tower.states.size(); ++j) {
      outcome.drift =
          std::max(outcome.drift, norm(simulator.states()[j].position - tower.states[j].position));
    }
  }
  return outcome;
}

const double kSlop = SolverOptions().slop;

TEST(Standing, AJitteredTowerOfThirtyStandsByNewton) {
  for (const SolverMethod solver : {SolverMethod::automatic, SolverMethod::newton}) {
    const Outcome outcome = stand(Tower(masses(30), kSlop, 5e-4), solver, 600);
    EXPECT_LT(outcome.drift, 1e-4);
    EXPECT_LT(outcome.last.speed_max, 1e-6);
    EXPECT_EQ(outcome.last.newton_islands, 1u);
  }
}

TEST(Standing, HeavyBoxesRestOnLightOnesByNewton) {
  for (const double ratio : {100.0, 1000.0, 10000.0}) {
    EXPECT_LT(stand(Tower(masses(2, ratio), kSlop), SolverMethod::automatic, 300).drift, 1e-4) << ratio;
  }
  EXPECT_LT(stand(Tower(masses(10, 1000), kSlop), SolverMethod::automatic, 300).drift, 1e-3);
}

TEST(Standing, SoftStepsHoldAHundredToOneAndATowerOfTen) {
  EXPECT_LT(stand(Tower(masses(2, 100), kSlop), SolverMethod::soft, 300).drift, 0.005);
  EXPECT_LT(stand(Tower(masses(10), kSlop, 5e-4), SolverMethod::soft, 300).drift, 0.005);
}

TEST(Sliding, APushedBlockStopsWhereTheClosedFormSays) {
  const Vector3 flat = {1, 1, 0.2};
  for (const SolverMethod solver : {SolverMethod::automatic, SolverMethod::soft, SolverMethod::newton}) {
    for (const Vector3& velocity : {Vector3{4, 0, 0}, Vector3{2.4, 3.2, 0}}) {
      SimulatorOptions options;
      options.solver.method = solver;
      options.solver.friction = 0.4;
      BodyState start;
      start.position.z = 0.1 - options.solver.slop;
      start.velocity = velocity;
      Simulator simulator({fixed_body(), box_body(flat, 1)}, {BodyState(), start}, boxes_on_plane(kUp, flat),
                          options);
      for (int i = 0; i < 180; ++i) simulator.step();
      const Vector3 way = simulator.states()[1].position - start.position;
      EXPECT_NEAR(norm(way) / (16 / (2 * 0.4 * kGravity)), 1, 0.005);
      EXPECT_NEAR(dot(normalized(way), normalized(velocity)), 1, 1e-6);
    }
  }
}

Threads& one_thread() {
  static Threads threads(1);
  return threads;
}

// One step of bodies and contacts, set up for the solvers of an island.
struct OneStep {
  explicit OneStep(const Tower& tower) : bodies(tower.bodies), states(tower.states) {}

  void touch(std::uint32_t a, std::uint32_t b, const Vector3& position, const Vector3& normal = kUp) {
    contacts.push_back({a, b, position, normal, kSlop, 0});
  }
  void touch_by_four(std::uint32_t a, std::uint32_t b, double height) {
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) touch(a, b, {x, y, height});
    }
  }
  IslandProblem problem() {
    islands = find_islands(bodies, contacts);
    const std::vector<ContactImpulse> none(contacts.size());
    std::vector<std::uint32_t> place(bodies.size());
    return make_island_problem(input(), 0, {states, none}, options, find_layers(bodies, contacts), place);
  }
  StepInput input() {
    pulls.assign(bodies.size(), {gravity, {}});
    return {{bodies, contacts, kDt, pulls}, islands, 0, true, one_thread()};
  }
  // Makes the step. Result: what each contact did.
  std::vector<ContactImpulse> solve(SolverKind kind) {
    islands = find_islands(bodies, contacts);
    std::vector<ContactImpulse> impulses(contacts.size());
    options.kind = kind;
    make_step_solver(options)->step(input(), states, impulses);
    return impulses;
  }

  static constexpr double kDt = 1.0 / 60;
  std::vector<BodyProperties> bodies;
  std::vector<BodyState> states;
  std::vector<ContactPoint> contacts;
  std::vector<Pull> pulls;
  Islands islands;
  SolverOptions options;
  Vector3 gravity = -kGravity * kUp;
};

TEST(Newton, ATowersContactsCarryWhatStandsOnThem) {
  OneStep step(Tower({1, 10, 1000}, kSlop));
  for (std::uint32_t i = 0; i < 3; ++i) step.touch_by_four(i, i + 1, i);
  IslandProblem problem = step.problem();
  const std::optional<Residual> residual = solve_newton_step(problem, step.input(), step.options);
  ASSERT_TRUE(residual);
  EXPECT_LT(residual->largest, 1e-5);
  const double carried[] = {1011, 1010, 1000};
  for (std::size_t i = 0; i < 3; ++i) {
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += problem.impulse[4 * i + k].x;
    EXPECT_NEAR(sum / (carried[i] * kGravity * OneStep::kDt), 1, 1e-4);
  }
}

TEST(Newton, FrictionOfASlidingBlockHasCoulombsSizeAndOpposesTheSlip) {
  OneStep step(Tower({2}, kSlop));
  step.options.friction = 0.3;
  step.states[1].velocity = {3, 4, 0};
  step.touch_by_four(0, 1, 0);
  IslandProblem problem = step.problem();
  ASSERT_TRUE(solve_newton_step(problem, step.input(), step.options));
  Vector3 sum = Vector3{};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3& impulse = problem.impulse[i];
    sum += impulse.y * problem.first_direction[i] + impulse.z * problem.second_direction[i];
    EXPECT_NEAR(std::hypot(impulse.y, impulse.z), 0.3 * impulse.x, 1e-4);
  }
  const double weight = 2 * kGravity * OneStep::kDt;
  EXPECT_NEAR(norm(sum) / (0.3 * weight), 1, 1e-3);
  EXPECT_NEAR(dot(normalized(sum), Vector3{-0.6, -0.8, 0}), 1, 1e-4);
}

// A box that one plate presses against another: no velocities satisfy that.
OneStep pressed_box() {
  OneStep step(Tower({1}, kSlop));
  step.bodies.push_back(fixed_body());
  step.bodies.back().motion = Motion::kinematic;
  step.states.emplace_back();
  step.states.back().velocity.z = -1;
  step.touch_by_four(0, 1, 0);
  step.touch_by_four(1, 2, 1);
  return step;
}

TEST(Newton, WhatDoesNotConvergeLeavesTheProblemAsItWas) {
  OneStep step = pressed_box();
  IslandProblem problem = step.problem();
  const std::vector<Vector6> velocity(problem.velocity.begin(), problem.velocity.end()),
      displacement(problem.displacement.begin(), problem.displacement.end());
  const std::vector<Vector3> impulse(problem.impulse.begin(), problem.impulse.end());
  EXPECT_FALSE(solve_newton_step(problem, step.input(), step.options));
  EXPECT_TRUE(test::same_bytes<Vector6>(problem.velocity, velocity));
  EXPECT_TRUE(test::same_bytes<Vector6>(problem.displacement, displacement));
  EXPECT_TRUE(test::same_bytes<Vector3>(problem.impulse, impulse));
}

TEST(Newton, WhatDoesNotConvergeIsSolvedBySoftSteps) {
  std::vector<BodyState> results[2];
  for (const SolverKind kind : {SolverKind::soft, SolverKind::newton}) {
    OneStep step = pressed_box();
    step.options.kind = kind;
    step.problem();
    std::vector<ContactImpulse> impulses(step.contacts.size());
    const auto solver = make_step_solver(step.options);
    solver->step(step.input(), step.states, impulses);
    EXPECT_EQ(solver->statistics().newton_islands, 0u);
    results[kind == SolverKind::newton] = step.states;
  }
  EXPECT_EQ(norm(results[0][1].position - results[1][1].position), 0);
  EXPECT_EQ(norm(results[0][1].velocity - results[1][1].velocity), 0);
  EXPECT_TRUE(is_finite(results[0][1].velocity));
}

// About the world's origin, with the centres of bodies where they were.
Vector3 angular_momentum_of(const OneStep& step, const std::vector<BodyState>& before) {
  Vector3 sum = Vector3{};
  for (std::size_t i = 1; i < step.bodies.size(); ++i) {
    BodyState state = step.states[i];
    state.position = before[i].position;
    sum += angular_momentum(step.bodies[i], state);
  }
  return sum;
}

TEST(RollingResistance, TwoBodiesSlowEachOthersTurningAndKeepTheirAngularMomentum) {
  for (const SolverKind kind : {SolverKind::soft, SolverKind::newton}) {
    OneStep step(Tower({1, 2}, kSlop));
    step.states[2].velocity = {0, 0, -1};
    step.states[2].angular_velocity = {0, 0, 3};
    step.options.substeps = 16;
    step.options.friction = 0;
    step.options.rolling_resistance = 0.02;
    step.gravity = Vector3{};
    step.touch(1, 2, {0.1, 0.2, 1});
    const std::vector<BodyState> start = step.states;
    const Vector3 before = angular_momentum_of(step, start);
    const ContactImpulse impulse = step.solve(kind)[0];
    EXPECT_LT(norm(angular_momentum_of(step, start) - before), kind == SolverKind::soft ? 5e-7 : 1e-12);
    const Vector3 turning = step.states[2].angular_velocity - step.states[1].angular_velocity;
    EXPECT_LT(turning.z, 2.95);
    if (kind == SolverKind::soft) continue;  // nothing pushes any more in its last substep
    EXPECT_NEAR(norm(impulse.turning) / (step.options.rolling_resistance * impulse.normal), 1, 1e-4);
    EXPECT_LT(dot(normalized(impulse.turning), normalized(turning)), -0.9999);
  }
}

TEST(Newton, ContactsGoUpFromTheGroundWhateverTheOrderOfBodies) {
  constexpr std::uint32_t kBoxes = 10;
  OneStep step(Tower(masses(kBoxes), kSlop));
  std::reverse(step.states.begin() + 1, step.states.end());
  for (std::uint32_t i = 1; i < kBoxes; ++i) step.touch_by_four(i, i + 1, kBoxes - i);
  step.touch_by_four(0, kBoxes, 0);
  const IslandProblem problem = step.problem();
  std::vector<double> heights;
  for (const std::uint32_t contact : problem.contacts) heights.push_back(step.contacts[contact].position.z);
  EXPECT_TRUE(std::is_sorted(heights.begin(), heights.end()));
}

// Two boxes that are held deep in each other from both sides push for what one side is deeper than the other.
TEST(Soft, BodiesHeldFromBothSidesAreNotSqueezed) {
  const double weight = kGravity * OneStep::kDt;
  for (const double deeper : {0.0, 0.01}) {
    OneStep step(Tower(masses(2), kSlop));
    step.options.substeps = 16;
    step.contacts = {{1, 2, {0, 0, 1.4}, {0, 0, 1}, 0.02 + deeper, 0},
                     {1, 2, {0, 0, 0.6}, {0, 0, -1}, 0.02, 0}};
    const double before = step.states[2].position.z - step.states[1].position.z;
    const std::vector<ContactImpulse> impulses = step.solve(SolverKind::soft);
    const double strongest = std::max(impulses[0].normal, impulses[1].normal);
    const double apart = step.states[2].position.z - step.states[1].position.z - before;
    EXPECT_LT(strongest, (deeper > 0 ? 200 : 60) * weight);  // 480 by the depth of each side alone
    if (deeper > 0) {
      EXPECT_GT(apart, 0.0005);  // the other way by the depth of each side alone
    } else {
      EXPECT_LT(std::fabs(apart), 0.001);
    }
  }
}

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
  options.gravity = {};
  return options;
}

TEST(RigidBody, FreeFlightKeepsMomentumToRounding) {
  const BodyProperties plate = box_body({1, 2, 0.1}, 7);
  Simulator simulator({plate}, {tumbling()}, no_contacts(), weightless());
  const Vector3 linear = 7 * tumbling().velocity, angular = angular_momentum(plate, tumbling());
  for (int i = 0; i < 3600; ++i) {
    const StepRecord record = simulator.step();
    ASSERT_LE(norm(record.linear_momentum - linear), kRounding * norm(linear));
    ASSERT_LE(norm(record.angular_momentum - angular), 10 * kRounding * norm(angular)) << i;
  }
}

TEST(RigidBody, FreeRotationKeepsItsEnergyWithinTheBoundsOfItsMomentum) {
  const BodyProperties plate = box_body({1, 2, 0.1}, 7);
  const Vector3* const inertia = plate.inertia.row;
  const auto [least, most] = std::minmax({inertia[0].x, inertia[1].y, inertia[2].z});
  for (const double dt : {1.0 / 240, 1.0 / 60, 0.5}) {
    BodyState state = tumbling();
    const double momentum = square(plate.inertia * state.angular_velocity);
    for (int i = 0; i < 2000; ++i) {
      advance(plate, state, Vector3{}, Vector3{}, dt);
      BodyState still = state;
      still.velocity = {};
      const double energy = kinetic_energy(plate, still);
      ASSERT_LE(energy, (1 + 1e-9) * momentum / (2 * least));
      ASSERT_GE(energy, (1 - 1e-9) * momentum / (2 * most));
    }
  }
}

TEST(RigidBody, FreeRotationKeepsItsEnergyWhereStepsAreSmall) {
  const BodyProperties plate = box_body({1, 2, 0.1}, 7);
  BodyState state = tumbling();
  const double before = kinetic_energy(plate, state);
  for (int i = 0; i < 2400; ++i) advance(plate, state, Vector3{}, Vector3{}, 1.0 / 240);
  EXPECT_NEAR(kinetic_energy(plate, state) / before, 1, 1e-3);
}

TEST(RigidBody, FallsAsGalileiSays) {
  SimulatorOptions options;
  Simulator simulator({box_body({1, 1, 1}, 2)}, {BodyState()}, no_contacts(), options);
  constexpr int kSteps = 120;
  for (int i = 0; i < kSteps; ++i) simulator.step();
  const double dt = options.dt;
  EXPECT_NEAR(simulator.states()[0].velocity.z, -9.81 * kSteps * dt, 1e-12);
  EXPECT_NEAR(simulator.states()[0].position.z, -9.81 * dt * dt * kSteps * kSteps / 2, 1e-11);
}

TEST(RigidBody, PosesAreRigidAfterManySteps) {
  const BodyProperties plate = box_body({1, 2, 0.1}, 7);
  BodyState state = tumbling();
  for (int i = 0; i < 100'000; ++i) advance(plate, state, Vector3{}, Vector3{}, 1.0 / 60);
  EXPECT_TRUE(is_rigid(pose_of(plate, state).pose));
}

TEST(RigidBody, StateOfAPoseGivesThePose) {
  BodyProperties body = box_body({1, 2, 3}, 1);
  body.centre = {0.25, -0.5, 4};
  BodyState state = tumbling();
  state.orientation = normalized(Quaternion{0.1, -0.7, 0.3, 0.5});
  const Pose pose = pose_of(body, state).pose, again = pose_of(body, state_of(body, pose)).pose;
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(pose.translation[i], again.translation[i], 1e-14);
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(pose.rotation[i][j], again.rotation[i][j], 1e-15);
  }
}

}  // namespace
}  // namespace tandem::simulation
