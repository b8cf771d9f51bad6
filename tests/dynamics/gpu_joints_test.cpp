#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>

#include "dynamics/joined_boxes.h"
#include "dynamics/world_setup.h"
#include "tandem/dynamics/gpu_world.h"

namespace tandem::test {
namespace {

using namespace dynamics;

constexpr double kStep = 1.0 / 60;

class GpuJoints : public testing::Test {
 protected:
  void SetUp() override {
    int count = 0;
    if (cudaGetDeviceCount(&count) != cudaSuccess || count == 0) GTEST_SKIP() << "no GPU";
  }

  void begin(const JoinedBoxes& boxes, const WorldOptions& options = {.sleeping = false}) {
    ASSERT_EQ(world_.set_assets(boxes.assets.views()), Status::kOk);
    ASSERT_EQ(world_.set_bodies(boxes.descriptions, options, {}, boxes.joints), Status::kOk);
  }
  std::span<const WorldJoint> joints() {
    std::span<const WorldJoint> joints;
    EXPECT_EQ(world_.joints(joints), Status::kOk);
    return joints;
  }
  std::vector<std::uint32_t> broken() {
    std::span<const std::uint32_t> broken;
    EXPECT_EQ(world_.broken(broken), Status::kOk);
    return {broken.begin(), broken.end()};
  }
  std::span<const BodyMotion> bodies() {
    std::span<const BodyMotion> bodies;
    EXPECT_EQ(world_.bodies(bodies), Status::kOk);
    return bodies;
  }
  std::vector<BodyState> states() {
    std::vector<BodyState> out(world_.body_count());
    EXPECT_EQ(cudaMemcpy(out.data(), world_.states(), out.size() * sizeof(BodyState), cudaMemcpyDefault),
              cudaSuccess);
    return out;
  }

  GpuWorld world_;
};

bool same(const std::vector<BodyState>& p, const std::vector<BodyState>& q) {
  return p.size() == q.size() && std::memcmp(p.data(), q.data(), p.size() * sizeof(BodyState)) == 0;
}

// Nothing touches, so that only sines are rounded otherwise than on the CPU.
TEST_F(GpuJoints, MoveAChainAsASimulationDoes) {
  JoinedBoxes chain;
  for (int i = 0; i < 20; ++i) {
    const std::uint32_t link = chain.add(0.5 * i, 0, 20);
    chain.join(static_cast<JointKind>(i % 2), i > 0 ? link - 1 : kNoIndex, link, {0.5 * i - 0.25, 0, 20})
        .axis[1] = 1;
    chain.descriptions[link].filter.mask = 0;
  }
  begin(chain);
  WorldSetup setup;
  std::uint64_t where = 0;
  ASSERT_EQ(set_up(chain.assets.views(), chain.descriptions, {.sleeping = false}, chain.joints, setup, where),
            Status::kOk);
  setup.options.solver.kind = SolverKind::soft;
  const PairFilter filter = {.group = setup.group.data(), .mask = setup.mask.data()};
  SimulationParts parts;
  parts.contacts = make_scene_contacts(chain.assets.views(), 1, &filter);
  parts.joints = setup.joints;
  Simulation simulation(setup.properties, setup.states, std::move(parts), setup.options);
  for (int step = 0; step < 40; ++step) {
    simulation.step();
    ASSERT_EQ(world_.step(kStep), Status::kOk);
    const std::vector<BodyState> is = states();
    for (std::size_t i = 0; i < is.size(); ++i) {
      const BodyState& wanted = simulation.states()[i];
      ASSERT_LT(norm(is[i].position - wanted.position), 1e-4) << step << " " << i;
    }
    for (std::size_t i = 0; i < chain.joints.size(); ++i)
      ASSERT_NEAR(joints()[i].position, simulation.joint_memory()[i].position, 1e-4) << step << " " << i;
  }
}

TEST_F(GpuJoints, GiveTheSameBytesTwice) {
  const JoinedBoxes heap = heap_of_pairs();
  std::vector<BodyState> first;
  for (int run = 0; run < 2; ++run) {
    begin(heap);
    ASSERT_EQ(world_.step(kStep, 150), Status::kOk);
    if (run == 0) first = states();
    EXPECT_TRUE(same(states(), first));
  }
  std::size_t held = 0;
  for (const WorldJoint& joint : joints()) held += joint.holds ? 1 : 0;
  EXPECT_GT(held, 8u);
  EXPECT_EQ(held + broken().size(), heap.joints.size());
}

TEST_F(GpuJoints, TurnABarByAMotorBetweenLimits) {
  JoinedBoxes boxes;
  const std::uint32_t bar = boxes.add(0, 0, 1);
  JointDescription& motor = boxes.join(JointKind::hinge, kNoIndex, bar, {0, 0, 1});
  motor.speed = 3, motor.most_effort = 100, motor.least = -0.5, motor.most = 0.8;
  begin(boxes, {});
  ASSERT_EQ(world_.step(kStep, 60), Status::kOk);
  EXPECT_NEAR(joints()[0].position, 0.8, 0.01);
  EXPECT_NEAR(joints()[0].motor_effort, 100, 1);
  ASSERT_EQ(world_.set_motor(0, -2, 80), Status::kOk);
  ASSERT_EQ(world_.step(kStep, 10), Status::kOk);
  EXPECT_NEAR(joints()[0].speed, -2, 0.01);
  ASSERT_EQ(world_.step(kStep, 50), Status::kOk);
  EXPECT_NEAR(joints()[0].position, -0.5, 0.01);
  EXPECT_FALSE(bodies()[bar].sleeps);
  ASSERT_EQ(world_.set_motor(0, 0, 80), Status::kOk);
  ASSERT_EQ(world_.step(kStep, 60), Status::kOk);
  EXPECT_TRUE(bodies()[bar].sleeps);
}

// A box that is joined to the one on which it falls goes through it until the joint breaks.
TEST_F(GpuJoints, BreakAndLetTheirBodiesTouch) {
  JoinedBoxes boxes;
  const std::uint32_t lower = boxes.add(0, 0, 0.1), upper = boxes.add(0, 0, 0.3);
  boxes.join(JointKind::fixed, lower, upper, {0, 0, 0.2}).breaking_force = 100;
  begin(boxes);
  ASSERT_EQ(world_.step(kStep, 60), Status::kOk);
  EXPECT_EQ(broken(), std::vector<std::uint32_t>{0});
  EXPECT_FALSE(joints()[0].holds);
  EXPECT_GT(bodies()[upper].centre[2], 0.25);
  ASSERT_EQ(world_.step(kStep), Status::kOk);
  EXPECT_TRUE(broken().empty());
  EXPECT_EQ(world_.set_motor(0, 1, 1), Status::kBadJoint);
}

TEST_F(GpuJoints, AreAddedAndRemovedAndGoBackToAState) {
  JoinedBoxes boxes;
  const std::uint32_t a = boxes.add(0, 0, 0.1), b = boxes.add(0.5, 0, 0.1), c = boxes.add(0, 0, 3);
  boxes.join(JointKind::ball, kNoIndex, c, {0, 0, 3.1});
  begin(boxes, {});
  ASSERT_EQ(world_.step(kStep, 60), Status::kOk);
  std::shared_ptr<const GpuWorld::State> start;
  ASSERT_EQ(world_.save(start), Status::kOk);
  std::uint32_t place = 9;
  ASSERT_EQ(world_.add_joint({.kind = JointKind::fixed, .a = a, .b = b, .anchor = {0.25, 0, 0.1}}, place),
            Status::kOk);
  EXPECT_EQ(place, 1u);
  EXPECT_FALSE(bodies()[a].sleeps);
  ASSERT_EQ(world_.remove_joint(0), Status::kOk);
  EXPECT_EQ(world_.remove_joint(0), Status::kBadJoint);
  ASSERT_EQ(world_.step(kStep, 60), Status::kOk);
  EXPECT_LT(bodies()[c].centre[2], 1);
  const std::vector<BodyState> fallen = states();
  ASSERT_EQ(world_.restore(*start), Status::kOk);
  EXPECT_EQ(joints().size(), 1u);
  ASSERT_EQ(world_.step(kStep, 60), Status::kOk);
  EXPECT_NEAR(bodies()[c].centre[2], 3, 1e-3);
  EXPECT_FALSE(same(states(), fallen));
}

TEST_F(GpuJoints, NameWhatIsWrong) {
  JoinedBoxes boxes;
  const std::uint32_t a = boxes.add(0, 0, 0.1);
  begin(boxes);
  std::uint32_t place = 0;
  EXPECT_EQ(world_.add_joint({.a = a, .b = 9}, place), Status::kUnknownInstance);
  EXPECT_EQ(world_.add_joint({.a = 0}, place), Status::kJoinsNothing);
  EXPECT_EQ(world_.add_joint({.kind = JointKind::hinge, .b = a, .axis = {0, 0, 0}}, place), Status::kNoAxis);
  EXPECT_EQ(world_.add_joint({.b = a, .speed = 1}, place), Status::kBadJoint);
  EXPECT_EQ(world_.remove_joint(0), Status::kBadJoint);
  EXPECT_EQ(world_.set_motor(0, 1, 1), Status::kBadJoint);
  boxes.join(JointKind::ball, 0, kNoIndex, {0, 0, 0});
  EXPECT_EQ(world_.set_bodies(boxes.descriptions, {}, {}, boxes.joints), Status::kJoinsNothing);
  EXPECT_EQ(world_.where(), 0u);
  EXPECT_TRUE(joints().empty());
}

}  // namespace
}  // namespace tandem::test
