#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "dynamics/parallel/bytes_of.h"
#include "dynamics/parallel/newton_solve.h"

namespace tandem::dynamics {

struct SolveNewtonIslands {
  NewtonStepView view;

  /// Returns whether an island is worth more threads than those of a warp.
  TANDEM_HD bool is_large(std::uint32_t island) const {
    constexpr std::uint32_t kMostBodies = 6, kMostContacts = 64;
    const NewtonIsland& of = view.islands.islands[island];
    return of.bodies > kMostBodies || of.contacts > kMostContacts;
  }
  template <typename Team>
  TANDEM_HD void operator()(const Team& team, std::uint32_t island, NewtonShared& shared) const {
    NewtonIslandStep<Team>(team, view, island, shared).solve();
  }
};

/// Solves slender islands by Newton's method, a team each, as IslandSolver does islands without joints.
/// Islands that have more bodies or pairs than kMostNewtonBodies and kMostNewtonPairs are left to soft steps.
/// Nothing waits for a GPU but reserve().
template <typename Executor>
class ParallelNewtonStep {
 public:
  /// Makes room where there is less. units: of memory, see NewtonNeeds.
  Status reserve(Executor& executor, std::uint32_t bodies, std::uint32_t pairs, std::uint32_t units) {
    bodies_ = std::max(bodies, bodies_), pairs_ = std::max(pairs, pairs_), units_ = std::max(units, units_);
    Status status = executor.reserve(pairs_ + 1);
    const auto take = [&](Status of) {
      if (status == Status::kOk) status = of;
    };
    take(needs_.reserve(1)), take(numbers_.reserve(3));
    take(of_bodies_.reserve(kOfBody * std::uint64_t{bodies_}));
    take(flags_of_bodies_.reserve(2 * std::uint64_t{bodies_}));
    take(islands_.reserve(bodies_));
    take(of_pairs_.reserve(kOfPair * std::uint64_t{pairs_})), take(is_pair_solved_.reserve(pairs_));
    take(soft_pairs_.reserve(pairs_));
    take(memory_.reserve(std::uint64_t{NewtonNeeds::kUnit} * units_));
    return status;
  }
  std::uint32_t units() const { return units_; }

  /// What the last step needed and did, in the executor's memory.
  const NewtonNeeds* needs() const { return needs_.data(); }

  /// Solves islands; the result is what is left to soft steps. Condition: there is room for all bodies and
  /// for input.most_pairs pairs. has_changed: if the step was solved before, which bodies have contacts since
  /// then; islands without such bodies keep what that solution wrote.
  SoftStepInput step(Executor& executor, const SoftStepInput& input, const SolverOptions& options,
                     const SoftStepOutput& output, const std::uint32_t* has_changed = nullptr) {
    NewtonStepView view = view_of(input, options, output);
    view.islands.has_changed = has_changed;
    find_newton_islands(executor, view.islands, input.joints, input.body_count, view.takes_all());
    executor.template by_teams<NewtonShared>(&view.islands.needs->islands, input.body_count,
                                             SolveNewtonIslands{view});
    SoftStepInput rest = input;
    std::uint32_t* const list = view.islands.found_pairs;
    std::uint32_t* const left = numbers_.data() + 2;
    ContactPair* const pairs = soft_pairs_.data();
    const std::uint8_t* const is_solved = view.islands.is_pair_solved;
    executor.select([=] TANDEM_HD(std::uint32_t i) { return is_solved[i] == 0; }, input.pair_count,
                    input.most_pairs, list, left);
    executor.for_each(left, input.most_pairs,
                      [=] TANDEM_HD(std::uint32_t i) { pairs[i] = input.pairs[list[i]]; });
    rest.pairs = pairs, rest.pair_count = left, rest.is_solved = view.islands.is_solved;
    return rest;
  }

  std::size_t bytes() const {
    return bytes_of(needs_, islands_, numbers_, of_bodies_, of_pairs_, flags_of_bodies_, is_pair_solved_,
                    soft_pairs_, memory_);
  }

 private:
  static constexpr std::uint32_t kOfBody = 11, kOfPair = 2;

  NewtonStepView view_of(const SoftStepInput& input, const SolverOptions& options,
                         const SoftStepOutput& output) const {
    const auto of_body = [&](std::uint32_t k) { return of_bodies_.data() + std::uint64_t{k} * bodies_; };
    const auto of_pair = [&](std::uint32_t k) { return of_pairs_.data() + std::uint64_t{k} * pairs_; };
    const NewtonIslandsView islands = {{input.pairs, input.pair_count, input.most_pairs, input.bodies},
                                       needs_.data(),
                                       numbers_.data(),
                                       numbers_.data() + 1,
                                       of_body(0),
                                       of_body(1),
                                       of_body(2),
                                       of_body(3),
                                       of_body(4),
                                       of_body(5),
                                       of_body(6),
                                       flags_of_bodies_.data(),
                                       flags_of_bodies_.data() + bodies_,
                                       of_body(10),
                                       nullptr,
                                       of_body(7),
                                       of_body(8),
                                       of_body(9),
                                       of_pair(0),
                                       of_pair(1),
                                       is_pair_solved_.data(),
                                       islands_.data()};
    return {islands, step_numbers(input, options), input, output, memory_.data(), units_};
  }

  template <typename T>
  using Array = typename Executor::template Array<T>;

  std::uint32_t bodies_ = 0, pairs_ = 0, units_ = 0;
  Array<NewtonNeeds> needs_;
  Array<NewtonIsland> islands_;
  Array<std::uint32_t> numbers_, of_bodies_, of_pairs_;
  Array<std::uint8_t> flags_of_bodies_, is_pair_solved_;
  Array<ContactPair> soft_pairs_;
  Array<std::byte> memory_;
};

}  // namespace tandem::dynamics
