#include "tandem/dynamics/gpu_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "dynamics/falling_bodies.h"
#include "dynamics/lists_of_steps.h"
#include "dynamics/world_setup.h"

namespace tandem::test {
namespace {

using namespace dynamics;

bool has_gpu() {
  int count = 0;
  return cudaGetDeviceCount(&count) == cudaSuccess && count > 0;
}

#define NEEDS_GPU() \
  if (!has_gpu()) GTEST_SKIP() << "no GPU"

// Moves the same bodies by a GpuWorld and by a Simulation.
struct BothWorlds {
  explicit BothWorlds(const FallingBodies& of, const WorldOptions& options = {}) {
    WorldSetup setup;
    std::uint64_t where = 0;
    EXPECT_EQ(set_up(of.assets.views(), of.descriptions, options, {}, setup, where), Status::kOk);
    SimulationParts parts;
    parts.contacts = make_scene_contacts(of.assets.views(), 1);
    parts.ahead = std::make_unique<ContactsAhead>(of.assets.views(), 1);
    simulation =
        std::make_unique<Simulation>(setup.properties, setup.states, std::move(parts), setup.options);
    EXPECT_EQ(world.set_assets(of.assets.views()), Status::kOk);
    EXPECT_EQ(world.set_bodies(of.descriptions, options), Status::kOk);
  }
  std::vector<BodyState> on_gpu() const {
    std::vector<BodyState> out(world.body_count());
    EXPECT_EQ(cudaMemcpy(out.data(), world.states(), out.size() * sizeof(BodyState), cudaMemcpyDefault),
              cudaSuccess);
    return out;
  }

  std::unique_ptr<Simulation> simulation;
  GpuWorld world;
};

double difference(const BodyState& p, const BodyState& q) {
  return norm(p.position - q.position) + norm(p.velocity - q.velocity) +
         norm(p.angular_velocity - q.angular_velocity);
}

// Sines are rounded otherwise, nearest points are others within the tolerance of distances, a twentieth of
// the slop, and sums of Newton's method have another order; what bodies do multiplies that, until an island
// converges on one side alone.
TEST(GpuWorlds, MoveBodiesAsASimulationDoes) {
  NEEDS_GPU();
  const FallingBodies bodies(24);
  BothWorlds both(bodies);
  double most = 0;
  for (int step = 0; step < 20; ++step) {
    both.simulation->step();
    ASSERT_EQ(both.world.step(1.0 / 60), Status::kOk) << step << " " << both.world.where();
    const std::vector<BodyState> states = both.on_gpu();
    double worst = 0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const double d = difference(states[i], both.simulation->states()[i]);
      if (!(d <= worst)) worst = d, at = i;
    }
    most = std::max(most, worst);
    ASSERT_LT(worst, 1e-3) << "step " << step << " body " << at;
  }
  RecordProperty("most", std::to_string(most));
}

// Stacks boxes with gaps of 10 um. Result: how far the world moves a body sideways or down in two seconds, at
// most.
double drift_of_tower(int boxes, double density_of_last) {
  FallingBodies tower(1);
  for (int i = 0; i < boxes; ++i) {
    BodyDescription& body = tower.descriptions.emplace_back();
    body.asset = 3, body.pose = shift(1e-3 * (i % 3), 0, 0.1 + 0.20001 * i);
  }
  tower.descriptions.back().density = density_of_last;
  GpuWorld world;
  EXPECT_EQ(world.set_assets(tower.assets.views()), Status::kOk);
  EXPECT_EQ(world.set_bodies(tower.descriptions, {.sleeping = false}), Status::kOk);
  EXPECT_EQ(world.step(1.0 / 60, 120), Status::kOk);
  std::span<const BodyMotion> motions;
  EXPECT_EQ(world.bodies(motions), Status::kOk);
  double most = 0;
  for (std::size_t i = 1; i < motions.size(); ++i) {
    const double* const at = tower.descriptions[i].pose.translation;
    most = std::max(most, norm(vector_of(motions[i].centre) - Vector3{at[0], at[1], at[2]}));
  }
  return most;
}

TEST(GpuWorlds, KeepATowerOf30Boxes) {
  NEEDS_GPU();
  EXPECT_LT(drift_of_tower(30, 1000), 1e-3);
}

TEST(GpuWorlds, KeepHeavyOnLight) {
  NEEDS_GPU();
  EXPECT_LT(drift_of_tower(3, 1e7), 1e-3);
}

TEST(GpuWorlds, GiveTheSameBytesTwice) {
  NEEDS_GPU();
  const FallingBodies bodies(40, 3);
  std::vector<BodyState> first;
  for (int run = 0; run < 2; ++run) {
    BothWorlds both(bodies);
    ASSERT_EQ(both.world.step(1.0 / 60, 200), Status::kOk);
    const std::vector<BodyState> states = both.on_gpu();
    if (run == 0) first = states;
    EXPECT_EQ(std::memcmp(states.data(), first.data(), states.size() * sizeof(BodyState)), 0);
  }
}

TEST(GpuWorlds, ComeToRestAndSleep) {
  NEEDS_GPU();
  const FallingBodies bodies(30, 2);
  BothWorlds both(bodies);
  // A ring rolls for long: rolling resistance takes some 0.06 m/s of its speed in a second.
  ASSERT_EQ(both.world.step(1.0 / 60, 3600), Status::kOk);
  std::span<const BodyMotion> motions;
  ASSERT_EQ(both.world.bodies(motions), Status::kOk);
  std::size_t asleep = 0;
  for (const BodyMotion& body : motions) {
    asleep += body.sleeps ? 1 : 0;
    EXPECT_LT(norm(vector_of(body.velocity)), 0.03);
    EXPECT_GT(body.centre[2], -0.21);
  }
  EXPECT_GT(asleep, 25u);
  std::span<const WorldTouch> touching;
  ASSERT_EQ(both.world.touching(touching), Status::kOk);
  EXPECT_GT(touching.size(), 25u);
}

// A box that stands on a floor from 5 mm above it, so that it touches from a step on that both find.
FallingBodies box_above_floor() {
  FallingBodies bodies(1);
  BodyDescription& body = bodies.descriptions.emplace_back();
  body.asset = 3, body.pose = shift(0, 0, 0.105);
  return bodies;
}

struct Lists {
  std::vector<WorldTouch> touching, began;
  std::vector<ObjectPair> ended;
};

Lists lists_of(GpuWorld& world) {
  Lists out;
  std::span<const WorldTouch> touches;
  std::span<const ObjectPair> pairs;
  EXPECT_EQ(world.touching(touches), Status::kOk);
  out.touching.assign(touches.begin(), touches.end());
  EXPECT_EQ(world.began(touches), Status::kOk);
  out.began.assign(touches.begin(), touches.end());
  EXPECT_EQ(world.ended(pairs), Status::kOk);
  out.ended.assign(pairs.begin(), pairs.end());
  return out;
}

void expect_near(std::span<const WorldTouch> touches, std::span<const WorldTouch> expected) {
  ASSERT_EQ(touches.size(), expected.size());
  for (std::size_t i = 0; i < touches.size(); ++i) {
    EXPECT_EQ(touches[i].a, expected[i].a);
    EXPECT_EQ(touches[i].b, expected[i].b);
    EXPECT_NEAR(touches[i].impulse, expected[i].impulse, 1e-3);
    EXPECT_NEAR(touches[i].speed, expected[i].speed, 1e-3);
  }
}

TEST(GpuWorlds, TellWhatTouchesAsASimulationDoes) {
  NEEDS_GPU();
  const FallingBodies bodies = box_above_floor();
  BothWorlds both(bodies);
  std::vector<WorldTouch> began;
  for (int step = 0; step < 20; ++step) {
    both.simulation->step();
    const Touches& touches = both.simulation->touches();
    add_touches(touches.began(), touches.touching(), began);
    ASSERT_EQ(step == 0 ? both.world.step(1.0 / 60) : both.world.step_more(1.0 / 60), Status::kOk);
    const Lists lists = lists_of(both.world);
    expect_near(lists.touching, touches.touching());
    expect_near(lists.began, began);
    EXPECT_TRUE(lists.ended.empty());
  }
  ASSERT_EQ(began.size(), 1u);
  EXPECT_GT(began[0].speed, 0.1);
  // It flies off, and what has parted is told though the two are not near each other any more.
  const double up[3] = {0, 0, 10 * both.world.mass_of(1)}, at[3] = {0, 0, 0.1};
  ASSERT_EQ(both.world.push(1, up, at), Status::kOk);
  ASSERT_EQ(both.world.step(1.0 / 60, 40), Status::kOk);
  Lists lists = lists_of(both.world);
  EXPECT_TRUE(lists.touching.empty() && lists.began.empty());
  ASSERT_EQ(lists.ended.size(), 1u);
  EXPECT_TRUE(lists.ended[0].a == 0 && lists.ended[0].b == 1);
  ASSERT_EQ(both.world.step(1.0 / 60, 0), Status::kOk);
  EXPECT_TRUE(lists_of(both.world).ended.empty());
}

TEST(GpuWorlds, TellTheSameHoweverStepsAreCalled) {
  NEEDS_GPU();
  const FallingBodies bodies(40, 3);
  BothWorlds one(bodies), many(bodies);
  ASSERT_EQ(one.world.step(1.0 / 60, 150), Status::kOk);
  for (int step = 0; step < 150; ++step) {
    ASSERT_EQ(step == 0 ? many.world.step(1.0 / 60) : many.world.step_more(1.0 / 60), Status::kOk);
    if (step % 7 == 0) lists_of(many.world);
  }
  const Lists lists = lists_of(one.world), others = lists_of(many.world);
  EXPECT_GT(lists.began.size(), 30u);
  EXPECT_GT(lists.ended.size(), 5u);
  const auto same = [](const auto& p, const auto& q) {
    return p.size() == q.size() && std::memcmp(p.data(), q.data(), p.size() * sizeof p[0]) == 0;
  };
  EXPECT_TRUE(same(lists.touching, others.touching));
  EXPECT_TRUE(same(lists.began, others.began));
  EXPECT_TRUE(same(lists.ended, others.ended));
}

TEST(GpuWorlds, TakeOtherMaterialsAndGravity) {
  NEEDS_GPU();
  FallingBodies bodies = box_above_floor();
  BothWorlds both(bodies, {.gravity = {2, 0, -9.81}});
  GpuWorld& world = both.world;
  ASSERT_EQ(world.step(1.0 / 60, 90), Status::kOk);
  std::span<const BodyMotion> motions;
  ASSERT_EQ(world.bodies(motions), Status::kOk);
  ASSERT_TRUE(motions[1].sleeps);
  ASSERT_EQ(world.set_material(0, Material{}), Status::kOk);
  ASSERT_EQ(world.bodies(motions), Status::kOk);
  EXPECT_TRUE(motions[1].sleeps);  // nothing is new
  ASSERT_EQ(world.set_material(0, {.friction = 0}), Status::kOk);
  ASSERT_EQ(world.bodies(motions), Status::kOk);
  EXPECT_FALSE(motions[1].sleeps);
  ASSERT_EQ(world.step(1.0 / 60, 12), Status::kOk);
  ASSERT_EQ(world.bodies(motions), Status::kOk);
  EXPECT_NEAR(motions[1].velocity[0], 0.4, 0.02);
  const double before = motions[1].velocity[0];
  ASSERT_EQ(world.set_gravity_scale(1, 0), Status::kOk);
  ASSERT_EQ(world.step(1.0 / 60, 12), Status::kOk);
  ASSERT_EQ(world.bodies(motions), Status::kOk);
  EXPECT_NEAR(motions[1].velocity[0], before, 1e-6);
  EXPECT_EQ(world.set_material(2, Material{}), Status::kUnknownInstance);
  EXPECT_EQ(world.set_material(1, {.friction = std::nan("")}), Status::kOutOfRange);
  EXPECT_EQ(world.set_gravity_scale(1, 1e300), Status::kOutOfRange);
  EXPECT_EQ(world.where(), 1u);
}

TEST(GpuWorlds, LimitFastBodies) {
  NEEDS_GPU();
  FallingBodies bodies = box_above_floor();
  bodies.descriptions[1].pose = shift(0, 0, 5);
  bodies.descriptions[1].velocity[2] = -900;
  for (const bool continuous : {false, true}) {
    GpuWorld world;
    ASSERT_EQ(world.set_assets(bodies.assets.views()), Status::kOk);
    ASSERT_EQ(world.set_bodies(bodies.descriptions, {.continuous = continuous}), Status::kOk);
    ASSERT_EQ(world.step(1.0 / 60, 60), Status::kOk);
    std::span<const BodyMotion> motions;
    ASSERT_EQ(world.bodies(motions), Status::kOk);
    EXPECT_EQ(motions[1].centre[2] > -0.05, continuous);
  }
}

TEST(GpuWorlds, GoBackToAState) {
  NEEDS_GPU();
  const FallingBodies bodies(40, 3);
  BothWorlds both(bodies);
  GpuWorld& world = both.world;
  const double force[3] = {0.2, 0, 0}, none[3] = {}, away[3] = {0, 0, 50};
  ASSERT_EQ(world.set_force(5, force, none), Status::kOk);
  ASSERT_EQ(world.step(1.0 / 60, 60), Status::kOk);
  std::shared_ptr<const GpuWorld::State> state;
  ASSERT_EQ(world.save(state), Status::kOk);
  const double time = world.time();
  std::vector<std::vector<BodyState>> states[2];
  for (auto& of_run : states) {
    for (int step = 0; step < 60; ++step) {
      ASSERT_EQ(world.step(1.0 / 60), Status::kOk);
      of_run.push_back(both.on_gpu());
    }
    // What happens meanwhile does not matter.
    ASSERT_EQ(world.set_material(0, {.friction = 0}), Status::kOk);
    ASSERT_EQ(world.set_gravity_scale(3, 4), Status::kOk);
    ASSERT_EQ(world.set_force(4, away, none), Status::kOk);
    ASSERT_EQ(world.step(1.0 / 120, 100), Status::kOk);
    ASSERT_EQ(world.restore(*state), Status::kOk);
    EXPECT_EQ(world.time(), time);
    std::span<const WorldContact> contacts;
    ASSERT_EQ(world.contacts(contacts), Status::kOk);
    EXPECT_TRUE(contacts.empty());
    const Lists lists = lists_of(world);
    EXPECT_FALSE(lists.touching.empty());
    EXPECT_TRUE(lists.began.empty() && lists.ended.empty());
  }
  for (std::size_t step = 0; step < states[0].size(); ++step) {
    EXPECT_EQ(std::memcmp(states[0][step].data(), states[1][step].data(),
                          bodies.descriptions.size() * sizeof(BodyState)),
              0)
        << step;
  }
  ASSERT_EQ(world.set_bodies(bodies.descriptions), Status::kOk);
  EXPECT_EQ(world.restore(*state), Status::kKeptMismatch);
  ASSERT_EQ(world.step(1.0 / 60), Status::kOk);
}

TEST(GpuWorlds, SayWhatMemoryTheyTake) {
  NEEDS_GPU();
  FallingBodies bodies(1);
  for (int i = 0; i < 30'000; ++i) {
    BodyDescription& body = bodies.descriptions.emplace_back();
    body.asset = 3,
    body.pose = shift(0.5 * (i % 50) - 12, 0.5 * (i / 50 % 50) - 12, 0.1 + 0.201 * (i / 2500));
  }
  GpuWorld world;
  ASSERT_EQ(world.set_assets(bodies.assets.views()), Status::kOk);
  const std::size_t empty = world.bytes();
  std::size_t before = 0, after = 0, total = 0;
  ASSERT_EQ(cudaMemGetInfo(&before, &total), cudaSuccess);
  ASSERT_EQ(world.set_bodies(bodies.descriptions), Status::kOk);
  ASSERT_EQ(world.step(1.0 / 60, 4), Status::kOk);
  ASSERT_EQ(cudaMemGetInfo(&after, &total), cudaSuccess);
  const double told = static_cast<double>(world.bytes() - empty), taken = static_cast<double>(before - after);
  EXPECT_GT(told, 1e8);
  // The driver takes memory in large pieces, and for graphs and kernels.
  EXPECT_NEAR(told / taken, 1, 0.2);
}

TEST(GpuWorlds, WakeWhatIsPushed) {
  NEEDS_GPU();
  const FallingBodies bodies(6, 4);
  BothWorlds both(bodies);
  ASSERT_EQ(both.world.step(1.0 / 60, 600), Status::kOk);
  std::span<const BodyMotion> motions;
  ASSERT_EQ(both.world.bodies(motions), Status::kOk);
  const double x = motions[1].centre[0];
  const double up[3] = {0, 0, 40}, at[3] = {motions[1].centre[0], motions[1].centre[1], motions[1].centre[2]};
  ASSERT_EQ(both.world.push(1, up, at), Status::kOk);
  ASSERT_EQ(both.world.step(1.0 / 60, 6), Status::kOk);
  ASSERT_EQ(both.world.bodies(motions), Status::kOk);
  EXPECT_GT(motions[1].centre[2], at[2] + 0.05);
  EXPECT_NEAR(motions[1].centre[0], x, 0.5);
  EXPECT_FALSE(motions[1].sleeps);
}

// A number that callers write where the steps read it, or that the steps make, stops the world.
TEST(GpuWorlds, NameABodyThatLeavesTheRangeOfNumbers) {
  NEEDS_GPU();
  const FallingBodies bodies(6, 4);
  BothWorlds both(bodies);
  GpuWorld& world = both.world;
  ASSERT_EQ(world.step(1.0 / 60, 20), Status::kOk);
  const double time = world.time();
  const std::vector<BodyState> good = both.on_gpu();
  for (const double number : {std::nan(""), HUGE_VAL, 1e301}) {
    for (const bool of_place : {false, true}) {
      std::vector<BodyState> wrong = good;
      (of_place ? wrong[3].position : wrong[3].velocity).y = number;
      const auto write = [&](const std::vector<BodyState>& states) {
        ASSERT_EQ(
            cudaMemcpy(world.states(), states.data(), states.size() * sizeof(BodyState), cudaMemcpyDefault),
            cudaSuccess);
        ASSERT_EQ(world.wake(), Status::kOk);
      };
      write(wrong);
      EXPECT_EQ(world.step(1.0 / 60, 3), Status::kOutOfRange) << number;
      EXPECT_EQ(world.where(), 3u);
      EXPECT_EQ(world.time(), time);
      std::span<const WorldContact> contacts;
      ASSERT_EQ(world.contacts(contacts), Status::kOk);
      EXPECT_TRUE(contacts.empty());
      write(good);
    }
  }
  std::span<const BodyMotion> motions;
  ASSERT_EQ(world.bodies(motions), Status::kOk);
  BodyMotion away = motions[3];
  away.pose.translation[2] += 1000;
  ASSERT_EQ(world.set(3, away), Status::kOk);
  const double force[3] = {9e9 * world.mass_of(3), 0, 0}, none[3] = {};
  ASSERT_EQ(world.set_force(3, force, none), Status::kOk);
  EXPECT_EQ(world.step(1, 5), Status::kOutOfRange);
  EXPECT_EQ(world.where(), 3u);
  ASSERT_EQ(world.set_force(3, none, none), Status::kOk);
}

TEST(GpuWorlds, NameWhatIsWrong) {
  NEEDS_GPU();
  const FallingBodies bodies(3);
  GpuWorld world;
  ASSERT_EQ(world.set_assets(bodies.assets.views()), Status::kOk);
  std::vector<BodyDescription> wrong = bodies.descriptions;
  wrong[1].density = std::nan("");
  EXPECT_EQ(world.set_bodies(wrong), Status::kNoMass);
  EXPECT_EQ(world.where(), 1u);
  ASSERT_EQ(world.set_bodies(bodies.descriptions), Status::kOk);
  EXPECT_EQ(world.step(0), Status::kBadDuration);
  const double much[3] = {1e300, 0, 0}, none[3] = {};
  EXPECT_EQ(world.push(1, much, none), Status::kOutOfRange);
  EXPECT_EQ(world.set_force(9, none, none), Status::kUnknownInstance);
  EXPECT_EQ(world.step(1.0 / 60), Status::kOk);
}

}  // namespace
}  // namespace tandem::test
