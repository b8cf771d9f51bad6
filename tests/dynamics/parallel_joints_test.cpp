#include <gtest/gtest.h>

#include "dynamics/both_ways.h"
#include "dynamics/joined_boxes.h"

namespace tandem::test {
namespace {

using namespace dynamics;

BothWays begin(const JoinedBoxes& boxes, const WorldOptions& options = {}, std::uint32_t threads = 1) {
  return BothWays(boxes, options, threads, boxes.joints);
}

void steps(BothWays& both, int count) {
  for (int step = 0; step < count && !testing::Test::HasFatalFailure(); ++step) both.step(step);
}

TEST(ParallelJoints, AreThoseOfASimulationInAHeap) {
  const JoinedBoxes heap = heap_of_pairs();
  for (const std::uint32_t threads : {1u, 3u}) {
    BothWays both = begin(heap, {.sleeping = false}, threads);
    steps(both, 150);
    EXPECT_GT(both.touching, 1000u);
    std::size_t held = 0;
    for (const Joint& joint : both.simulation->joints()) held += joint.holds ? 1 : 0;
    EXPECT_GT(held, 10u);
    EXPECT_LT(held, 15u);
  }
}

// Nothing touches: joints alone hold these bodies.
TEST(ParallelJoints, HoldBodiesThatTouchNothing) {
  for (const JointKind kind :
       {JointKind::ball, JointKind::hinge, JointKind::slider, JointKind::fixed, JointKind::distance}) {
    SCOPED_TRACE(static_cast<int>(kind));
    JoinedBoxes boxes;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t body = boxes.add(0.5 * i, 0, 3);
      JointDescription& joint = boxes.join(kind, i == 0 ? kNoIndex : body - 1, body, {0.5 * i - 0.2, 0, 3.1});
      joint.axis[0] = 0.3, joint.axis[1] = 1, joint.axis[2] = 0.4;
      joint.anchor_b[0] += 0.1;
      if (kind == JointKind::slider) joint.least = -0.1, joint.most = 0.1;
    }
    BothWays both = begin(boxes, {.sleeping = false});
    steps(both, 60);
    EXPECT_EQ(both.touching, 0u);
    const double fallen = 3 - both.states()[3].position.z;
    EXPECT_EQ(fallen > 0.02, kind != JointKind::fixed) << fallen;
    EXPECT_LT(fallen, 2);
  }
}

TEST(ParallelJoints, MakeAChainThatFallsOnTheFloor) {
  JoinedBoxes chain;
  for (int i = 0; i < 20; ++i) {
    const std::uint32_t link = chain.add(0.42 * i, 0, 1.5);
    if (i > 0) chain.join(JointKind::ball, link - 1, link, {0.42 * i - 0.21, 0, 1.5});
  }
  chain.join(JointKind::ball, kNoIndex, 1, {-0.2, 0, 1.5});
  BothWays both = begin(chain, {.sleeping = false}, 2);
  steps(both, 120);
  EXPECT_GT(both.touching, 100u);
}

// Soft joints give way to a load that is 1,000 times as heavy as a link, by no more than docs/joints.md says.
TEST(ParallelJoints, HoldALoad) {
  for (const double load : {1.0, 1000.0}) {
    JoinedBoxes chain;
    for (int i = 0; i < 20; ++i) {
      const std::uint32_t link = chain.add(0, 0, 6 - 0.2 * i);
      chain.descriptions[link].filter.mask = 0;
      chain.join(JointKind::ball, i > 0 ? link - 1 : kNoIndex, link, {0, 0, 6.1 - 0.2 * i});
    }
    chain.descriptions.back().density = load * 1000;
    BothWays both = begin(chain, {.sleeping = false});
    double apart = 0;
    for (int step = 0; step < 300 && !HasFatalFailure(); ++step) {
      both.step(step);
      for (const Joint& joint : both.simulation->joints()) {
        const BodyState a = state_of(joint.a, both.states()), b = state_of(joint.b, both.states());
        apart = std::max(apart, norm(into_world(a, joint.anchor_a) - into_world(b, joint.anchor_b)));
      }
    }
    EXPECT_LT(apart, load > 1 ? 0.02 : 4e-4);
  }
}

// A body that kinematic ones carry, and a bar that a motor turns between limits.
TEST(ParallelJoints, ActOnKinematicBodiesAndByMotors) {
  JoinedBoxes boxes;
  const std::uint32_t carrier = boxes.add(0, 0, 2), load = boxes.add(0, 0, 1.7), bar = boxes.add(2, 0, 1);
  boxes.descriptions[carrier].filter.motion = Motion::kinematic;
  boxes.descriptions[carrier].velocity[0] = 0.5, boxes.descriptions[carrier].angular_velocity[2] = 1;
  boxes.join(JointKind::hinge, carrier, load, {0, 0, 1.85}).axis[0] = 1;
  JointDescription& motor = boxes.join(JointKind::hinge, kNoIndex, bar, {2, 0, 1});
  motor.speed = 3, motor.most_effort = 100, motor.least = -0.5, motor.most = 0.8;
  BothWays both = begin(boxes);
  steps(both, 60);
  EXPECT_NEAR(both.simulation->joint_memory()[1].position, 0.8, 0.01);
  both.set_motor(1, -2, 80);
  steps(both, 60);
  EXPECT_NEAR(both.simulation->joint_memory()[1].position, -0.5, 0.01);
}

TEST(ParallelJoints, BreakAndLetTheirBodiesTouch) {
  JoinedBoxes boxes;
  const std::uint32_t upper = boxes.add(0, 0, 0.30), lower = boxes.add(0, 0, 0.1);
  JointDescription& joint = boxes.join(JointKind::fixed, lower, upper, {0, 0, 0.2});
  joint.breaking_force = 100;
  BothWays both = begin(boxes);
  EXPECT_FALSE(both.simulation->joints()[0].may_touch);
  std::size_t broken = 0;
  for (int step = 0; step < 60 && !HasFatalFailure(); ++step) {
    both.step(step);
    broken += both.parallel.broken().size();
  }
  EXPECT_EQ(broken, 1u);
  EXPECT_GT(both.states()[upper].position.z, 0.25);  // it lies on the lower one
}

TEST(ParallelJoints, SleepAndWakeTogether) {
  JoinedBoxes boxes;
  const std::uint32_t a = boxes.add(0, 0, 0.1), b = boxes.add(0.5, 0, 0.1), c = boxes.add(1, 0, 0.1);
  const std::uint32_t hook = boxes.add(3, 0, 3), hung = boxes.add(3, 0, 2.7), far = boxes.add(-3, 0, 0.1);
  boxes.descriptions[hook].filter.motion = Motion::fixed;
  boxes.join(JointKind::ball, a, b, {0.25, 0, 0.1}), boxes.join(JointKind::hinge, b, c, {0.75, 0, 0.1});
  boxes.join(JointKind::ball, hook, hung, {3, 0, 2.85});
  const std::uint32_t turned = boxes.add(-3, 2, 2);
  JointDescription& motor = boxes.join(JointKind::hinge, kNoIndex, turned, {-3, 2, 2});
  motor.most_effort = 10;
  BothWays both = begin(boxes);
  steps(both, 60);
  ASSERT_EQ(both.sleeping(), 6u);
  // A motor keeps its body awake, and no other.
  both.set_motor(3, 1e-4, 10);
  steps(both, 60);
  ASSERT_EQ(both.sleeping(), 5u);
  // A body that is placed wakes what it is joined to; what is placed and fixed too.
  BodyState state = both.states()[c];
  state.velocity.x = 1;
  both.place(c, state);
  ASSERT_EQ(both.sleeping(), 2u);
  state = both.states()[hook];
  state.position.x += 0.1;
  both.place(hook, state);
  ASSERT_EQ(both.sleeping(), 1u);
  steps(both, 150);
  // A joint that is added wakes its bodies, and so does one that is removed.
  both.remove_joint(1);
  JointDescription rod;
  rod.kind = JointKind::distance, rod.a = far, rod.b = a;
  const Vector3 from = both.states()[far].position, to = both.states()[a].position;
  rod.anchor[0] = from.x, rod.anchor[1] = from.y, rod.anchor[2] = from.z;
  rod.anchor_b[0] = to.x, rod.anchor_b[1] = to.y, rod.anchor_b[2] = to.z;
  EXPECT_EQ(both.add_joint(rod), 1u);
  EXPECT_FALSE(both.simulation->sleeps(far));
  EXPECT_EQ(both.add_joint({.kind = JointKind::ball, .b = far}), 4u);
  steps(both, 120);
}

// An awake body wakes what joints hang on it, by and by.
TEST(ParallelJoints, WakeABodyThatIsJoinedToOneAwake) {
  JoinedBoxes boxes;
  const std::uint32_t a = boxes.add(0, 0, 0.1), b = boxes.add(0.5, 0, 0.1);
  const std::uint32_t mover = boxes.add(2, 0, 2);
  boxes.descriptions[mover].filter.motion = Motion::kinematic;
  BothWays both = begin(boxes);
  steps(both, 60);
  ASSERT_EQ(both.sleeping(), 2u);
  both.add_joint({.kind = JointKind::ball, .a = a, .b = b, .anchor = {0.25, 0, 0.1}});
  both.add_joint({.kind = JointKind::ball, .a = mover, .b = b, .anchor = {0.7, 0, 0.2}});
  steps(both, 120);
  EXPECT_EQ(both.sleeping(), 0u);
}

TEST(ParallelJoints, KeepJoinedBodiesFromTouchingUnlessTheyMay) {
  for (const bool may_touch : {false, true}) {
    JoinedBoxes boxes;
    const std::uint32_t a = boxes.add(0, 0, 0.1), b = boxes.add(0.05, 0.02, 0.31);
    boxes.join(JointKind::distance, a, b, {0, 0, 0.1}).may_touch = may_touch;
    boxes.joints[0].anchor_b[2] = 0.31, boxes.joints[0].least = 0, boxes.joints[0].most = 1;
    BothWays both = begin(boxes);
    steps(both, 60);
    EXPECT_EQ(both.states()[b].position.z > 0.25, may_touch);
    // What was remembered of a pair goes where a joint keeps it from touching.
    if (may_touch) both.add_joint({.kind = JointKind::ball, .a = b, .b = a, .anchor = {0, 0, 0.3}});
    steps(both, 60);
  }
}

// A plate that so many boxes touch has as many colours, each with groups of its own, and there is too little
// room for those at first.
TEST(ParallelJoints, AreNotSolvedWhereRoomIsShort) {
  JoinedBoxes boxes;
  const std::uint32_t plate = boxes.add(0, 0, 0.2);
  boxes.descriptions[plate].asset = 0;
  for (int i = 0; i < 150; ++i) {
    const double x = 0.5 * (i % 15) - 3, y = 0.4 * (i / 15) - 2;
    const std::uint32_t box = boxes.add(x, y, 0.5);
    if (i % 15 > 0) boxes.join(JointKind::ball, box - 1, box, {x - 0.25, y, 0.5});
  }
  BothWays both = begin(boxes, {.sleeping = false}, 2);
  steps(both, 3);
  EXPECT_GT(both.touching, 3 * 150u);
}

// Joined bodies that fall fast stop together, and joints are where they are then.
TEST(ParallelJoints, StopTogetherWhereMotionIsContinuous) {
  JoinedBoxes boxes;
  for (int i = 0; i < 4; ++i) {
    const std::uint32_t a = boxes.add(2.0 * i, 0, 1), b = boxes.add(2.0 * i + 0.5, 0, 1);
    JointDescription& joint =
        boxes.join(i % 2 == 0 ? JointKind::hinge : JointKind::ball, a, b, {2.0 * i + 0.25, 0, 1});
    joint.axis[1] = 1, joint.breaking_force = i == 3 ? 1000 : INFINITY;
    boxes.descriptions[a].velocity[2] = boxes.descriptions[b].velocity[2] = -60 - 10 * i;
    boxes.descriptions[b].angular_velocity[1] = 5;
  }
  BothWays both = begin(boxes, {.continuous = true});
  steps(both, 60);
  EXPECT_GT(both.fast, 0u);
  EXPECT_FALSE(both.simulation->joints()[3].holds);
  for (std::uint32_t i = 1; i < both.parallel.bodies(); ++i) EXPECT_GT(both.states()[i].position.z, 0);
}

// Going back brings joints back that broke, were added, removed or driven otherwise meanwhile.
TEST(ParallelJoints, GoBackToAState) {
  const JoinedBoxes heap = heap_of_pairs();
  BothWays both = begin(heap);
  steps(both, 10);
  BothWays::State state;
  both.save(state);
  std::size_t broken = 0;
  for (int run = 0; run < 2 && !HasFatalFailure(); ++run) {
    for (int step = 0; step < 60 && !HasFatalFailure(); ++step) {
      if (run == 0 && step == 5) both.remove_joint(2), both.set_motor(1, 3, 50);
      if (run == 0 && step == 6) both.add_joint({.kind = JointKind::fixed, .a = 1, .b = 5});
      if (run == 0 && step == 7) both.add_joint({.kind = JointKind::ball, .a = 4, .b = 9});
      both.step(step);
      broken += run == 0 ? both.simulation->broken().size() : 0;
    }
    both.restore(state);
  }
  EXPECT_GT(broken, 0u);
  EXPECT_EQ(both.parallel.joints().size(), heap.joints.size());
}

// More joints at one body than there are shared colours, and places that several teams take.
TEST(ParallelJoints, MayBeManyAtABody) {
  JoinedBoxes star;
  const std::uint32_t hub = star.add(0, 0, 3);
  for (int i = 0; i < 150; ++i) {
    const std::uint32_t tip = star.add(2 * std::cos(i * 0.5), 2 * std::sin(i * 0.5), 3 + 0.3 * i);
    star.join(JointKind::ball, hub, tip, {0, 0, 3});
  }
  BothWays both = begin(star, {.sleeping = false}, 3);
  steps(both, 3);
}

}  // namespace
}  // namespace tandem::test
