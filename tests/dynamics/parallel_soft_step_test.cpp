#include <gtest/gtest.h>

#include "dynamics/parallel/host_executor.h"
#include "dynamics/same_heap_results.h"

namespace tandem::dynamics {
namespace {

using HostStep = ParallelSoftStep<HostExecutor>;

void make_step(HostStep& step, HostExecutor& executor, const RandomHeap& heap, HeapResult& result) {
  const auto count = static_cast<std::uint32_t>(heap.pairs.size());
  const SoftStepInput input = {heap.bodies.data(),
                               heap.states.data(),
                               heap.pulls.data(),
                               static_cast<std::uint32_t>(heap.bodies.size()),
                               heap.contacts.data(),
                               heap.impulses.data(),
                               heap.pairs.data(),
                               &count,
                               count + 7,
                               heap.dt};
  step.step(executor, input, heap.options,
            {result.states.data(), result.impulses.data(), result.done.data()});
}

SoftStepRoom room_of(const RandomHeap& heap) {
  return usual_room(static_cast<std::uint32_t>(heap.bodies.size()),
                    static_cast<std::uint32_t>(heap.pairs.size()) + 7,
                    static_cast<std::uint32_t>(heap.contacts.size()));
}

HeapResult before(const RandomHeap& heap) {
  return {heap.states, heap.impulses, heap.impulses};
}

HeapResult parallel_solution(const RandomHeap& heap, std::uint32_t thread_count) {
  Threads threads(thread_count);
  HostExecutor executor(threads);
  HostStep step;
  HeapResult out = before(heap);
  EXPECT_EQ(step.reserve(executor, room_of(heap)), Status::kOk);
  make_step(step, executor, heap, out);
  // Rows are known once there is room for groups.
  for (int attempt = 0; attempt < 2 && step.needs()->has_room == 0; ++attempt) {
    EXPECT_EQ(step.reserve(executor, larger_room(step.room(), *step.needs())), Status::kOk);
    make_step(step, executor, heap, out);
  }
  EXPECT_EQ(step.needs()->has_room, 1u);
  return out;
}

void expect_same_as_soft_solver(const RandomHeap& heap) {
  const HeapResult wanted = solution(heap);
  EXPECT_TRUE(std::ranges::all_of(wanted.states, is_usable));
  for (const std::uint32_t threads : {1u, 3u}) {
    SCOPED_TRACE(threads);
    expect_same(parallel_solution(heap, threads), wanted);
  }
}

TEST(ParallelSoftStep, GivesTheBytesOfSoftSolver) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    expect_same_as_soft_solver(RandomHeap({.bodies = 40 + 60 * seed, .pairs = 150 * seed, .seed = seed}));
  }
}

TEST(ParallelSoftStep, LimitsTheEnergyThatContactsAdd) {
  for (const Motion what_drives : {Motion::fixed, Motion::kinematic})
    expect_same_as_soft_solver(wedged_heap(3, what_drives));
}

TEST(ParallelSoftStep, ABodyMayTouchMoreOthersThanThereAreSharedColours) {
  expect_same_as_soft_solver(RandomHeap({.bodies = 500, .pairs = 700, .most_contacts = 3, .hub = 400}));
}

TEST(ParallelSoftStep, MovesBodiesThatTouchNothing) {
  expect_same_as_soft_solver(RandomHeap({.bodies = 100, .pairs = 0}));
  expect_same_as_soft_solver(RandomHeap({.bodies = 100, .pairs = 3}));
}

TEST(ParallelSoftStep, TakesPairsOfManyContacts) {
  expect_same_as_soft_solver(RandomHeap({.bodies = 60, .pairs = 80, .most_contacts = 90}));
}

TEST(ParallelSoftStep, FollowsTheNumberOfSubsteps) {
  for (const std::uint32_t substeps : {1u, 5u}) {
    RandomHeap heap({.bodies = 80, .pairs = 200});
    heap.options.substeps = substeps;
    expect_same(parallel_solution(heap, 1), solution(heap));
  }
}

TEST(ParallelSoftStep, SaysWhatItNeedsWhereThereIsTooLittleRoom) {
  const RandomHeap heap({.bodies = 200, .pairs = 600});
  Threads threads(1);
  HostExecutor executor(threads);
  HostStep step;
  HeapResult out = before(heap);
  SoftStepRoom room = room_of(heap);
  room.groups = 4, room.rows = 10;
  ASSERT_EQ(step.reserve(executor, room), Status::kOk);
  make_step(step, executor, heap, out);
  EXPECT_EQ(step.needs()->has_room, 0u);
  EXPECT_EQ(step.needs()->pairs, heap.pairs.size());
  EXPECT_GT(step.needs()->groups, 4u);
  expect_same(out, before(heap));
  room.groups = step.needs()->groups;
  ASSERT_EQ(step.reserve(executor, room), Status::kOk);
  make_step(step, executor, heap, out);
  EXPECT_EQ(step.needs()->has_room, 0u);
  EXPECT_GT(step.needs()->rows, 10u);
  expect_same(out, before(heap));
  room.rows = step.needs()->rows;
  ASSERT_EQ(step.reserve(executor, room), Status::kOk);
  make_step(step, executor, heap, out);
  EXPECT_EQ(step.needs()->has_room, 1u);
  expect_same(out, solution(heap));
}

TEST(ParallelSoftStep, SolvesOneStepAfterAnother) {
  Threads threads(1);
  HostExecutor executor(threads);
  HostStep step;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const RandomHeap heap({.bodies = 300 / seed, .pairs = 600 / seed, .seed = seed});
    SoftStepRoom room = room_of(heap);
    room.groups += 100, room.rows += 1000;
    HeapResult out = before(heap);
    ASSERT_EQ(step.reserve(executor, room), Status::kOk);
    make_step(step, executor, heap, out);
    ASSERT_EQ(step.needs()->has_room, 1u);
    expect_same(out, solution(heap));
  }
}

}  // namespace
}  // namespace tandem::dynamics
