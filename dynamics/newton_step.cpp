#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "dynamics/convex_contacts.h"
#include "dynamics/island_joints.h"

namespace tandem::dynamics {
namespace {

constexpr int kMostPasses = 30;
constexpr std::uint32_t kMostFactorisations = 100;
constexpr double kOfJoints = 1e-3;  // times what velocities of contacts may still change, those of joints may

class NewtonStep {
 public:
  NewtonStep(const IslandProblem& problem, const StepInput& input, const SolverOptions& options)
      : problem_(problem),
        input_(input),
        options_(options),
        contacts_(problem),
        joints_(problem, input),
        velocity_shift_(problem.joint_rows.size(), 0),
        way_shift_(problem.joint_rows.size(), 0),
        way_impulse_(problem.joint_rows.size(), 0) {
    impulse_.contact = problem.impulse;
    for (const TouchingPair& pair : problem.pairs) impulse_.turning.push_back(pair.impulse);
    // Joints start from nothing: two that hold the same would keep what they do against each other.
    impulse_.joint.assign(problem.joint_rows.size(), 0);
    end_ = problem.velocity;
  }

  // Result: whether it converged.
  bool solve(JointRule rule) {
    if (joints_.empty()) return solve_velocities() && solve_displacement(mean_velocity());
    return rule == JointRule::exact ? solve_with_joints() : solve_with_damped_joints();
  }

  // Returns whether joints turned too far for solve() to converge.
  bool turned_far() const { return turned_far_; }

  // Condition: solve() converged.
  Residual write(IslandProblem& problem) {
    problem.velocity = std::move(end_);
    problem.impulse = std::move(impulse_.contact);
    for (std::size_t i = 0; i < problem.pairs.size(); ++i) problem.pairs[i].impulse = impulse_.turning[i];
    for (std::size_t i = 0; i < problem.joint_rows.size(); ++i)
      problem.joint_rows[i].impulse = impulse_.joint[i];
    problem.displacement = displacement();
    Residual out;
    for (std::size_t i = 0; i < problem.contact_count(); ++i) out.add(residual_of(problem, i, target_[i], 1));
    return out;
  }

 private:
  // The directions in which joints act turn with the bodies. Rows that are those of the middle of the step,
  // and velocities that obey the joints where the bodies then are, keep energy and angular momentum to second
  // order; but both are known only once the step is solved. So it is solved again with what is known of them,
  // each time nearer by a factor of about the angle that bodies turn in a step.
  bool solve_with_joints() {
    constexpr int kMostJointRounds = 6;
    constexpr double kGood = 0.1, kUsable = 10;  // times what velocities of contacts may still change
    constexpr double kNearer = 0.5;
    for (std::size_t j = 1; j < end_.size(); ++j) end_[j] += input_.dt * problem_.gravity[j];
    mean_ = mean_velocity();
    joints_.end_with(end_, displacement());
    double worst = INFINITY, change = 0;
    for (int round = 0; round < kMostJointRounds && worst > kGood * change; ++round) {
      const double before = worst;
      joints_.set_middle_rows(contacts_.joint_rows());
      find_shifts();
      stiffness_ = joints_.stiffness(round == 0 ? impulses_before() : impulse_.joint);
      if (round > 0) impulse_.joint.assign(impulse_.joint.size(), 0);
      if (!solve_velocities() || !solve_displacement(mean_velocity())) return false;
      joints_.end_with(end_, displacement());
      worst = joints_.fastest_held(), change = least_change();
      turned_far_ = !(worst <= std::max(kNearer * before, kUsable * change));
      if (turned_far_) return false;
    }
    turned_far_ = !(worst <= kUsable * change);
    return !turned_far_ && put_in_place();
  }

  std::vector<double> impulses_before() const {
    std::vector<double> impulses;
    for (const JointRow& row : problem_.joint_rows) impulses.push_back(row.impulse);
    return impulses;
  }

  // Rows of the start of the step, whatever comes of them at its end: bodies lose energy as they turn, but
  // there are always such velocities.
  bool solve_with_damped_joints() {
    if (!solve_velocities() || !solve_displacement(mean_velocity())) return false;
    joints_.end_with(end_, displacement());
    return put_in_place();
  }

  // Displacements that bring the joints where they ought to be at the end, or as near as this can.
  bool put_in_place() {
    constexpr int kMostCorrections = 10;
    constexpr double kMiss = 1e-11;  // metres and radians
    for (int i = 0; i < kMostCorrections && joints_.most_missed() > kMiss; ++i) {
      const double before = joints_.most_missed();
      const std::vector<Vector6> mean = mean_;
      joints_.set_end_rows(contacts_.joint_rows());
      way_impulse_.assign(way_impulse_.size(), 0);
      find_shifts();
      if (!solve_displacement(mean_)) return false;
      joints_.end_with(end_, displacement());
      if (joints_.most_missed() <= before) continue;
      mean_ = mean;
      break;
    }
    return true;
  }

  std::vector<Vector6> mean_velocity() const {
    std::vector<Vector6> mean = problem_.velocity;
    for (std::size_t j = 1; j < mean.size(); ++j) mean[j] = 0.5 * (mean[j] + end_[j]);
    if (joints_.empty() || mean_.empty()) return mean;
    // advance() turns a body by its spin at the end; the half of what it gained is to be that of an inertia
    // in the middle of the step, so that the step is as good backwards as forwards.
    for (std::size_t j = 1; j < mean.size(); ++j) {
      const MassScale& scale = problem_.scale[j];
      const std::uint32_t body = problem_.bodies[j];
      BodyState middle = problem_.states[body];
      middle.orientation =
          rotation_by(0.5 * input_.dt * (scale.spread * mean_[j].angular)) * middle.orientation;
      const Vector3 gain = 0.5 * (end_[j].angular - problem_.velocity[j].angular);
      const Vector3 momentum = inverse(transposed(scale.spread)) * gain;
      const Vector3 spin = world_inverse_inertia(input_.bodies[body], middle) * momentum;
      mean[j].angular = end_[j].angular - inverse(scale.spread) * spin;
    }
    return mean;
  }

  std::vector<Vector6> displacement() const {
    std::vector<Vector6> way = mean_;
    for (Vector6& of : way) of = input_.dt * of;
    return way;
  }

  // By how much the rows' velocities and ways, which are linear, miss those of the bodies at the end.
  void find_shifts() {
    const std::vector<JointRow>& rows = contacts_.joint_rows();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      velocity_shift_[i] = rows[i].along(end_) + rows[i].drive - joints_.speed(i);
      way_shift_[i] = input_.dt * (rows[i].along(mean_) + rows[i].drive) - joints_.way(i);
    }
  }

  bool solve_velocities() {
    constexpr double kSoftness = 1e-5;
    contacts_.set_softness(kSoftness);
    ConvexGoal goal = goal_of_velocities();
    target_ = goal.target;
    const double solved = least_change();
    constexpr double kHelps = 0.5, kStuck = 30;
    double joints_before = INFINITY, contacts_before = INFINITY;
    for (int pass = 0; pass < kMostPasses; ++pass) {
      if (!contacts_.minimise(goal, end_, impulse_, left_)) return false;
      const double joints = next_change_of_joints(goal), contacts = next_change(goal);
      // Joints that hold the same twice may ask for what cannot be, and so may contacts of bodies that they
      // join: another pass would not help.
      const bool holds = joints <= kOfJoints * solved || joints > kHelps * joints_before;
      const bool is_stuck = !joints_.empty() && contacts > kHelps * contacts_before;
      if (contacts <= (is_stuck ? kStuck : 1) * solved && holds) return balance();
      take_impulses(goal, impulse_);
      joints_before = joints, contacts_before = contacts;
    }
    return false;
  }

  // Makes the velocities those that the impulses give, so that momentum is kept to rounding.
  bool balance() {
    if (joints_.empty()) return true;
    for (std::size_t j = 1; j < end_.size(); ++j) end_[j] -= contacts_.gradient()[j];
    return true;
  }

  ConvexGoal goal_of_velocities() const {
    ConvexGoal goal;
    goal.free = problem_.velocity;
    for (std::size_t j = 1; j < goal.free.size(); ++j) goal.free[j] += input_.dt * problem_.gravity[j];
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const double gap = std::max(0.0, problem_.separation[i]);
      goal.target.push_back(problem_.rebound[i] > 0 ? rebound_at_end(i, gap) : -gap / input_.dt);
    }
    const double dt = input_.dt;
    for (std::size_t i = 0; i < problem_.joint_rows.size(); ++i) {
      const JointRow& row = problem_.joint_rows[i];
      const double by = velocity_shift_[i];
      switch (row.kind) {
        case JointRowKind::hold:
          goal.joint.push_back({by, by, -INFINITY, INFINITY});
          break;
        case JointRowKind::limit:
          goal.joint.push_back({std::min(0.0, row.least_way) / dt + by, std::max(0.0, row.most_way) / dt + by,
                                -INFINITY, INFINITY});
          break;
        case JointRowKind::motor:
          goal.joint.push_back({row.speed + by, row.speed + by, row.least_push, row.most_push});
          break;
      }
    }
    take_impulses(goal, impulse_);
    if (!stiffness_.empty()) goal.near = end_, goal.nearness = stiffness_;
    return goal;
  }

  // The velocity along a normal at the end of a step in which a gap closes and the bodies bounce. The
  // displacement is that of the mean velocity, so the gap that it leaves is as high as they have risen by
  // then, and has its part of the energy.
  double rebound_at_end(std::size_t i, double gap) const {
    const double rebound = problem_.rebound[i], dt = input_.dt;
    const double fall = -problem_.along(problem_.normal[i], i, problem_.gravity);
    const double approach = -problem_.along(problem_.normal[i], i, problem_.velocity) - problem_.drive[i].x;
    const double half = 0.5 * fall * dt;
    const double square = half * half - fall * (2 * gap - approach * dt) + rebound * rebound;
    const double velocity = std::sqrt(std::max(0.0, square)) - half;
    return gap + 0.5 * dt * (velocity - approach) > 0 ? velocity : rebound;
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
    return problem_.friction[contact] * impulses.contact[contact].x;
  }

  double turning_bound(const IslandImpulses& impulses, std::size_t pair) const {
    double push = 0;
    for (std::uint32_t i = problem_.pairs[pair].begin; i < problem_.pairs[pair].end; ++i)
      push += impulses.contact[i].x;
    return problem_.pairs[pair].rolling_resistance * push;
  }

  double next_change_of_joints(const ConvexGoal& goal) const {
    double change = 0;
    for (std::size_t i = 0; i < impulse_.joint.size(); ++i) {
      const double step = impulse_.joint[i] - goal.impulse.joint[i];
      change = std::max(change, contacts_.joint_softness(i) * std::fabs(step));
    }
    return change;
  }

  double least_change() const {
    constexpr double kOfGravity = 1e-4, kOfApproach = 1e-6;
    double approach = 0;
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const Vector3 w = contacts_.relative(i, problem_.velocity) + problem_.drive[i];
      approach = std::max(approach, norm(w));
    }
    for (const JointRow& row : problem_.joint_rows) {
      for (const auto* y : {&problem_.velocity, &end_})
        approach = std::max({approach, std::fabs(dot(row.gradient.a, (*y)[row.a])),
                             std::fabs(dot(row.gradient.b, (*y)[row.b]))});
    }
    double pull = 0;
    for (std::size_t j = 1; j < problem_.bodies.size(); ++j)
      pull = std::max(pull, input_.pull_of(problem_.bodies[j]));
    return kOfGravity * input_.dt * pull + kOfApproach * approach;
  }

  // Returns by how much another pass would change velocities of contacts.
  double next_change(const ConvexGoal& goal) const {
    double change = 0;
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const Vector3 step = impulse_.contact[i] - goal.impulse.contact[i];
      const double bound = friction_bound(impulse_, i);
      const double friction = norm(across(impulse_.contact[i]));
      const bool slips = friction >= (1 - 1e-9) * std::min(bound, goal.bound[i]);
      change = std::max({change, contacts_.normal_softness(i) * std::fabs(step.x),
                         contacts_.friction_softness(i) * norm(across(step)),
                         slips ? problem_.friction_mobility(i) * std::fabs(bound - goal.bound[i]) : 0.0});
    }
    return std::max(change, next_change_of_turning(goal));
  }

  // Returns by how much another pass would change pairs that turn, as velocities at an arm about as long as
  // that of a contact.
  double next_change_of_turning(const ConvexGoal& goal) const {
    double change = 0;
    for (std::size_t i = 0; i < problem_.pairs.size(); ++i) {
      const TouchingPair& pair = problem_.pairs[i];
      const double arm = std::sqrt(problem_.friction_mobility(pair.begin) / pair.mobility);
      const double bound = turning_bound(impulse_, i);
      const bool turns = norm(impulse_.turning[i]) >= (1 - 1e-9) * std::min(bound, goal.turning_bound[i]);
      const double step = norm(impulse_.turning[i] - goal.impulse.turning[i]);
      change = std::max({change, arm * contacts_.turning_softness(i) * step,
                         turns ? arm * pair.mobility * std::fabs(bound - goal.turning_bound[i]) : 0.0});
    }
    return change;
  }

  // free: what the displacement is to be nearest to, over dt.
  bool solve_displacement(std::vector<Vector6> free) {
    constexpr double kSoftness = 1e-2;  // what is left is corrected in the next step
    contacts_.set_softness(kSoftness);
    ConvexGoal goal;
    goal.free = std::move(free);
    for (const double s : problem_.separation)
      goal.target.push_back(-(s < 0 ? options_.correction : 1) * s / input_.dt);
    goal.impulse = {std::vector<Vector3>(problem_.contact_count(), Vector3{}),
                    std::vector<Vector3>(problem_.pairs.size(), Vector3{}), way_impulse_};
    for (std::size_t i = 0; i < problem_.joint_rows.size(); ++i) {
      const JointRow& row = problem_.joint_rows[i];
      const double push = row.kind == JointRowKind::motor ? 0 : INFINITY;
      goal.joint.push_back({(row.least_way + way_shift_[i]) / input_.dt,
                            (row.most_way + way_shift_[i]) / input_.dt, -push, push});
    }
    goal.bound.assign(problem_.contact_count(), 0);
    goal.turning_bound.assign(problem_.pairs.size(), 0);
    mean_ = goal.free;
    IslandImpulses impulse;
    const bool converged = contacts_.minimise(goal, mean_, impulse, left_);
    way_impulse_ = std::move(impulse.joint);
    return converged;
  }

  const IslandProblem& problem_;
  const StepInput& input_;
  const SolverOptions& options_;
  ConvexContacts contacts_;
  JointSpan joints_;
  std::vector<double> velocity_shift_, way_shift_, way_impulse_;  // see find_shifts()
  std::vector<Matrix3> stiffness_;                                // of joints; empty until there is any
  bool turned_far_ = false;
  std::uint32_t left_ = kMostFactorisations;
  std::vector<double> target_;
  std::vector<Vector6> end_, mean_;
  IslandImpulses impulse_;
};

}  // namespace

std::optional<Residual> solve_newton_step(IslandProblem& problem, const StepInput& input,
                                          const SolverOptions& options, JointRule rule, bool* turned_far) {
  NewtonStep step(problem, input, options);
  const bool solved = step.solve(rule);
  if (turned_far != nullptr) *turned_far = step.turned_far();
  if (!solved) return {};
  return step.write(problem);
}

}  // namespace tandem::dynamics