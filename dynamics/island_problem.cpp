#include "dynamics/island_problem.h"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <utility>

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

// Calls part(i) for all i below count, on the threads if there are any.
template <typename Part>
void for_all(Threads* threads, std::size_t count, const Part& part) {
  if (threads != nullptr) return threads->for_parts(count, 16, part);
  for (std::size_t i = 0; i < count; ++i) part(i);
}

class ProblemMaker {
 public:
  ProblemMaker(const StepInput& input, const StepStart& start, const SolverOptions& options,
               std::span<std::uint32_t> place, Threads* threads)
      : input_(input),
        states_(start.states),
        impulses_(start.impulses),
        options_(options),
        place_(place),
        threads_(threads) {}

  // bodies, contacts: of the islands; contacts of a pair are side by side.
  IslandProblem make(std::span<const std::uint32_t> bodies, std::span<const std::uint32_t> contacts) {
    problem_.bodies.assign(1, 0);
    problem_.bodies.insert(problem_.bodies.end(), bodies.begin(), bodies.end());
    problem_.contacts.assign(contacts.begin(), contacts.end());
    make_room();
    find_pairs();
    for_all(threads_, bodies.size(), [&](std::size_t i) { set_body(i + 1); });
    for_all(threads_, problem_.pairs.size(), [&](std::size_t i) { set_pair(problem_.pairs[i]); });
    return std::move(problem_);
  }

 private:
  void make_room() {
    const std::size_t bodies = problem_.bodies.size(), contacts = problem_.contact_count();
    problem_.scale.assign(bodies, {1, Matrix3::identity()});
    for (auto* list : {&problem_.velocity, &problem_.displacement, &problem_.gravity})
      list->assign(bodies, Vector6{});
    for (auto* list : {&problem_.a, &problem_.b}) list->resize(contacts);
    for (auto* list : {&problem_.normal, &problem_.first, &problem_.second}) list->resize(contacts);
    for (auto* list :
         {&problem_.first_direction, &problem_.second_direction, &problem_.drive, &problem_.impulse})
      list->resize(contacts);
    for (auto* list : {&problem_.separation, &problem_.rebound}) list->resize(contacts);
  }

  const ContactPoint& contact_of(std::uint32_t i) const { return input_.contacts[problem_.contacts[i]]; }

  void find_pairs() {
    const auto count = static_cast<std::uint32_t>(problem_.contact_count());
    for (std::uint32_t begin = 0, end = 0; begin < count; begin = end) {
      const ContactPoint& contact = contact_of(begin);
      while (end < count && contact_of(end).body_a == contact.body_a && contact_of(end).body_b == contact.body_b)
        ++end;
      TouchingPair& pair = problem_.pairs.emplace_back();
      pair.begin = begin, pair.end = end;
    }
  }

  void set_body(std::size_t i) {
    const std::uint32_t body = problem_.bodies[i];
    const BodyState& state = states_[body];
    place_[body] = static_cast<std::uint32_t>(i);
    problem_.scale[i] = mass_scale(input_.bodies[body], state);
    problem_.velocity[i] = scaled(problem_.scale[i], state.velocity, state.angular_velocity);
    problem_.gravity[i] = scaled(problem_.scale[i], input_.gravity, Vector3{});
  }

  bool is_moved(std::uint32_t body) const { return input_.bodies[body].motion == Motion::moving; }

  // The velocity of a body's point if contacts do not move the body, else 0.
  Vector3 driven(std::uint32_t body, const Vector3& arm) const {
    if (input_.bodies[body].motion != Motion::kinematic) return Vector3{};
    return states_[body].velocity + cross(states_[body].angular_velocity, arm);
  }

  ContactRow make_row(std::uint32_t i, const Vector3& direction) const {
    const ContactPoint& contact = contact_of(i);
    const std::uint32_t a = problem_.a[i], b = problem_.b[i];
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
  double separation_of(const ContactPoint& contact, const ContactPoint& deepest) const {
    constexpr double kRound = 0.7, kOfSlop = 0.25, kFaster = 4, kLeast = 0.3;
    const double separation =
        contact.depth < 0 ? -contact.depth : std::min(0.0, options_.slop - contact.depth);
    const double lower = deepest.depth - contact.depth;
    if (lower < kRound * std::max(deepest.depth, kOfSlop * options_.slop)) return separation;
    const Vector3 spin = states_[contact.body_b].angular_velocity - states_[contact.body_a].angular_velocity;
    const double rises = dot(contact.normal, cross(spin, contact.position - deepest.position));
    const double allowed = -kFaster * input_.dt * rises;
    return allowed > kLeast * options_.slop ? separation + allowed : separation;
  }

  void set_pair(TouchingPair& pair) {
    const ContactPoint& contact = contact_of(pair.begin);
    const std::uint32_t a = is_moved(contact.body_a) ? place_[contact.body_a] : 0,
                        b = is_moved(contact.body_b) ? place_[contact.body_b] : 0;
    pair.drive = spin_driven(contact.body_b) - spin_driven(contact.body_a);
    pair.impulse = Vector3{};
    Matrix3 mobility;
    for (const std::uint32_t body : {a, b}) {
      if (body > 0)
        mobility = mobility + problem_.scale[body].spread * transposed(problem_.scale[body].spread);
    }
    pair.mobility = 0;
    for (const Vector3& row : mobility.row)
      pair.mobility = std::max(pair.mobility, std::fabs(row.x) + std::fabs(row.y) + std::fabs(row.z));
    for (int k = 0; k < 3; ++k) {
      pair.turn[k] = {Vector6{}, Vector6{}};
      if (a > 0) pair.turn[k].a.angular = -problem_.scale[a].spread.row[k];
      if (b > 0) pair.turn[k].b.angular = problem_.scale[b].spread.row[k];
    }
    for (std::uint32_t i = pair.begin; i < pair.end; ++i) {
      problem_.a[i] = a, problem_.b[i] = b;
      pair.impulse += impulses_[problem_.contacts[i]].turning;
    }
    for (std::uint32_t begin = pair.begin, end = begin; begin < pair.end; begin = end) {
      end = end_of_patch(begin, pair.end);
      const auto deepest = std::ranges::max(std::views::iota(begin, end), {},
                                            [&](std::uint32_t i) { return contact_of(i).depth; });
      for (std::uint32_t i = begin; i < end; ++i) set_contact(i, contact_of(deepest));
    }
  }

  // The contacts of a patch are those of a pair that have the same normal.
  std::uint32_t end_of_patch(std::uint32_t begin, std::uint32_t end) const {
    std::uint32_t i = begin + 1;
    while (i < end && square(contact_of(i).normal - contact_of(begin).normal) < 1e-12) ++i;
    return i;
  }

  void set_contact(std::uint32_t i, const ContactPoint& deepest) {
    constexpr double kBouncesAbove = 2;  // times what gravity gives in a step
    const ContactPoint& contact = contact_of(i);
    const ContactImpulse& impulse = impulses_[problem_.contacts[i]];
    const Vector3& normal = contact.normal;
    const Vector3 first = unit_orthogonal(normal), second = cross(normal, first);
    problem_.first_direction[i] = first, problem_.second_direction[i] = second;
    problem_.normal[i] = make_row(i, normal);
    problem_.first[i] = make_row(i, first);
    problem_.second[i] = make_row(i, second);
    const Vector3 moving = driven(contact.body_b, contact.position - states_[contact.body_b].position) -
                           driven(contact.body_a, contact.position - states_[contact.body_a].position);
    problem_.drive[i] = {dot(normal, moving), dot(first, moving), dot(second, moving)};
    problem_.separation[i] = separation_of(contact, deepest);
    const double gap = std::max(0.0, -contact.depth);
    const double approach = -problem_.along(problem_.normal[i], i, problem_.velocity) - problem_.drive[i].x;
    const double fall = -problem_.along(problem_.normal[i], i, problem_.gravity);
    const double square_at_impact = approach * approach + 2 * fall * gap;
    const bool meets = gap < input_.dt * (approach + 0.5 * input_.dt * fall) || gap == 0;
    const bool bounces = meets && approach > kBouncesAbove * input_.dt * norm(input_.gravity);
    problem_.rebound[i] = bounces ? options_.restitution * std::sqrt(std::max(0.0, square_at_impact)) : 0;
    problem_.impulse[i] = {impulse.normal, dot(first, impulse.tangential), dot(second, impulse.tangential)};
  }

  Vector3 spin_driven(std::uint32_t body) const {
    if (input_.bodies[body].motion != Motion::kinematic) return Vector3{};
    return states_[body].angular_velocity;
  }

  const StepInput& input_;
  std::span<const BodyState> states_;
  std::span<const ContactImpulse> impulses_;
  const SolverOptions& options_;
  std::span<std::uint32_t> place_;
  Threads* threads_;
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

IslandProblem make_layered_problem(const StepInput& input, std::size_t island, const StepStart& start,
                                   const SolverOptions& options, std::span<const std::uint32_t> layers,
                                   std::span<std::uint32_t> place) {
  const auto bodies = from_the_ground_up(input.islands.bodies_of(island),
                                         [&](std::uint32_t body) { return layers[body]; });
  const auto contacts = from_the_ground_up(input.islands.contacts_of(island), [&](std::uint32_t i) {
    return std::min(layers[input.contacts[i].body_a], layers[input.contacts[i].body_b]);
  });
  return ProblemMaker(input, start, options, place, nullptr).make(bodies, contacts);
}

IslandProblem make_common_problem(const StepInput& input, std::span<const std::uint32_t> islands,
                                  const StepStart& start, const SolverOptions& options,
                                  std::span<std::uint32_t> place) {
  std::vector<std::uint32_t> bodies, contacts;
  for (const std::uint32_t island : islands) {
    const auto add = [](std::vector<std::uint32_t>& to, std::span<const std::uint32_t> from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    add(bodies, input.islands.bodies_of(island));
    add(contacts, input.islands.contacts_of(island));
  }
  return ProblemMaker(input, start, options, place, &input.threads).make(bodies, contacts);
}

Residual residual_of(const IslandProblem& problem, std::size_t i, double target, double friction,
                     double share) {
  Residual out;
  const ContactRow* rows[] = {&problem.normal[i], &problem.first[i], &problem.second[i]};
  const Vector3 impulse = share * problem.impulse[i];
  const double bound = friction * impulse.x;
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

void apply_solution(const IslandProblem& problem, const StepInput& input, std::span<BodyState> states,
                    std::span<ContactImpulse> impulses, Threads* threads) {
  for_all(threads, problem.bodies.size() - 1, [&](std::size_t before) {
    const std::size_t i = before + 1;
    const MassScale& scale = problem.scale[i];
    BodyState& state = states[problem.bodies[i]];
    state.velocity = problem.velocity[i].linear / scale.root_mass;
    state.angular_velocity = scale.spread * problem.velocity[i].angular;
    const Vector3 moved = problem.displacement[i].linear / (scale.root_mass * input.dt);
    const Vector3 turned = scale.spread * problem.displacement[i].angular / input.dt;
    advance(input.bodies[problem.bodies[i]], state, moved - state.velocity, turned - state.angular_velocity,
            input.dt);
  });
  for_all(threads, problem.pairs.size(), [&](std::size_t p) {
    const TouchingPair& pair = problem.pairs[p];
    for (std::uint32_t i = pair.begin; i < pair.end; ++i) {
      const Vector3& impulse = problem.impulse[i];
      impulses[problem.contacts[i]] = {
          impulse.x, impulse.y * problem.first_direction[i] + impulse.z * problem.second_direction[i],
          pair.impulse / (pair.end - pair.begin)};
    }
  });
}

}  // namespace tandem::dynamics
