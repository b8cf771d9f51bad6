#include "tandem/dynamics/gpu_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "dynamics/falling_bodies.h"
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

// Sines are rounded otherwise, and nearest points are others within the tolerance of distances, a twentieth
// of the slop; what bodies do multiplies that.
TEST(GpuWorlds, MoveBodiesAsASimulationDoes) {
  NEEDS_GPU();
  const FallingBodies bodies(24);
  BothWorlds both(bodies);
  double most = 0;
  for (int step = 0; step < 40; ++step) {
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
  std::span<const ObjectPair> touching;
  ASSERT_EQ(both.world.touching(touching), Status::kOk);
  EXPECT_GT(touching.size(), 25u);
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

TEST(GpuWorlds, NameWhatIsWrong) {
  NEEDS_GPU();
  const FallingBodies bodies(3);
  GpuWorld world;
  ASSERT_EQ(world.set_assets(bodies.assets.views()), Status::kOk);
  std::vector<BodyDescription> wrong = bodies.descriptions;
  wrong[1].density = std::nan("");
  EXPECT_EQ(world.set_bodies(wrong), Status::kNoMass);
  EXPECT_EQ(world.where(), 1u);
  EXPECT_EQ(world.set_bodies(bodies.descriptions, {.continuous = true}), Status::kBadOption);
  ASSERT_EQ(world.set_bodies(bodies.descriptions), Status::kOk);
  EXPECT_EQ(world.step(0), Status::kBadDuration);
  const double much[3] = {1e300, 0, 0}, none[3] = {};
  EXPECT_EQ(world.push(1, much, none), Status::kOutOfRange);
  EXPECT_EQ(world.set_force(9, none, none), Status::kUnknownInstance);
  EXPECT_EQ(world.step(1.0 / 60), Status::kOk);
}

}  // namespace
}  // namespace tandem::test
