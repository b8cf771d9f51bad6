#include "dynamics/island_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dynamics/island_joints.h"
#include "dynamics/team.h"

namespace tandem::dynamics {
namespace {

class ProblemMaker {
 public:
  ProblemMaker(const StepInput& input, const StepStart& start, const SolverOptions& options)
      : input_(input), impulses_(start.impulses), rows_({input, start.states, options}) {
    problem_.states = start.states;
  }

  // Contacts of a pair are side by side. place: of each body of the step.
  IslandProblem make(std::span<const std::uint32_t> bodies, std::span<const std::uint32_t> contacts,
                     std::span<const std::uint32_t> joints, std::span<std::uint32_t> place) {
    for (std::uint32_t i = 0; i < bodies.size(); ++i) place[bodies[i]] = i + 1;
    const auto place_of = [&](std::uint32_t body) { return rows_.is_moved(body) ? place[body] : 0; };
    std::vector<TouchingPair> pairs;
    for (std::uint32_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
      const ObjectPair pair = pair_of(input_.contacts[contacts[begin]]);
      while (end < contacts.size() && pair_of(input_.contacts[contacts[end]]) == pair) ++end;
      TouchingPair& to = pairs.emplace_back();
      to.begin = begin, to.end = end, to.a = place_of(pair.a), to.b = place_of(pair.b);
    }
    Carver counting(nullptr);
    problem_.carve(counting, bodies.size() + 1, contacts.size(), pairs.size());
    problem_.memory = std::make_unique_for_overwrite<std::byte[]>(counting.bytes());
    Carver carver(problem_.memory.get());
    problem_.carve(carver, bodies.size() + 1, contacts.size(), pairs.size());
    problem_.bodies[0] = 0;
    std::ranges::copy(bodies, problem_.bodies.begin() + 1);
    std::ranges::copy(contacts, problem_.contacts.begin());
    std::ranges::copy(pairs, problem_.pairs.begin());
    list_pairs_of_bodies(SerialTeam{}, problem_);
    for (std::uint32_t i = 0; i < problem_.body_count(); ++i) fill_island_body(rows_, problem_, i);
    for (TouchingPair& pair : problem_.pairs)
      fill_island_pair(rows_, input_.contacts.data(), impulses_.data(), problem_, pair);
    problem_.joints.assign(joints.begin(), joints.end());
    for (const std::uint32_t joint : joints)
      add_joint_rows(problem_, input_, joint, place_of(input_.joints[joint].a),
                     place_of(input_.joints[joint].b));
    return std::move(problem_);
  }

 private:
  const StepInput& input_;
  std::span<const ContactImpulse> impulses_;
  RowMaker rows_;
  IslandProblem problem_;
};

// Things by ascending layer, else in their order.
template <typename Layer>
std::vector<std::uint32_t> from_the_ground_up(std::span<const std::uint32_t> things, const Layer& layer) {
  std::vector<std::uint32_t> order(things.begin(), things.end());
  std::ranges::stable_sort(order, {}, layer);
  return order;
}

}  // namespace

IslandProblem make_island_problem(const StepInput& input, std::size_t island, const StepStart& start,
                                  const SolverOptions& options, std::span<const std::uint32_t> layers,
                                  std::span<std::uint32_t> place, std::span<const std::uint32_t> order) {
  const auto contacts = from_the_ground_up(input.islands.contacts_of(island), [&](std::uint32_t i) {
    return std::min(layers[input.contacts[i].body_a], layers[input.contacts[i].body_b]);
  });
  auto bodies = std::vector<std::uint32_t>(order.begin(), order.end());
  if (order.empty())
    bodies =
        from_the_ground_up(input.islands.bodies_of(island), [&](std::uint32_t body) { return layers[body]; });
  return ProblemMaker(input, start, options).make(bodies, contacts, input.islands.joints_of(island), place);
}

Residual residual_of(const ContactIsland& island, std::size_t i, double target) {
  Residual out;
  const ContactRow* rows[] = {&island.normal[i], &island.first[i], &island.second[i]};
  const Vector3 impulse = island.impulse[i];
  const double bound = island.friction[i] * impulse.x;
  for (int k = 0; k < 3; ++k) {
    const double mobility = rows[k]->mobility();
    const double w = island.along(*rows[k], i, island.velocity) + at(island.drive[i], k);
    const double own = at(impulse, k), other = k == 0 ? 0 : at(impulse, 3 - k);
    const double wanted = own - (w - (k == 0 ? target : 0)) / mobility;
    // A row of friction has what the other leaves of the cone.
    const double rest = std::sqrt(std::max(0.0, bound * bound - other * other));
    const double next = k == 0 ? std::max(0.0, wanted) : std::clamp(wanted, -rest, rest);
    out.add(std::fabs(next - own) * mobility);
  }
  return out;
}

BodyState state_at_end(const IslandProblem& problem, const StepInput& input, std::size_t place,
                       const Vector6& velocity, const Vector6& displacement) {
  const std::uint32_t body = problem.bodies[place];
  BodyState state = problem.states[body];
  apply_motion(input.bodies[body], problem.stepped[place].scale, velocity, displacement, input.dt, state);
  return state;
}

void apply_solution(const IslandProblem& problem, const StepInput& input, std::span<BodyState> states,
                    std::span<ContactImpulse> impulses) {
  for (std::uint32_t i = 1; i < problem.body_count(); ++i) {
    BodyState& state = states[problem.bodies[i]];
    state = problem.states[problem.bodies[i]];
    move_island_body(problem, input, i, state);
  }
  for (const TouchingPair& pair : problem.pairs) write_island_pair(problem, pair, impulses.data());
  for (const JointRow& row : problem.joint_rows)
    input.joint_memory[row.joint].impulse[row.slot] = row.impulse;
}

}  // namespace tandem::dynamics
