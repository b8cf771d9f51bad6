#include "newton_step.h"

#include <algorithm>
#include <cmath>

#include "convex_contacts.h"

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kMostPasses = 30;
constexpr std::uint32_t kMostFactorisations = 100;

class NewtonStep {
 public:
  NewtonStep(const IslandProblem& problem, const StepInput& input, const SolverOptions& options)
      : problem_(problem), input_(input), options_(options), contacts_(problem) {}

  NewtonReport solve() {
    NewtonReport report;
    report.converged = solve_velocities(report) && solve_displacement();
    report.factorisations = kMostFactorisations - left_;
    return report;
  }

  // Condition: solve() converged.
  IslandResidual write(IslandProblem& problem) {
    problem.velocity = std::move(end_);
    problem.impulse = std::move(impulse_.contact);
    for (std::size_t i = 0; i < problem.pairs.size(); ++i) problem.pairs[i].impulse = impulse_.turning[i];
    for (std::size_t j = 1; j < mean_.size(); ++j) problem.displacement[j] = input_.dt * mean_[j];
    return residual_of(problem, target_, options_.friction, 1);
  }

 private:
  bool solve_velocities(NewtonReport& report) {
    constexpr double kSoftness = 1e-5;
    contacts_.set_softness(kSoftness);
    ConvexGoal goal = goal_of_velocities();
    target_ = goal.target;
    const double solved = least_change();
    end_ = problem_.velocity;
    while (report.passes < kMostPasses) {
      ++report.passes;
      if (!contacts_.minimise(goal, end_, impulse_, left_)) return false;
      if (next_change(goal) <= solved) return true;
      take_impulses(goal, impulse_);
    }
    return false;
  }

  ConvexGoal goal_of_velocities() const {
    ConvexGoal goal;
    goal.free = problem_.velocity;
    for (std::size_t j = 1; j < goal.free.size(); ++j) goal.free[j] += input_.dt * problem_.gravity[j];
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const double gap = std::max(0.0, problem_.separation[i]);
      goal.target.push_back(problem_.rebound[i] > 0 ? problem_.rebound[i] : -gap / input_.dt);
    }
    IslandImpulses before = {problem_.impulse, {}};
    for (const TouchingPair& pair : problem_.pairs) before.turning.push_back(pair.impulse);
    take_impulses(goal, before);
    return goal;
  }

  void take_impulses(ConvexGoal& goal, const IslandImpulses& impulses) const {
    goal.impulse = impulses;
    goal.bound.resize(problem_.contact_count());
    for (std::size_t i = 0; i < goal.bound.size(); ++i) goal.bound[i] = friction_bound(impulses, i);
    goal.turning_bound.resize(problem_.pairs.size());
    for (std::size_t i = 0; i < goal.turning_bound.size(); ++i)
      goal.turning_bound[i] = turning_bound(impulses, i);
  }

  double friction_bound(const IslandImpulses& impulses, std::size_t contact) const {
    return options_.friction * impulses.contact[contact].x();
  }

  double turning_bound(const IslandImpulses& impulses, std::size_t pair) const {
    double push = 0;
    for (std::uint32_t i = problem_.pairs[pair].begin; i < problem_.pairs[pair].end; ++i)
      push += impulses.contact[i].x();
    return options_.rolling_resistance * push;
  }

  double least_change() const {
    constexpr double kOfGravity = 1e-4, kOfApproach = 1e-6;
    double approach = 0;
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const Vector3d w = contacts_.relative(i, problem_.velocity) + problem_.drive[i];
      approach = std::max(approach, w.norm());
    }
    return kOfGravity * input_.dt * input_.gravity.norm() + kOfApproach * approach;
  }

  // By how much another pass would change velocities of contacts.
  double next_change(const ConvexGoal& goal) const {
    double change = 0;
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const Vector3d step = impulse_.contact[i] - goal.impulse.contact[i];
      const double bound = friction_bound(impulse_, i);
      const double friction = impulse_.contact[i].tail<2>().norm();
      const bool slips = friction >= (1 - 1e-9) * std::min(bound, goal.bound[i]);
      change = std::max({change, contacts_.normal_softness(i) * std::fabs(step.x()),
                         contacts_.friction_softness(i) * step.tail<2>().norm(),
                         slips ? problem_.friction_mobility(i) * std::fabs(bound - goal.bound[i]) : 0.0});
    }
    return std::max(change, next_change_of_turning(goal));
  }

  // The same of pairs that turn, as velocities at an arm about as long as that of a contact.
  double next_change_of_turning(const ConvexGoal& goal) const {
    double change = 0;
    for (std::size_t i = 0; i < problem_.pairs.size(); ++i) {
      const TouchingPair& pair = problem_.pairs[i];
      const double arm = std::sqrt(problem_.friction_mobility(pair.begin) / pair.mobility);
      const double bound = turning_bound(impulse_, i);
      const bool turns = impulse_.turning[i].norm() >= (1 - 1e-9) * std::min(bound, goal.turning_bound[i]);
      const double step = (impulse_.turning[i] - goal.impulse.turning[i]).norm();
      change = std::max({change, arm * contacts_.turning_softness(i) * step,
                         turns ? arm * pair.mobility * std::fabs(bound - goal.turning_bound[i]) : 0.0});
    }
    return change;
  }

  bool solve_displacement() {
    constexpr double kSoftness = 1e-2;  // what is left is corrected in the next step
    contacts_.set_softness(kSoftness);
    ConvexGoal goal;
    goal.free = problem_.velocity;
    for (std::size_t j = 1; j < goal.free.size(); ++j) goal.free[j] = 0.5 * (goal.free[j] + end_[j]);
    for (const double s : problem_.separation)
      goal.target.push_back(-(s < 0 ? options_.correction : 1) * s / input_.dt);
    goal.impulse = {std::vector<Vector3d>(problem_.contact_count(), Vector3d::Zero()),
                    std::vector<Vector3d>(problem_.pairs.size(), Vector3d::Zero())};
    goal.bound.assign(problem_.contact_count(), 0);
    goal.turning_bound.assign(problem_.pairs.size(), 0);
    mean_ = goal.free;
    IslandImpulses unused;
    return contacts_.minimise(goal, mean_, unused, left_);
  }

  const IslandProblem& problem_;
  const StepInput& input_;
  const SolverOptions& options_;
  ConvexContacts contacts_;
  std::uint32_t left_ = kMostFactorisations;
  std::vector<double> target_;
  std::vector<Vector6> end_, mean_;
  IslandImpulses impulse_;
};

}  // namespace

NewtonReport solve_newton_step(IslandProblem& problem, const StepInput& input, const SolverOptions& options) {
  NewtonStep step(problem, input, options);
  NewtonReport report = step.solve();
  if (report.converged) report.residual = step.write(problem);
  return report;
}

}  // namespace tandem::simulation
