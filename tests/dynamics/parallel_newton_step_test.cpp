#include <gtest/gtest.h>

#include "dynamics/parallel/parallel_newton_step.h"
#include "dynamics/same_heap_results.h"
#include "dynamics/team_executor.h"

namespace tandem::dynamics {
namespace {

// A step by Newton's method and soft steps, with room for everything but what Newton's method needs.
template <typename Executor>
class BothSteps {
 public:
  BothSteps(Executor& executor, const RandomHeap& heap, std::uint32_t units)
      : executor_(executor), heap_(heap), count_(static_cast<std::uint32_t>(heap.pairs.size())) {
    reserve(units);
    const auto bodies = static_cast<std::uint32_t>(heap.bodies.size());
    SoftStepRoom room = usual_room(bodies, most(), static_cast<std::uint32_t>(heap.contacts.size()));
    room.groups += 200, room.rows += 2000;
    EXPECT_EQ(soft_.reserve(executor, room), Status::kOk);
  }

  void reserve(std::uint32_t units) {
    EXPECT_EQ(newton_.reserve(executor_, static_cast<std::uint32_t>(heap_.bodies.size()), most(), units),
              Status::kOk);
  }

  HeapResult step() {
    HeapResult out = {heap_.states, heap_.impulses, heap_.impulses};
    const SoftStepInput input = {heap_.bodies.data(),
                                 heap_.states.data(),
                                 heap_.pulls.data(),
                                 static_cast<std::uint32_t>(heap_.bodies.size()),
                                 heap_.contacts.data(),
                                 heap_.impulses.data(),
                                 heap_.pairs.data(),
                                 &count_,
                                 most(),
                                 heap_.dt};
    const SoftStepOutput output = {out.states.data(), out.impulses.data(), out.done.data()};
    soft_.step(executor_, newton_.step(executor_, input, heap_.options, output), heap_.options, output);
    EXPECT_EQ(soft_.needs()->has_room, 1u);
    return out;
  }
  const NewtonNeeds& needs() const { return *newton_.needs(); }

 private:
  std::uint32_t most() const { return count_ + 7; }

  Executor& executor_;
  const RandomHeap& heap_;
  std::uint32_t count_;
  ParallelNewtonStep<Executor> newton_;
  ParallelSoftStep<Executor> soft_;
};

constexpr std::uint32_t kMuch = 1 << 16;

TEST(ParallelNewtonStep, GivesTheBytesOfTheCpusSolver) {
  for (const SolverKind kind : {SolverKind::automatic, SolverKind::newton}) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
      SCOPED_TRACE(seed);
      const RandomHeap heap = sparse_heap(seed, kind);
      const HeapResult wanted = solution(heap);
      for (const std::uint32_t count : {1u, 3u}) {
        Threads threads(count);
        HostExecutor executor(threads);
        BothSteps<HostExecutor> steps(executor, heap, kMuch);
        expect_same(steps.step(), wanted);
        EXPECT_EQ(steps.needs().has_room, 1u);
        EXPECT_GT(steps.needs().solved, 3u);
        if (kind == SolverKind::newton) {
          EXPECT_EQ(steps.needs().solved + steps.needs().failed, steps.needs().islands);
        }
      }
    }
  }
}

// Bodies that spin fast have a step in parts; and where a part does not converge, a whole one.
TEST(ParallelNewtonStep, GivesTheBytesOfTheCpusSolverWhereBodiesSpinFast) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    RandomHeap heap = sparse_heap(seed, SolverKind::newton);
    std::uint32_t in_parts = 0;
    for (BodyState& state : heap.states) state.angular_velocity = 6 * state.angular_velocity;
    for (const ContactPoint& contact : heap.contacts)
      in_parts += parts_for(turn_about(contact, heap.states, heap.dt)) > 1 ? 1 : 0;
    EXPECT_GT(in_parts, 20u);
    Threads threads(1);
    HostExecutor executor(threads);
    BothSteps<HostExecutor> steps(executor, heap, kMuch);
    expect_same(steps.step(), solution(heap));
    EXPECT_GT(steps.needs().solved, 3u);
  }
}

TEST(ParallelNewtonStep, ATeamOfManyThreadsGivesTheSameBytesWhateverTheirNumber) {
  // Few bodies: threads wait for each other hundreds of times for each.
  RandomHeap spinning({.bodies = 12, .pairs = 6});
  spinning.options.kind = SolverKind::newton;
  for (BodyState& state : spinning.states) state.angular_velocity = 3 * state.angular_velocity;
  for (const RandomHeap& heap : {spinning, tower(5)}) {
    const HeapResult wanted = solution(heap);
    HeapResult first;
    for (const std::uint32_t size : {1u, 3u}) {
      SCOPED_TRACE(size);
      Threads threads(1);
      TeamExecutor executor(threads, size);
      BothSteps<TeamExecutor> steps(executor, heap, kMuch);
      const HeapResult is = steps.step();
      if (size == 1)
        first = is;
      else
        expect_same(is, first);
      EXPECT_LT(largest_difference(is, wanted), 1e-9);
    }
  }
}

TEST(ParallelNewtonStep, SaysWhatItNeedsWhereThereIsTooLittleRoom) {
  const RandomHeap heap = sparse_heap(1, SolverKind::automatic);
  Threads threads(1);
  HostExecutor executor(threads);
  BothSteps<HostExecutor> steps(executor, heap, 16);
  steps.step();
  EXPECT_EQ(steps.needs().has_room, 0u);
  const std::uint32_t units = steps.needs().units;
  EXPECT_GT(units, 16u);
  steps.reserve(units);
  expect_same(steps.step(), solution(heap));
  EXPECT_EQ(steps.needs().has_room, 1u);
  EXPECT_EQ(steps.needs().units, units);
}

TEST(ParallelNewtonStep, WhatDoesNotConvergeIsLeftToSoftSteps) {
  std::uint32_t failed = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const RandomHeap heap = sparse_heap(seed, SolverKind::newton);
    Threads threads(1);
    HostExecutor executor(threads);
    BothSteps<HostExecutor> steps(executor, heap, kMuch);
    expect_same(steps.step(), solution(heap));
    failed += steps.needs().failed;
  }
  EXPECT_GT(failed, 6u);
}

// A box that a fixed body presses from above into one from below has no place. Its gradient does not fall to
// nothing, for rounding, and what is left is small enough.
TEST(ParallelNewtonStep, ABoxThatIsPressedFromBothSidesConverges) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    RandomHeap heap = tower(3);
    heap.bodies[2].motion = Motion::fixed;
    for (std::size_t i = 0; i < 8; ++i) heap.contacts[i].depth = 0.01 * seed;
    Threads threads(1);
    HostExecutor executor(threads);
    BothSteps<HostExecutor> steps(executor, heap, kMuch);
    expect_same(steps.step(), solution(heap));
    EXPECT_EQ(steps.needs().failed, 0u);
    EXPECT_GT(steps.needs().solved, 0u);
  }
}

TEST(ParallelNewtonStep, IslandsThatAreTooLargeAreCounted) {
  const RandomHeap heap = tower(kMostNewtonBodies + 1);
  Threads threads(1);
  HostExecutor executor(threads);
  BothSteps<HostExecutor> steps(executor, heap, kMuch);
  RandomHeap soft = heap;
  soft.options.kind = SolverKind::soft;
  EXPECT_LT(largest_difference(steps.step(), solution(soft)), 1e-12);
  EXPECT_EQ(steps.needs().too_large, 1u);
  EXPECT_EQ(steps.needs().islands, 0u);
}

}  // namespace
}  // namespace tandem::dynamics
