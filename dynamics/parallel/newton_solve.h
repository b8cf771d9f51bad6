#pragma once
#include <cstddef>
#include <cstdint>

#include "dynamics/parallel/newton_islands.h"
#include "dynamics/parallel/parallel_soft_step.h"
#include "dynamics/part_contacts.h"

/// How a team solves an island of a parallel step by Newton's method.
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

/// The bodies of an island and of what it touches, with numbers of their own: first those that move, in their
/// order, then for each pair what contacts do not move.
struct OwnBodies {
  std::span<BodyProperties> properties;
  std::span<BodyState> states;
  std::span<Pull> pulls;

  TANDEM_HD void carve(Carver& carver, std::size_t count) {
    carver.take(count, properties), carver.take(count, states), carver.take(count, pulls);
  }
};

/// What the threads of a team share of an island.
struct NewtonShared {
  ContactIsland island;
  NewtonScratch scratch;
  OwnBodies bodies;  // of a step in parts, as `part`
  PartContacts part;
  SparseColumns columns;
  StepNumbers step;  // of the island, or of a part
  const ContactPoint* contacts;
  const ContactImpulse* impulses;
  std::uint32_t first_unit;

  /// parts: of the step.
  TANDEM_HD void carve(Carver& carver, const NewtonIsland& of, std::uint32_t blocks, std::uint32_t parts) {
    island.carve(carver, of.bodies + 1, of.contacts, of.pairs);
    scratch.carve(carver, island, blocks);
    if (parts == 1) return;
    bodies.carve(carver, of.bodies + of.pairs), part.carve(carver, of.contacts);
  }
};

/// A team that solves an island.
template <typename Team>
class NewtonIslandStep {
 public:
  TANDEM_HD NewtonIslandStep(const Team& team, const NewtonStepView& view, std::uint32_t island,
                             NewtonShared& shared)
      : team_(team), view_(view), with_(shared), plan_(team, view.islands, island, shared.columns) {}

  /// Solves the island if it is slender, has room, and converges.
  TANDEM_HD void solve() {
    if (!plan_.find_layers(view_.takes_all())) return;
    const double turn = plan_.most_turn(view_.input.contacts, view_.step.states, view_.step.dt);
    std::uint32_t parts = parts_for(turn);
    if (!take_memory(plan_.put_in_order(), parts)) return;
    lay_out();
    bool solved = solve_in(parts);
    for (; !solved && parts > 1; solved = solve_in(parts)) parts = 1;
    if (solved) write(parts);
    NewtonNeeds& needs = *view_.islands.needs;
    if (team_.rank() == 0) atomic_add(solved ? needs.solved : needs.failed, 1);
  }

 private:
  /// Gives the island memory. Result: false if there is too little.
  TANDEM_HD bool take_memory(std::uint32_t blocks, std::uint32_t parts) const {
    constexpr std::uint32_t kNowhere = 0xFFFFFFFFu;
    if (team_.rank() == 0) {
      NewtonNeeds& needs = *view_.islands.needs;
      Carver counting(nullptr);
      with_.carve(counting, plan_.island(), blocks, parts);
      const auto units =
          static_cast<std::uint32_t>((counting.bytes() + NewtonNeeds::kUnit - 1) / NewtonNeeds::kUnit);
      const std::uint32_t first = atomic_add(needs.units, units);
      const bool has_room = first <= view_.units && units <= view_.units - first;
      with_.first_unit = has_room ? first : kNowhere;
      if (has_room) {
        Carver carver(view_.memory + std::size_t{NewtonNeeds::kUnit} * first);
        with_.carve(carver, plan_.island(), blocks, parts);
      } else {
        atomic_least(needs.has_room, 0);
      }
    }
    team_.barrier();
    return with_.first_unit != kNowhere;
  }

  // Gives pairs their bodies and contacts, and the matrix its columns.
  TANDEM_HD void lay_out() const {
    const ContactIsland& island = with_.island;
    if (team_.rank() == 0) {
      island.bodies[0] = 0;
      for (std::uint32_t k = 0, begin = 0; k < island.pair_count(); begin = island.pairs[k++].end)
        island.pairs[k].begin = begin, island.pairs[k].end = begin + plan_.pair(k).count;
    }
    team_.each(island.pair_count(), [&](std::uint32_t k) {
      island.pairs[k].a = plan_.place_of(plan_.pair(k).a),
      island.pairs[k].b = plan_.place_of(plan_.pair(k).b);
    });
    team_.barrier();
    plan_.write_columns(with_.scratch.convex.matrix);
    list_pairs_of_bodies(team_, island);
  }

  // Solves the step in so many parts. Result: whether all of them converged.
  TANDEM_HD bool solve_in(std::uint32_t parts) const {
    if (parts > 1)
      begin_parts(parts);
    else
      take_whole_step();
    for (std::uint32_t part = 0; part < parts; ++part) {
      fill();
      NoJoints none;
      NewtonStep<Team, NoJoints> step(team_, with_.island, with_.scratch, with_.step,
                                      with_.step.options.correction, none);
      if (!step.solve()) return false;
      if (parts > 1) end_part();
    }
    return true;
  }

  TANDEM_HD void take_whole_step() const {
    const ContactIsland& island = with_.island;
    if (team_.rank() == 0) {
      with_.step = view_.step;
      with_.contacts = view_.input.contacts, with_.impulses = view_.input.start_impulses;
    }
    team_.each(bodies(), [&](std::uint32_t k) { island.bodies[k + 1] = plan_.body(k); });
    for_contacts(
        [&](std::uint32_t, std::uint32_t i, std::uint32_t contact) { island.contacts[i] = contact; });
    team_.barrier();
  }

  // A step in parts has bodies and contacts of its own, which change from part to part.
  TANDEM_HD void begin_parts(std::uint32_t parts) const {
    const ContactIsland& island = with_.island;
    const OwnBodies& own = with_.bodies;
    if (team_.rank() == 0) {
      with_.step = view_.step;
      with_.step.dt /= parts;
      with_.step.bodies = own.properties, with_.step.states = own.states, with_.step.pulls = own.pulls;
      with_.step.contacts = with_.part.contacts;
      with_.contacts = with_.part.contacts.data(), with_.impulses = with_.part.impulses.data();
    }
    const auto take = [&](std::uint32_t to, std::uint32_t body) {
      own.properties[to] = view_.input.bodies[body], own.states[to] = view_.input.states[body];
      own.pulls[to] = view_.input.pulls[body];
    };
    team_.each(bodies(), [&](std::uint32_t k) { take(k, plan_.body(k)), island.bodies[k + 1] = k; });
    team_.each(island.pair_count(), [&](std::uint32_t k) {
      const TouchingPair& pair = island.pairs[k];
      if (pair.a == 0 || pair.b == 0) take(bodies() + k, plan_.pair(k).body(pair.a == 0 ? 0 : 1));
    });
    team_.barrier();
    for_contacts([&](std::uint32_t k, std::uint32_t i, std::uint32_t contact) {
      const auto own_number = [&](std::uint32_t place) { return place > 0 ? place - 1 : bodies() + k; };
      ContactPoint moved = view_.input.contacts[contact];
      moved.body_a = own_number(island.pairs[k].a), moved.body_b = own_number(island.pairs[k].b);
      island.contacts[i] = i;
      with_.part.begin(i, moved, view_.input.start_impulses[contact], parts, own.states);
    });
    team_.barrier();
  }

  TANDEM_HD void fill() const {
    const ContactIsland& island = with_.island;
    const RowMaker rows(with_.step);
    team_.each(island.body_count(), [&](std::uint32_t j) { fill_island_body(rows, island, j); });
    team_.barrier();
    team_.each(island.pair_count(), [&](std::uint32_t k) {
      fill_island_pair(rows, with_.contacts, with_.impulses, island, island.pairs[k]);
    });
    team_.barrier();
  }

  TANDEM_HD void end_part() const {
    const ContactIsland& island = with_.island;
    const std::span<BodyState> states = with_.bodies.states;
    team_.each(bodies(), [&](std::uint32_t k) { move_island_body(island, with_.step, k + 1, states[k]); });
    team_.each(island.pair_count(), [&](std::uint32_t k) {
      const TouchingPair& pair = island.pairs[k];
      write_island_pair(island, pair, with_.part.impulses.data());
      const std::uint32_t other = bodies() + k;
      if ((pair.a == 0 || pair.b == 0) && with_.bodies.properties[other].motion == Motion::kinematic)
        advance(with_.bodies.properties[other], states[other], Vector3{}, Vector3{}, with_.step.dt);
    });
    team_.barrier();
    team_.each(island.contact_count(), [&](std::uint32_t i) { with_.part.end_part(i, states); });
    team_.barrier();
  }

  TANDEM_HD void write(std::uint32_t parts) const {
    const ContactIsland& island = with_.island;
    team_.each(bodies(), [&](std::uint32_t k) {
      const std::uint32_t body = plan_.body(k);
      BodyState state = parts > 1 ? with_.bodies.states[k] : view_.input.states[body];
      if (parts == 1) move_island_body(island, with_.step, k + 1, state);
      view_.output.states[body] = state;
      view_.islands.is_solved[body] = 1;
    });
    const auto write_to = [&](ContactImpulse* impulses) {
      if (impulses == nullptr) return;
      if (parts == 1)
        team_.each(island.pair_count(),
                   [&](std::uint32_t k) { write_island_pair(island, island.pairs[k], impulses); });
      else
        for_contacts([&](std::uint32_t, std::uint32_t i, std::uint32_t contact) {
          impulses[contact] = with_.part.sums[i];
        });
    };
    write_to(view_.output.impulses), write_to(view_.output.done);
    team_.each(island.pair_count(),
               [&](std::uint32_t k) { view_.islands.is_pair_solved[plan_.number_of_pair(k)] = 1; });
  }

  // Calls visit(k, i, contact) for each contact i of each pair k, by number in the step.
  template <typename Visit>
  TANDEM_HD void for_contacts(const Visit& visit) const {
    team_.each(with_.island.pair_count(), [&](std::uint32_t k) {
      const TouchingPair& pair = with_.island.pairs[k];
      for (std::uint32_t i = pair.begin; i < pair.end; ++i)
        visit(k, i, plan_.pair(k).first + (i - pair.begin));
    });
  }

  TANDEM_HD std::uint32_t bodies() const { return plan_.island().bodies; }

  const Team& team_;
  const NewtonStepView& view_;
  NewtonShared& with_;
  NewtonIslandPlan<Team> plan_;
};

}  // namespace tandem::dynamics
