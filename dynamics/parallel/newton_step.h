#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "dynamics/parallel/newton_islands.h"
#include "dynamics/parallel/soft_step.h"

namespace tandem::dynamics {

/// All that solving islands reads and writes.
struct NewtonStepView {
  NewtonIslandsView islands;
  StepNumbers step;
  SoftStepInput input;
  SoftStepOutput output;
  std::byte* memory;
  std::uint32_t units;  // of memory, that there are

  TANDEM_HD bool takes_all() const { return step.options.kind == SolverKind::newton; }
};

/// What the threads of a team share of an island.
struct NewtonShared {
  ContactIsland island;
  NewtonScratch scratch;
  std::uint32_t first_unit;
};

namespace newton_step_detail {

TANDEM_HD inline void carve(NewtonShared& shared, Carver& carver, const NewtonIsland& of,
                            std::uint32_t blocks) {
  shared.island.carve(carver, of.bodies + 1, of.contacts, of.pairs);
  shared.scratch.carve(carver, shared.island, blocks);
}

/// Gives the island memory. Result: false if there is too little.
template <typename Team>
TANDEM_HD bool take_memory(const Team& team, const NewtonStepView& view, const NewtonIsland& of,
                           std::uint32_t blocks, NewtonShared& shared) {
  constexpr std::uint32_t kTooMany = 0xFFFFFFFFu;
  if (team.rank() == 0) {
    NewtonNeeds& needs = *view.islands.needs;
    Carver counting(nullptr);
    carve(shared, counting, of, blocks);
    const auto units = static_cast<std::uint32_t>((counting.bytes() + NewtonNeeds::kUnit - 1) / NewtonNeeds::kUnit);
    const std::uint32_t first = atomic_add(needs.units, units);
    const bool has_room = first + units >= first && first + units <= view.units;
    shared.first_unit = has_room ? first : kTooMany;
    if (!has_room) atomic_least(needs.has_room, 0);
    if (has_room) {
      Carver carver(view.memory + std::size_t{NewtonNeeds::kUnit} * first);
      carve(shared, carver, of, blocks);
    }
  }
  team.barrier();
  return shared.first_unit != kTooMany;
}

template <typename Team>
TANDEM_HD void fill(const Team& team, const NewtonStepView& view, const NewtonIslandPlan<Team>& plan,
                    const NewtonShared& shared) {
  const ContactIsland& island = shared.island;
  const RowMaker rows(view.step);
  if (team.rank() == 0) {
    island.bodies[0] = 0;
    for (std::uint32_t k = 0, begin = 0; k < island.pair_count(); begin = island.pairs[k++].end)
      island.pairs[k].begin = begin, island.pairs[k].end = begin + plan.pair(k).count;
  }
  team.each(plan.island().bodies, [&](std::uint32_t k) { island.bodies[k + 1] = plan.body(k); });
  team.barrier();
  team.each(island.pair_count(), [&](std::uint32_t k) {
    TouchingPair& pair = island.pairs[k];
    const ContactPair& from = plan.pair(k);
    pair.a = plan.place_of(from.a), pair.b = plan.place_of(from.b);
    for (std::uint32_t i = pair.begin; i < pair.end; ++i) island.contacts[i] = from.first + (i - pair.begin);
  });
  team.each(island.body_count(), [&](std::uint32_t j) { fill_island_body(rows, island, j); });
  team.barrier();
  plan.write_columns(shared.scratch.convex.matrix);
  list_pairs_of_bodies(team, island);
  team.each(island.pair_count(), [&](std::uint32_t k) {
    fill_island_pair(rows, view.input.contacts, view.input.start_impulses, island, island.pairs[k]);
  });
  team.barrier();
}

template <typename Team>
TANDEM_HD void write(const Team& team, const NewtonStepView& view, const NewtonIslandPlan<Team>& plan,
                     const ContactIsland& island) {
  team.each(plan.island().bodies, [&](std::uint32_t k) {
    const std::uint32_t body = island.bodies[k + 1];
    BodyState state = view.input.states[body];
    move_island_body(island, view.step, k + 1, state);
    view.output.states[body] = state;
    view.islands.is_solved[body] = 1;
  });
  team.each(island.pair_count(), [&](std::uint32_t k) {
    write_island_pair(island, island.pairs[k], view.output.impulses);
    if (view.output.done != nullptr) write_island_pair(island, island.pairs[k], view.output.done);
    view.islands.is_pair_solved[plan.number_of_pair(k)] = 1;
  });
}

}  // namespace newton_step_detail

/// Solves an island if it is slender, has room, and converges.
template <typename Team>
TANDEM_HD void solve_newton_island(const Team& team, const NewtonStepView& view, std::uint32_t island,
                                   NewtonShared& shared) {
  using namespace newton_step_detail;
  NewtonNeeds& needs = *view.islands.needs;
  const NewtonIslandPlan<Team> plan(team, view.islands, island);
  if (!plan.find_layers(view.takes_all())) return;
  if (parts_for(plan.most_turn(view.input.contacts, view.step.states, view.step.dt)) > 1) {
    if (team.rank() == 0) atomic_add(needs.spinning, 1);
    return;
  }
  if (!take_memory(team, view, plan.island(), plan.put_in_order(), shared)) return;
  fill(team, view, plan, shared);
  NoJoints none;
  NewtonStep<Team, NoJoints> step(team, shared.island, shared.scratch, view.step, view.step.options.correction,
                                  none);
  const bool solved = step.solve();
  if (solved) write(team, view, plan, shared.island);
  if (team.rank() == 0) atomic_add(solved ? needs.solved : needs.failed, 1);
}

struct SolveNewtonIslands {
  NewtonStepView view;
  template <typename Team>
  TANDEM_HD void operator()(const Team& team, std::uint32_t island, NewtonShared& shared) const {
    solve_newton_island(team, view, island, shared);
  }
};

/// Solves slender islands by Newton's method, a team each, as IslandSolver does islands without joints.
/// Islands that need a step in parts, or have more bodies or pairs than kMostNewtonBodies and
/// kMostNewtonPairs, are left to soft steps. Nothing waits for a GPU but reserve().
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
    take(of_bodies_.reserve(kOfBody * std::uint64_t{bodies_})), take(is_solved_.reserve(bodies_));
    take(islands_.reserve(bodies_));
    take(of_pairs_.reserve(kOfPair * std::uint64_t{pairs_})), take(is_pair_solved_.reserve(pairs_));
    take(soft_pairs_.reserve(pairs_));
    take(memory_.reserve(std::uint64_t{NewtonNeeds::kUnit} * units_));
    return status;
  }
  std::uint32_t units() const { return units_; }

  /// What the last step needed and did, in the executor's memory.
  const NewtonNeeds* needs() const { return needs_.data(); }

  /// Solves islands; the result is what is left to soft steps. Condition: there is room for all bodies and for
  /// input.most_pairs pairs.
  SoftStepInput step(Executor& executor, const SoftStepInput& input, const SolverOptions& options,
                     const SoftStepOutput& output) {
    const NewtonStepView view = view_of(input, options, output);
    find_newton_islands(executor, view.islands, input.body_count, view.takes_all());
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

 private:
  static constexpr std::uint32_t kOfBody = 10, kOfPair = 2;

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
                                       is_solved_.data(),
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
  Array<std::uint8_t> is_solved_, is_pair_solved_;
  Array<ContactPair> soft_pairs_;
  Array<std::byte> memory_;
};

}  // namespace tandem::dynamics
