#include "dynamics/step_solver.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "dynamics/elimination_order.h"
#include "dynamics/island_problem.h"
#include "dynamics/newton_parts.h"

namespace tandem::dynamics {
namespace {

// Moves by the mean velocity of the step, which is exact.
void fly(const StepInput& input, std::uint32_t body, std::span<BodyState> states) {
  const Vector3 gain = input.dt * input.gravity;
  states[body].velocity += gain;
  advance(input.bodies[body], states[body], -0.5 * gain, Vector3{}, input.dt);
}

// Returns whether factorising the island's matrix costs no more than what Newton's method has to do for each
// contact: with bodies by layer the matrix is a band, and eliminating w bodies that hang together with as
// many of the next layer takes about (6 w)^3 multiplications.
constexpr double kForAContact = 3000;
bool is_slender(const Islands& islands, std::size_t island, std::span<const std::uint32_t> layers) {
  std::vector<std::uint32_t> layer;
  for (const std::uint32_t body : islands.bodies_of(island)) layer.push_back(layers[body]);
  std::sort(layer.begin(), layer.end());
  double work = 0;
  for (auto begin = layer.begin(); begin != layer.end();) {
    const auto end = std::upper_bound(begin, layer.end(), *begin);
    work += std::pow(6 * static_cast<double>(end - begin), 3);
    begin = end;
  }
  return work <= kForAContact * static_cast<double>(islands.contacts_of(island).size());
}

// An order that eliminates the bodies of an island with joints. Layers say little of these: a robot that no
// contact holds has none, and its arms do not hang together. Result: nothing if it takes more than `most`
// multiplications. place: for each body of the step a number that this may change.
std::optional<std::vector<std::uint32_t>> order_of_joined(const StepInput& input, std::size_t island,
                                                          double most, std::span<std::uint32_t> place) {
  const auto bodies = input.islands.bodies_of(island);
  for (std::uint32_t i = 0; i < bodies.size(); ++i) place[bodies[i]] = i;
  const auto is_moved = [&](std::uint32_t body) {
    return body != kNoIndex && input.bodies[body].motion == Motion::moving;
  };
  std::vector<ObjectPair> links;
  const auto link = [&](std::uint32_t a, std::uint32_t b) {
    if (is_moved(a) && is_moved(b)) links.push_back({place[a], place[b]});
  };
  for (const std::uint32_t i : input.islands.contacts_of(island))
    link(input.contacts[i].body_a, input.contacts[i].body_b);
  for (const std::uint32_t i : input.islands.joints_of(island)) link(input.joints[i].a, input.joints[i].b);
  auto order = elimination_order(bodies.size(), links, most);
  if (order) {
    for (std::uint32_t& body : *order) body = bodies[body];
  }
  return order;
}

// Solves islands by themselves; bodies that no contact holds fly.
class IslandSolver final : public StepSolver {
 public:
  explicit IslandSolver(const SolverOptions& options) : options_(options) {}

  void step(const StepInput& input, std::span<BodyState> states,
            std::span<ContactImpulse> impulses) override {
    place_.resize(input.bodies.size());
    std::vector<ObjectPair> joined;
    for (const Joint& joint : input.joints) joined.push_back({joint.a, joint.b});
    const std::vector<std::uint32_t> layers = find_layers(input.bodies, input.contacts, joined);
    std::vector<Residual> residuals(input.islands.size());
    std::atomic<std::uint64_t> by_newton = 0;
    input.threads.for_each(input.islands.size(), [&](std::size_t i) {
      if (input.islands.flies(i)) {
        for (const std::uint32_t body : input.islands.bodies_of(i)) fly(input, body, states);
        return;
      }
      const Plan plan = plan_of(input, i, layers);
      IslandProblem problem =
          make_island_problem(input, i, {states, impulses}, options_, layers, place_, plan.order);
      std::optional<Residual> newton;
      bool turned_far = false;
      if (plan.by_newton) newton = solve_newton_step(problem, input, options_, JointRule::exact, &turned_far);
      const bool is_whole = newton.has_value();
      if (turned_far) newton = solve_in_parts(input, i, plan, layers, states, impulses);
      by_newton += newton ? 1 : 0;
      residuals[i] = newton ? *newton : solve_soft_step(problem, input, options_);
      if (is_whole || !newton) apply_solution(problem, input, states, impulses);
    });
    for (std::uint32_t i = 0; i < states.size(); ++i) {
      if (input.bodies[i].motion == Motion::kinematic)
        advance(input.bodies[i], states[i], Vector3{}, Vector3{}, input.dt);
    }
    sum_up(input.islands, residuals);
    statistics_.newton_islands = by_newton;
  }

 private:
  struct Plan {
    bool by_newton;
    std::vector<std::uint32_t> order;  // of bodies; empty: by layer
  };

  // A step in which joints turn far takes as many parts as that asks for.
  std::optional<Residual> solve_in_parts(const StepInput& input, std::size_t island, const Plan& plan,
                                         std::span<const std::uint32_t> layers, std::span<BodyState> states,
                                         std::span<ContactImpulse> impulses) {
    constexpr std::uint32_t kMostParts = 16;
    std::optional<Residual> newton;
    bool turned_far = true;
    const auto solve = [&](std::uint32_t parts, JointRule rule) {
      newton = solve_newton_parts(input, island, parts, options_, layers, place_, plan.order, rule, states,
                                  impulses, &turned_far);
    };
    for (std::uint32_t parts = 2; turned_far && parts <= kMostParts; parts *= 2)
      solve(parts, JointRule::exact);
    if (turned_far) solve(kMostParts, JointRule::damped);
    return newton;
  }

  Plan plan_of(const StepInput& input, std::size_t island, std::span<const std::uint32_t> layers) {
    constexpr double kContactsOfJoint = 2;  // a joint has about twice the rows
    const bool chooses = options_.kind == SolverKind::automatic;
    if (options_.kind == SolverKind::soft) return {false, {}};
    const auto joints = static_cast<double>(input.islands.joints_of(island).size());
    if (joints == 0) return {!chooses || is_slender(input.islands, island, layers), {}};
    const double contacts = static_cast<double>(input.islands.contacts_of(island).size());
    const double most = kForAContact * (contacts + kContactsOfJoint * joints);
    auto order = order_of_joined(input, island, chooses ? most : INFINITY, place_);
    return {order.has_value(), order ? std::move(*order) : std::vector<std::uint32_t>()};
  }

  SolverOptions options_;
  std::vector<std::uint32_t> place_;
};

}  // namespace

void StepSolver::sum_up(const Islands& islands, std::span<const Residual> residuals) {
  statistics_ = {};
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    statistics_.islands += islands.flies(i) ? 0 : 1;
    statistics_.residual = std::max(statistics_.residual, residuals[i].largest);
    statistics_.residual_rms += residuals[i].squares;
  }
  statistics_.contacts = islands.contacts.size();
  if (statistics_.contacts == 0) return;
  statistics_.residual_rms =
      std::sqrt(statistics_.residual_rms / (3 * static_cast<double>(statistics_.contacts)));
}

std::unique_ptr<StepSolver> make_step_solver(const SolverOptions& options) {
  return std::make_unique<IslandSolver>(options);
}

}  // namespace tandem::dynamics
