#include <gtest/gtest.h>

#include <cstring>

#include "gpu/gpu_heap.cuh"
#include "gpu/needs_gpu.h"
#include "tandem/formats/gpu_stream.h"

namespace tandem::dynamics {
namespace {

using GpuSoftStep = test::GpuTest;

template <typename Thing>
bool same(const Thing& a, const Thing& b) {
  return std::memcmp(&a, &b, sizeof(Thing)) == 0;
}

// Sines and cosines of a GPU are not those of the CPU to the last bit: a body's rotation is by them, and what
// the rotation makes of its spin.
void expect_near(const Vector3& is, const Vector3& wanted, std::size_t body) {
  constexpr double kNear = 1e-12;
  EXPECT_LE(norm(is - wanted), kNear * (1 + norm(wanted))) << "body " << body;
}

void expect_same(const HeapResult& is, const HeapResult& wanted) {
  for (std::size_t i = 0; i < wanted.states.size(); ++i) {
    const BodyState &a = is.states[i], &b = wanted.states[i];
    ASSERT_TRUE(same(a.velocity, b.velocity)) << "body " << i;
    ASSERT_TRUE(same(a.position, b.position)) << "body " << i;
    expect_near(a.angular_velocity, b.angular_velocity, i);
    expect_near(turn_between(a.orientation, b.orientation), Vector3{}, i);
  }
  for (std::size_t i = 0; i < wanted.impulses.size(); ++i) {
    ASSERT_TRUE(same(is.impulses[i], wanted.impulses[i])) << "contact " << i;
    ASSERT_TRUE(same(is.done[i], wanted.done[i])) << "contact " << i;
  }
}

void expect_same_as_soft_solver(const RandomHeap& heap) {
  GpuHeap gpu;
  ASSERT_EQ(gpu.upload(heap, nullptr), Status::kOk);
  HeapResult is;
  ASSERT_EQ(gpu.make_step(), Status::kOk);
  ASSERT_EQ(gpu.read(is), Status::kOk);
  expect_same(is, solution(heap));
}

TEST_F(GpuSoftStep, GivesTheVelocitiesAndImpulsesOfSoftSolver) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    expect_same_as_soft_solver(RandomHeap({.bodies = 40 + 60 * seed, .pairs = 150 * seed, .seed = seed}));
  }
}

TEST_F(GpuSoftStep, TakesMorePairsThanItHasLanes) {
  expect_same_as_soft_solver(RandomHeap({.bodies = 100000, .pairs = 300000, .is_near = true}));
}

TEST_F(GpuSoftStep, LimitsTheEnergyThatContactsAdd) {
  for (const Motion what_drives : {Motion::fixed, Motion::kinematic})
    expect_same_as_soft_solver(wedged_heap(3, what_drives));
}

TEST_F(GpuSoftStep, ABodyMayTouchMoreOthersThanThereAreSharedColours) {
  expect_same_as_soft_solver(RandomHeap({.bodies = 500, .pairs = 700, .most_contacts = 3, .hub = 400}));
}

TEST_F(GpuSoftStep, MovesBodiesThatTouchNothing) {
  expect_same_as_soft_solver(RandomHeap({.bodies = 100, .pairs = 0}));
  expect_same_as_soft_solver(RandomHeap({.bodies = 100, .pairs = 3}));
}

TEST_F(GpuSoftStep, CanBeCapturedInAGraph) {
  const RandomHeap heap({});
  GpuStream stream;
  ASSERT_EQ(stream.create(), cudaSuccess);
  GpuHeap gpu;
  ASSERT_EQ(gpu.upload(heap, stream.get()), Status::kOk);
  ASSERT_EQ(gpu.make_step(), Status::kOk);
  ASSERT_EQ(gpu.make_steps_in_graph(3), cudaSuccess);
  HeapResult is;
  ASSERT_EQ(gpu.read(is), Status::kOk);
  expect_same(is, solution(heap));
}

}  // namespace
}  // namespace tandem::dynamics
