#include "dynamics/step_solver.h"

#include <algorithm>
#include <cmath>

#include "dynamics/island_problem.h"
#include "dynamics/soft_step.h"

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
bool is_slender(const Islands& islands, std::size_t island, std::span<const std::uint32_t> layers) {
  constexpr double kForAContact = 3000;
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

// Solves islands by Newton's method each by itself, and all others together; bodies that no contact holds
// fly.
class IslandSolver final : public StepSolver {
 public:
  explicit IslandSolver(const SolverOptions& options) : options_(options) {}

  void step(const StepInput& input, std::span<BodyState> states,
            std::span<ContactImpulse> impulses) override {
    place_.resize(input.bodies.size());
    const std::vector<std::uint32_t> layers = find_layers(input.bodies, input.contacts);
    const StepStart start = {states, impulses};
    std::vector<std::optional<Residual>> by_newton(input.islands.size());
    input.threads.for_each(input.islands.size(), [&](std::size_t i) {
      if (input.islands.contacts_of(i).empty()) {
        for (const std::uint32_t body : input.islands.bodies_of(i)) fly(input, body, states);
      } else if (wants_newton(input.islands, i, layers)) {
        IslandProblem problem = make_island_problem(input, i, start, options_, layers, place_);
        by_newton[i] = solve_newton_step(problem, input, options_);
        if (by_newton[i]) apply_solution(problem, input, states, impulses);
      }
    });
    std::vector<std::uint32_t> soft;
    Residual all;
    for (std::uint32_t i = 0; i < input.islands.size(); ++i) {
      if (by_newton[i])
        all.add(*by_newton[i]);
      else if (!input.islands.contacts_of(i).empty())
        soft.push_back(i);
    }
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
  bool wants_newton(const Islands& islands, std::size_t island, std::span<const std::uint32_t> layers) const {
    if (options_.kind == SolverKind::automatic) return is_slender(islands, island, layers);
    return options_.kind == SolverKind::newton;
  }

  SolverOptions options_;
  std::vector<std::uint32_t> place_;
  SoftSolver soft_;
};

}  // namespace

void StepSolver::sum_up(const Islands& islands, const Residual& residual) {
  statistics_ = {};
  for (std::size_t i = 0; i < islands.size(); ++i)
    statistics_.islands += islands.contacts_of(i).empty() ? 0 : 1;
  statistics_.contacts = islands.contacts.size();
  if (statistics_.contacts == 0) return;
  statistics_.residual = residual.largest;
  statistics_.residual_rms = std::sqrt(residual.squares / (3 * static_cast<double>(statistics_.contacts)));
}

std::unique_ptr<StepSolver> make_step_solver(const SolverOptions& options) {
  return std::make_unique<IslandSolver>(options);
}

}  // namespace tandem::dynamics
