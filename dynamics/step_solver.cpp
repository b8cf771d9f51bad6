#include "dynamics/step_solver.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "dynamics/elimination_order.h"
#include "dynamics/island_problem.h"
#include "dynamics/newton_parts.h"
#include "dynamics/slender.h"
#include "dynamics/soft_step.h"

namespace tandem::dynamics {
namespace {

bool is_slender_island(const Islands& islands, std::size_t island, std::span<const std::uint32_t> layers) {
  std::vector<std::uint32_t> layer;
  for (const std::uint32_t body : islands.bodies_of(island)) layer.push_back(layers[body]);
  std::sort(layer.begin(), layer.end());
  double work = 0;
  for (auto begin = layer.begin(); begin != layer.end();) {
    const auto end = std::upper_bound(begin, layer.end(), *begin);
    work += elimination_work(static_cast<std::uint32_t>(end - begin));
    begin = end;
  }
  return is_slender(work, islands.contacts_of(island).size());
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

// Solves islands by Newton's method each by itself, and all others together; bodies that nothing holds fly.
class IslandSolver final : public StepSolver {
 public:
  explicit IslandSolver(const SolverOptions& options) : options_(options) {}

  void step(const StepInput& input, std::span<BodyState> states,
            std::span<ContactImpulse> impulses) override {
    place_.resize(input.bodies.size());
    std::vector<ObjectPair> joined;
    for (const Joint& joint : input.joints) joined.push_back(joint.pair());
    const std::vector<std::uint32_t> layers = find_layers(input.bodies, input.contacts, joined);
    const StepStart start = {states, impulses};
    std::vector<std::optional<Residual>> by_newton(input.islands.size());
    // Threads begin with the islands of most contacts, so that none of these is left when all others are
    // done.
    std::vector<std::uint32_t> order = all_below(input.islands.size());
    std::ranges::stable_sort(order, std::greater{},
                             [&](std::uint32_t i) { return input.islands.contacts_of(i).size(); });
    input.threads.for_each(order.size(), [&](std::size_t place) {
      const std::uint32_t i = order[place];
      if (input.islands.flies(i)) {
        for (const std::uint32_t body : input.islands.bodies_of(i))
          fly(input.bodies[body], input.pulls[body], input.dt, states[body]);
        return;
      }
      const Plan plan = plan_of(input, i, layers);
      if (!plan.by_newton) return;
      if (const std::uint32_t parts = parts_of(input, i, states); parts > 1)
        by_newton[i] = solve_newton_parts(input, i, parts, options_, layers, place_, plan.order,
                                          JointRule::exact, states, impulses);
      if (by_newton[i]) return;
      IslandProblem problem = make_island_problem(input, i, start, options_, layers, place_, plan.order);
      bool turned_far = false;
      by_newton[i] = solve_newton_step(problem, input, options_, JointRule::exact, &turned_far);
      if (by_newton[i])
        apply_solution(problem, input, states, impulses);
      else if (turned_far)
        by_newton[i] = solve_in_parts(input, i, plan, layers, states, impulses);
    });
    std::vector<std::uint32_t> soft;
    Residual all;
    for (std::uint32_t i = 0; i < input.islands.size(); ++i) {
      if (by_newton[i])
        all.add(*by_newton[i]);
      else if (!input.islands.flies(i))
        soft.push_back(i);
    }
    if (!input.done.empty()) std::ranges::copy(impulses, input.done.begin());
    for (JointMemory& memory : input.joint_memory) memory.done = memory.impulse;
    all.add(soft_.solve(input, soft, options_, states, impulses));
    for (std::uint32_t i = 0; i < states.size(); ++i) {
      if (input.bodies[i].motion == Motion::kinematic)
        advance(input.bodies[i], states[i], Vector3{}, Vector3{}, input.dt);
    }
    sum_up(input.islands, all);
    statistics_.newton_islands = static_cast<std::uint64_t>(
        std::ranges::count_if(by_newton, [](const auto& of) { return of.has_value(); }));
  }

 private:
  struct Plan {
    bool by_newton;
    std::vector<std::uint32_t> order;  // of bodies; empty: by layer
  };

  // Joints find their parts by themselves.
  static std::uint32_t parts_of(const StepInput& input, std::size_t island,
                                std::span<const BodyState> states) {
    if (!input.islands.joints_of(island).empty()) return 1;
    double turn = 0;
    for (const std::uint32_t i : input.islands.contacts_of(island))
      turn = std::max(turn, turn_about(input.contacts[i], states, input.dt));
    return parts_for(turn);
  }

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
    if (joints == 0) return {!chooses || is_slender_island(input.islands, island, layers), {}};
    const double contacts = static_cast<double>(input.islands.contacts_of(island).size());
    const double most = kForAContact * (contacts + kContactsOfJoint * joints);
    auto order = order_of_joined(input, island, chooses ? most : INFINITY, place_);
    return {order.has_value(), order ? std::move(*order) : std::vector<std::uint32_t>()};
  }

  SolverOptions options_;
  std::vector<std::uint32_t> place_;
  SoftSolver soft_;
};

}  // namespace

void StepSolver::sum_up(const Islands& islands, const Residual& residual) {
  statistics_ = {};
  for (std::size_t i = 0; i < islands.size(); ++i) statistics_.islands += islands.flies(i) ? 0 : 1;
  statistics_.contacts = islands.contacts.size();
  if (statistics_.contacts == 0) return;
  statistics_.residual = residual.largest;
  statistics_.residual_rms = std::sqrt(residual.squares / (3 * static_cast<double>(statistics_.contacts)));
}

std::unique_ptr<StepSolver> make_step_solver(const SolverOptions& options) {
  return std::make_unique<IslandSolver>(options);
}

}  // namespace tandem::dynamics
