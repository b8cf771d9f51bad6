#include "dynamics/island_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dynamics/island_joints.h"

namespace tandem::dynamics {
namespace {

class ProblemMaker {
 public:
  ProblemMaker(const StepInput& input, const StepStart& start, const SolverOptions& options)
      : input_(input), impulses_(start.impulses), rows_({input, start.states, options}) {
    problem_.states = start.states;
  }

  // Contacts of a pair are side by side. place: of each body of the step.
  IslandProblem make(std::vector<std::uint32_t> bodies, std::vector<std::uint32_t> contacts,
                     std::span<const std::uint32_t> joints, std::span<std::uint32_t> place) {
    bodies.insert(bodies.begin(), 0);
    bodies_.resize(bodies.size());
    make_room(bodies.size(), contacts.size());
    for (std::uint32_t i = 1; i < bodies.size(); ++i) {
      place[bodies[i]] = i;
      bodies_[i] = rows_.body(bodies[i]);
      problem_.scale[i] = bodies_[i].scale;
      problem_.velocity[i] = bodies_[i].velocity;
      problem_.gravity[i] = bodies_[i].gravity;
    }
    problem_.bodies = std::move(bodies), problem_.contacts = std::move(contacts);
    const auto place_of = [&](std::uint32_t body) { return rows_.is_moved(body) ? place[body] : 0; };
    const auto count = static_cast<std::uint32_t>(problem_.contact_count());
    for (std::uint32_t begin = 0, end = 0; begin < count; begin = end) {
      const ContactPoint& contact = contact_of(begin);
      const ObjectPair pair = {contact.body_a, contact.body_b};
      while (end < count && ObjectPair{contact_of(end).body_a, contact_of(end).body_b} == pair) ++end;
      add_pair(begin, end, place_of(pair.a), place_of(pair.b));
    }
    problem_.joints.assign(joints.begin(), joints.end());
    for (const std::uint32_t joint : joints)
      add_joint_rows(problem_, input_, joint, place_of(input_.joints[joint].a),
                     place_of(input_.joints[joint].b));
    return std::move(problem_);
  }

 private:
  void make_room(std::size_t bodies, std::size_t contacts) {
    problem_.scale.resize(bodies);
    for (auto* list : {&problem_.velocity, &problem_.displacement, &problem_.gravity})
      list->assign(bodies, Vector6{});
    for (auto* list : {&problem_.a, &problem_.b}) list->resize(contacts);
    for (auto* list : {&problem_.normal, &problem_.first, &problem_.second}) list->resize(contacts);
    for (auto* list :
         {&problem_.first_direction, &problem_.second_direction, &problem_.drive, &problem_.impulse})
      list->resize(contacts);
    for (auto* list : {&problem_.separation, &problem_.friction, &problem_.rebound}) list->resize(contacts);
  }

  const ContactPoint& contact_of(std::uint32_t i) const { return input_.contacts[problem_.contacts[i]]; }

  void add_pair(std::uint32_t begin, std::uint32_t end, std::uint32_t a, std::uint32_t b) {
    TouchingPair pair = {};
    pair.begin = begin, pair.end = end;
    pair.drive = rows_.turning_drive(contact_of(begin));
    pair.rolling_resistance = rows_.material_of(contact_of(begin)).rolling_resistance;
    pair.impulse = Vector3{};
    pair.mobility = turning_mobility(bodies_[a], bodies_[b]);
    for (int k = 0; k < 3; ++k) {
      pair.turn[k] = {Vector6{}, Vector6{}};
      if (a > 0) pair.turn[k].a.angular = -bodies_[a].scale.spread.row[k];
      if (b > 0) pair.turn[k].b.angular = bodies_[b].scale.spread.row[k];
    }
    const std::span<const std::uint32_t> contacts = std::span(problem_.contacts).subspan(begin, end - begin);
    for (const std::uint32_t contact : contacts) pair.impulse += impulses_[contact].turning;
    const Material material = rows_.material_of(input_.contacts[contacts[0]]);
    rows_.visit_contacts(
        contacts, [&](std::size_t k, const ContactPoint& contact, const ContactPatch& patch) {
          const std::size_t i = begin + k;
          const ContactRows rows =
              rows_.rows(contact, patch, bodies_[a], bodies_[b], material, impulses_[contacts[k]]);
          problem_.a[i] = a, problem_.b[i] = b;
          problem_.normal[i] = rows.normal, problem_.first[i] = rows.first, problem_.second[i] = rows.second;
          problem_.first_direction[i] = rows.first_direction,
          problem_.second_direction[i] = rows.second_direction;
          problem_.drive[i] = rows.drive, problem_.impulse[i] = rows.impulse;
          problem_.separation[i] = rows.separation, problem_.rebound[i] = rows.rebound;
          problem_.friction[i] = rows.friction;
        });
    problem_.pairs.push_back(pair);
  }

  const StepInput& input_;
  std::span<const ContactImpulse> impulses_;
  RowMaker rows_;
  std::vector<SteppedBody> bodies_;
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

Residual residual_of(const IslandProblem& problem, std::size_t i, double target, double share) {
  Residual out;
  const ContactRow* rows[] = {&problem.normal[i], &problem.first[i], &problem.second[i]};
  const Vector3 impulse = share * problem.impulse[i];
  const double bound = problem.friction[i] * impulse.x;
  for (int k = 0; k < 3; ++k) {
    const double mobility = rows[k]->mobility();
    const double w = problem.along(*rows[k], i, problem.velocity) + at(problem.drive[i], k);
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
  apply_motion(input.bodies[body], problem.scale[place], velocity, displacement, input.dt, state);
  return state;
}

void apply_solution(const IslandProblem& problem, const StepInput& input, std::span<BodyState> states,
                    std::span<ContactImpulse> impulses) {
  for (std::size_t i = 1; i < problem.bodies.size(); ++i)
    states[problem.bodies[i]] = state_at_end(problem, input, i, problem.velocity[i], problem.displacement[i]);
  for (const TouchingPair& pair : problem.pairs) {
    for (std::uint32_t i = pair.begin; i < pair.end; ++i) {
      const Vector3& impulse = problem.impulse[i];
      impulses[problem.contacts[i]] = {
          impulse.x, impulse.y * problem.first_direction[i] + impulse.z * problem.second_direction[i],
          pair.impulse / (pair.end - pair.begin)};
    }
  }
  for (const JointRow& row : problem.joint_rows)
    input.joint_memory[row.joint].impulse[row.slot] = row.impulse;
}

}  // namespace tandem::dynamics
