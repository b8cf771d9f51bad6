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
    problem.impulse = std::move(impulse_);
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
    take_impulses(goal, problem_.impulse);
    return goal;
  }

  void take_impulses(ConvexGoal& goal, const std::vector<Vector3d>& impulses) const {
    goal.impulse = impulses;
    goal.bound.resize(impulses.size());
    for (std::size_t i = 0; i < impulses.size(); ++i) goal.bound[i] = options_.friction * impulses[i].x();
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
      const Vector3d step = impulse_[i] - goal.impulse[i];
      const double bound = options_.friction * impulse_[i].x();
      const double friction = impulse_[i].tail<2>().norm();
      const bool slips = friction >= (1 - 1e-9) * std::min(bound, goal.bound[i]);
      change = std::max({change, contacts_.normal_softness(i) * std::fabs(step.x()),
                         contacts_.friction_softness(i) * step.tail<2>().norm(),
                         slips ? problem_.friction_mobility(i) * std::fabs(bound - goal.bound[i]) : 0.0});
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
    goal.impulse.assign(goal.target.size(), Vector3d::Zero());
    goal.bound.assign(goal.target.size(), 0);
    mean_ = goal.free;
    std::vector<Vector3d> unused;
    return contacts_.minimise(goal, mean_, unused, left_);
  }

  const IslandProblem& problem_;
  const StepInput& input_;
  const SolverOptions& options_;
  ConvexContacts contacts_;
  std::uint32_t left_ = kMostFactorisations;
  std::vector<double> target_;
  std::vector<Vector6> end_, mean_;
  std::vector<Vector3d> impulse_;
};

}  // namespace

NewtonReport solve_newton_step(IslandProblem& problem, const StepInput& input, const SolverOptions& options) {
  NewtonStep step(problem, input, options);
  NewtonReport report = step.solve();
  if (report.converged) report.residual = step.write(problem);
  return report;
}

}  // namespace tandem::simulation
