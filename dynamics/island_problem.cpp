#include "dynamics/island_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dynamics/island_joints.h"

namespace tandem::dynamics {
namespace {

MassScale mass_scale(const BodyProperties& body, const BodyState& state) {
  return {std::sqrt(body.mass), matrix_of(state.orientation) * cholesky(body.inverse_inertia)};
}

Vector6 scaled(const MassScale& scale, const Vector3& velocity, const Vector3& spin) {
  return {scale.root_mass * velocity, inverse(scale.spread) * spin};
}

Vector6 gradient(const MassScale& scale, const Vector3& direction, const Vector3& arm) {
  return {direction / scale.root_mass, transposed(scale.spread) * cross(arm, direction)};
}

class ProblemMaker {
 public:
  ProblemMaker(const StepInput& input, std::span<const BodyState> states, const SolverOptions& options,
               std::span<const std::uint32_t> layers, std::span<std::uint32_t> place)
      : input_(input), states_(states), options_(options), layers_(layers), place_(place) {
    problem_.states = states;
  }

  IslandProblem make(std::size_t island, std::span<const ContactImpulse> impulses,
                     std::span<const std::uint32_t> order) {
    add_unmoved();
    const auto members = order.empty() ? input_.islands.bodies_of(island) : order;
    std::vector<std::uint32_t> bodies(members.begin(), members.end());
    if (order.empty())
      std::ranges::stable_sort(bodies, {}, [&](std::uint32_t body) { return layers_[body]; });
    for (const std::uint32_t body : bodies) add_body(body);
    find_deepest(input_.islands.contacts_of(island));
    const auto contacts = from_the_ground_up(input_.islands.contacts_of(island));
    reserve(contacts.size());
    for (const std::uint32_t contact : contacts) add_contact(contact, impulses[contact]);
    add_pairs(impulses);
    const auto joints = input_.islands.joints_of(island);
    problem_.joints.assign(joints.begin(), joints.end());
    const auto place_of = [&](std::uint32_t body) {
      return body != kNoIndex && is_moved(body) ? place_[body] : 0;
    };
    for (const std::uint32_t joint : joints) {
      const Joint& of = input_.joints[joint];
      add_joint_rows(problem_, input_, joint, place_of(of.a), place_of(of.b));
    }
    return std::move(problem_);
  }

 private:
  void add_unmoved() {
    problem_.bodies.push_back(0);
    problem_.scale.push_back({1, Matrix3::identity()});
    for (auto* list : {&problem_.velocity, &problem_.gravity}) list->push_back(Vector6{});
  }

  void add_body(std::uint32_t body) {
    const BodyState& state = states_[body];
    place_[body] = static_cast<std::uint32_t>(problem_.bodies.size());
    problem_.bodies.push_back(body);
    const MassScale scale = mass_scale(input_.bodies[body], state);
    problem_.scale.push_back(scale);
    problem_.velocity.push_back(scaled(scale, state.velocity, state.angular_velocity));
    problem_.gravity.push_back(scaled(scale, input_.gravity, Vector3{}));
  }

  std::vector<std::uint32_t> from_the_ground_up(std::span<const std::uint32_t> contacts) const {
    const auto layer = [&](std::uint32_t i) {
      return std::min(layers_[input_.contacts[i].body_a], layers_[input_.contacts[i].body_b]);
    };
    std::vector<std::uint32_t> order(contacts.begin(), contacts.end());
    std::stable_sort(order.begin(), order.end(), [&](auto i, auto j) { return layer(i) < layer(j); });
    return order;
  }

  void reserve(std::size_t count) {
    for (auto* list : {&problem_.contacts, &problem_.a, &problem_.b}) list->reserve(count);
    for (auto* list : {&problem_.normal, &problem_.first, &problem_.second}) list->reserve(count);
    for (auto* list :
         {&problem_.first_direction, &problem_.second_direction, &problem_.drive, &problem_.impulse})
      list->reserve(count);
    for (auto* list : {&problem_.separation, &problem_.rebound}) list->reserve(count);
    problem_.displacement.assign(problem_.bodies.size(), Vector6{});
  }

  bool is_moved(std::uint32_t body) const { return input_.bodies[body].motion == Motion::moving; }

  // The velocity of a body's point if contacts do not move the body, else 0.
  Vector3 driven(std::uint32_t body, const Vector3& arm) const {
    if (input_.bodies[body].motion != Motion::kinematic) return Vector3{};
    return states_[body].velocity + cross(states_[body].angular_velocity, arm);
  }

  ContactRow make_row(const ContactPoint& contact, const Vector3& direction) const {
    const std::uint32_t a = problem_.a.back(), b = problem_.b.back();
    ContactRow row = {Vector6{}, Vector6{}};
    if (a > 0)
      row.a = -gradient(problem_.scale[a], direction, contact.position - states_[contact.body_a].position);
    if (b > 0)
      row.b = gradient(problem_.scale[b], direction, contact.position - states_[contact.body_b].position);
    return row;
  }

  // A gap may close; what is in contact comes no deeper, or bodies would rock within the slop. But where a
  // patch is round, a body that rolls brings the points before it down: they may go on as they turn, and
  // faster. What turns too slowly for that rests.
  double separation_of(std::uint32_t index) const {
    constexpr double kRound = 0.7, kOfSlop = 0.25, kFaster = 4, kLeast = 0.3;
    const ContactPoint &contact = input_.contacts[index], &deepest = input_.contacts[deepest_[index]];
    const double separation =
        contact.depth < 0 ? -contact.depth : std::min(0.0, options_.slop - contact.depth);
    const double lower = deepest.depth - contact.depth;
    if (lower < kRound * std::max(deepest.depth, kOfSlop * options_.slop)) return separation;
    const Vector3 spin = states_[contact.body_b].angular_velocity - states_[contact.body_a].angular_velocity;
    const double rises = dot(contact.normal, cross(spin, contact.position - deepest.position));
    const double allowed = -kFaster * input_.dt * rises;
    return allowed > kLeast * options_.slop ? separation + allowed : separation;
  }

  // The deepest contact of each one's patch: those of a pair that have the same normal.
  void find_deepest(std::span<const std::uint32_t> contacts) {
    const auto same_patch = [&](const ContactPoint& p, const ContactPoint& q) {
      return p.body_a == q.body_a && p.body_b == q.body_b && square(p.normal - q.normal) < 1e-12;
    };
    deepest_.resize(input_.contacts.size());
    for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
      std::uint32_t deepest = contacts[begin];
      for (; end < contacts.size() && same_patch(input_.contacts[deepest], input_.contacts[contacts[end]]);
           ++end) {
        if (input_.contacts[contacts[end]].depth > input_.contacts[deepest].depth) deepest = contacts[end];
      }
      for (std::size_t i = begin; i < end; ++i) deepest_[contacts[i]] = deepest;
    }
  }

  void add_contact(std::uint32_t index, const ContactImpulse& impulse) {
    constexpr double kBouncesAbove = 2;  // times what gravity gives in a step
    const ContactPoint& contact = input_.contacts[index];
    const Vector3& normal = contact.normal;
    const Vector3 first = unit_orthogonal(normal), second = cross(normal, first);
    problem_.contacts.push_back(index);
    problem_.a.push_back(is_moved(contact.body_a) ? place_[contact.body_a] : 0);
    problem_.b.push_back(is_moved(contact.body_b) ? place_[contact.body_b] : 0);
    problem_.first_direction.push_back(first);
    problem_.second_direction.push_back(second);
    problem_.normal.push_back(make_row(contact, normal));
    problem_.first.push_back(make_row(contact, first));
    problem_.second.push_back(make_row(contact, second));
    const Vector3 moving = driven(contact.body_b, contact.position - states_[contact.body_b].position) -
                           driven(contact.body_a, contact.position - states_[contact.body_a].position);
    problem_.drive.push_back({dot(normal, moving), dot(first, moving), dot(second, moving)});
    problem_.separation.push_back(separation_of(index));
    const std::size_t i = problem_.contacts.size() - 1;
    const double gap = std::max(0.0, -contact.depth);
    const double approach = -problem_.along(problem_.normal[i], i, problem_.velocity) - problem_.drive[i].x;
    const double fall = -problem_.along(problem_.normal[i], i, problem_.gravity);
    const double square_at_impact = approach * approach + 2 * fall * gap;
    const bool meets = gap < input_.dt * (approach + 0.5 * input_.dt * fall) || gap == 0;
    const bool bounces = meets && approach > kBouncesAbove * input_.dt * norm(input_.gravity);
    problem_.rebound.push_back(bounces ? options_.restitution * std::sqrt(std::max(0.0, square_at_impact))
                                       : 0);
    problem_.impulse.push_back(
        {impulse.normal, dot(first, impulse.tangential), dot(second, impulse.tangential)});
  }

  // All contacts of a pair are in one layer, and so side by side.
  void add_pairs(std::span<const ContactImpulse> impulses) {
    const auto pair_of = [&](std::uint32_t i) {
      const ContactPoint& contact = input_.contacts[problem_.contacts[i]];
      return std::pair(contact.body_a, contact.body_b);
    };
    const auto count = static_cast<std::uint32_t>(problem_.contact_count());
    for (std::uint32_t begin = 0, end = 0; begin < count; begin = end) {
      while (end < count && pair_of(end) == pair_of(begin)) ++end;
      add_pair(begin, end, input_.contacts[problem_.contacts[begin]]);
      for (std::uint32_t i = begin; i < end; ++i)
        problem_.pairs.back().impulse += impulses[problem_.contacts[i]].turning;
    }
  }

  void add_pair(std::uint32_t begin, std::uint32_t end, const ContactPoint& contact) {
    TouchingPair pair = {};
    pair.begin = begin, pair.end = end;
    pair.drive = spin_driven(contact.body_b) - spin_driven(contact.body_a);
    pair.impulse = Vector3{};
    Matrix3 mobility;
    for (const std::uint32_t body : {problem_.a[begin], problem_.b[begin]}) {
      if (body > 0)
        mobility = mobility + problem_.scale[body].spread * transposed(problem_.scale[body].spread);
    }
    pair.mobility = 0;
    for (const Vector3& row : mobility.row)
      pair.mobility = std::max(pair.mobility, std::fabs(row.x) + std::fabs(row.y) + std::fabs(row.z));
    for (int k = 0; k < 3; ++k) {
      pair.turn[k] = {Vector6{}, Vector6{}};
      if (problem_.a[begin] > 0) pair.turn[k].a.angular = -problem_.scale[problem_.a[begin]].spread.row[k];
      if (problem_.b[begin] > 0) pair.turn[k].b.angular = problem_.scale[problem_.b[begin]].spread.row[k];
    }
    problem_.pairs.push_back(pair);
  }

  Vector3 spin_driven(std::uint32_t body) const {
    if (input_.bodies[body].motion != Motion::kinematic) return Vector3{};
    return states_[body].angular_velocity;
  }

  const StepInput& input_;
  std::span<const BodyState> states_;
  const SolverOptions& options_;
  std::span<const std::uint32_t> layers_;
  std::span<std::uint32_t> place_;
  std::vector<std::uint32_t> deepest_;  // contact of the patch of each
  IslandProblem problem_;
};

}  // namespace

IslandProblem make_island_problem(const StepInput& input, std::size_t island, const StepStart& start,
                                  const SolverOptions& options, std::span<const std::uint32_t> layers,
                                  std::span<std::uint32_t> place, std::span<const std::uint32_t> order) {
  return ProblemMaker(input, start.states, options, layers, place).make(island, start.impulses, order);
}

BodyState state_at_end(const IslandProblem& problem, const StepInput& input, std::size_t place,
                       const Vector6& velocity, const Vector6& displacement) {
  const MassScale& scale = problem.scale[place];
  const std::uint32_t body = problem.bodies[place];
  BodyState state = problem.states[body];
  state.velocity = velocity.linear / scale.root_mass;
  state.angular_velocity = scale.spread * velocity.angular;
  const Vector3 moved = displacement.linear / (scale.root_mass * input.dt);
  const Vector3 turned = scale.spread * displacement.angular / input.dt;
  advance(input.bodies[body], state, moved - state.velocity, turned - state.angular_velocity, input.dt);
  return state;
}

Residual residual_of(const IslandProblem& problem, std::span<const double> target, double friction,
                     double share) {
  Residual all;
  for (std::size_t i = 0; i < problem.contact_count(); ++i) {
    const ContactRow* rows[] = {&problem.normal[i], &problem.first[i], &problem.second[i]};
    const Vector3 impulse = share * problem.impulse[i];
    const double bound = friction * impulse.x;
    for (int k = 0; k < 3; ++k) {
      const double mobility = rows[k]->mobility();
      const double w = problem.along(*rows[k], i, problem.velocity) + at(problem.drive[i], k);
      const double own = at(impulse, k), other = k == 0 ? 0 : at(impulse, 3 - k);
      const double wanted = own - (w - (k == 0 ? target[i] : 0)) / mobility;
      // A row of friction has what the other leaves of the cone.
      const double rest = std::sqrt(std::max(0.0, bound * bound - other * other));
      const double next = k == 0 ? std::max(0.0, wanted) : std::clamp(wanted, -rest, rest);
      all.add(std::fabs(next - own) * mobility);
    }
  }
  return all;
}

void apply_solution(const IslandProblem& problem, const StepInput& input, std::span<BodyState> states,
                    std::span<ContactImpulse> impulses) {
  for (std::size_t i = 1; i < problem.bodies.size(); ++i)
    states[problem.bodies[i]] = state_at_end(problem, input, i, problem.velocity[i], problem.displacement[i]);
  for (std::size_t i = 0; i < problem.contact_count(); ++i) {
    const Vector3& impulse = problem.impulse[i];
    impulses[problem.contacts[i]] = {
        impulse.x, impulse.y * problem.first_direction[i] + impulse.z * problem.second_direction[i],
        Vector3{}};
  }
  for (const TouchingPair& pair : problem.pairs) {
    for (std::uint32_t i = pair.begin; i < pair.end; ++i)
      impulses[problem.contacts[i]].turning = pair.impulse / (pair.end - pair.begin);
  }
  for (const JointRow& row : problem.joint_rows)
    input.joint_memory[row.joint].impulse[row.slot] = row.impulse;
}

}  // namespace tandem::dynamics
