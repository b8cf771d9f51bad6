#include <gtest/gtest.h>

#include <cstring>

#include "gpu/gpu_heap.cuh"
#include "gpu/needs_gpu.h"
#include "tandem/formats/gpu_stream.h"

namespace tandem::dynamics {
namespace {

using GpuNewtonStep = test::GpuTest;

// A block sums up in another order than the CPU, so its passes end at other numbers within their bounds.
constexpr double kNear = 1e-6;

HeapResult result_of(GpuHeap& gpu) {
  HeapResult out;
  EXPECT_EQ(gpu.read(out), Status::kOk);
  return out;
}

void expect_near_the_cpus(const RandomHeap& heap, std::uint32_t least_solved) {
  GpuHeap gpu;
  ASSERT_EQ(gpu.upload(heap, nullptr), Status::kOk);
  ASSERT_EQ(gpu.make_step(), Status::kOk);
  EXPECT_GE(gpu.newton_needs().solved, least_solved);
  const HeapResult first = result_of(gpu);
  EXPECT_LT(largest_difference(first, solution(heap)), kNear);
  ASSERT_EQ(gpu.make_step(), Status::kOk);
  const HeapResult second = result_of(gpu);
  EXPECT_EQ(std::memcmp(first.states.data(), second.states.data(), first.states.size() * sizeof(BodyState)),
            0);
}

TEST_F(GpuNewtonStep, GivesWhatTheCpusSolverGives) {
  for (const SolverKind kind : {SolverKind::automatic, SolverKind::newton}) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
      SCOPED_TRACE(seed);
      expect_near_the_cpus(sparse_heap(seed, kind), 4);
    }
  }
}

// Boxes that slide below a heavy one are soft on the CPU too, but for a single one.
TEST_F(GpuNewtonStep, SolvesTowers) {
  for (const std::uint32_t boxes : {1u, 3u, 30u, 300u}) {
    SCOPED_TRACE(boxes);
    expect_near_the_cpus(tower(boxes), boxes == 1 ? 1 : 0);
    RandomHeap light = tower(boxes);
    light.bodies[boxes] = light.bodies[boxes > 1 ? 1 : boxes];
    for (BodyState& state : light.states) state.velocity = {};
    expect_near_the_cpus(light, boxes <= 30 ? 1 : 0);
  }
}

TEST_F(GpuNewtonStep, CanBeCapturedInAGraph) {
  const RandomHeap heap = tower(30);
  GpuStream stream;
  ASSERT_EQ(stream.create(), cudaSuccess);
  GpuHeap gpu;
  ASSERT_EQ(gpu.upload(heap, stream.get()), Status::kOk);
  ASSERT_EQ(gpu.make_step(), Status::kOk);
  ASSERT_EQ(gpu.make_steps_in_graph(3), cudaSuccess);
  EXPECT_LT(largest_difference(result_of(gpu), solution(heap)), kNear);
}

}  // namespace
}  // namespace tandem::dynamics
