#include "dynamics/newton_step.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "dynamics/convex_joints.h"
#include "dynamics/island_joints.h"

namespace tandem::dynamics {
namespace {

// The scratch of a step, with its memory.
struct OwnScratch : NewtonScratch {
  explicit OwnScratch(const IslandProblem& problem) {
    BlockColumns columns(problem.bodies.size() - 1);
    const auto join = [&](std::uint32_t a, std::uint32_t b) {
      if (a > 0 && b > 0) columns.join(a - 1, b - 1);
    };
    for (const TouchingPair& pair : problem.pairs) join(pair.a, pair.b);
    for (const JointRow& row : problem.joint_rows) join(row.a, row.b);
    const std::size_t blocks = columns.eliminate();
    Carver counting(nullptr);
    carve(counting, problem, blocks);
    memory = std::make_unique_for_overwrite<std::byte[]>(counting.bytes());
    Carver carver(memory.get());
    carve(carver, problem, blocks);
    columns.write(convex.matrix);
  }

  std::unique_ptr<std::byte[]> memory;
};

// A step of an island with joints.
class JointedStep {
 public:
  JointedStep(const IslandProblem& problem, const StepInput& input, const SolverOptions& options)
      : problem_(problem),
        input_(input),
        scratch_(problem),
        rows_(problem),
        joints_(problem, input),
        step_(team_, problem, scratch_, input, options.correction, rows_) {}

  // Result: whether it converged.
  bool solve(JointRule rule) { return rule == JointRule::exact ? solve_exactly() : solve_damped(); }

  // Returns whether joints turned too far for solve() to converge.
  bool turned_far() const { return turned_far_; }

  // Condition: solve() converged.
  void write(IslandProblem& problem) {
    step_.write();
    for (std::size_t i = 0; i < problem.joint_rows.size(); ++i)
      problem.joint_rows[i].impulse = rows_.impulse[i];
  }
  double target(std::size_t contact) const { return scratch_.target[contact]; }

 private:
  static constexpr double kUsable = 10;  // times what velocities of contacts may still change

  // The directions in which joints act turn with the bodies. Rows that are those of the middle of the step,
  // and velocities that obey the joints where the bodies then are, keep energy and angular momentum to second
  // order; but both are known only once the step is solved. So it is solved again with what is known of them,
  // each time nearer by a factor of about the angle that bodies turn in a step.
  bool solve_exactly() {
    constexpr int kMostJointRounds = 6;
    constexpr double kGood = 0.1;  // times what velocities of contacts may still change
    constexpr double kNearer = 0.5;
    const std::span<Vector6> end = scratch_.end;
    for (std::size_t j = 1; j < end.size(); ++j) end[j] += input_.dt * problem_.stepped[j].gravity;
    step_.take_mean();
    std::ranges::copy(scratch_.goal.free, scratch_.mean.begin());
    has_mean_ = true;
    end_with_these();
    double worst = INFINITY, change = 0;
    for (int round = 0; round < kMostJointRounds && worst > kGood * change; ++round) {
      const double before = worst;
      joints_.set_middle_rows(rows_.rows);
      find_shifts();
      rows_.stiffness = joints_.stiffness(round == 0 ? impulses_before() : rows_.impulse);
      if (round > 0) rows_.impulse.assign(rows_.impulse.size(), 0);
      if (!solve_once()) return false;
      worst = joints_.fastest_held(), change = step_.least_change();
      turned_far_ = !(worst <= std::max(kNearer * before, kUsable * change));
      if (turned_far_) return false;
    }
    turned_far_ = !(worst <= kUsable * change);
    if (turned_far_ || !put_in_place()) return false;
    turned_far_ = !keeps_energy();
    return !turned_far_;
  }

  // Returns whether joints did no work, but for a small part of what the bodies have: where they turn fast
  // they may do more or less than none, and in the long run more. A step's parts bring this down. Motors may
  // give what they do; limits may take, and so may joints of bodies that were pushed against them. Not looked
  // at where contacts and kinematic bodies do work too.
  bool keeps_energy() const {
    constexpr double kSmall = 1e-3;
    if (problem_.contact_count() > 0) return true;
    double gain = 0, kinetic = 0;
    for (std::uint32_t j = 1; j < problem_.body_count(); ++j) {
      const std::uint32_t body = problem_.bodies[j];
      const Vector6 way = input_.dt * scratch_.mean[j], &pull = problem_.stepped[j].gravity;
      const BodyState end = state_at_end(problem_, input_, j, scratch_.end[j], way);
      const double at_end = kinetic_energy(input_.bodies[body], end);
      gain += at_end - kinetic_energy(input_.bodies[body], problem_.states[body]) - dot(pull, way);
      kinetic += at_end + 0.5 * square(input_.dt * pull);
    }
    double given = 0;
    bool takes = false;
    for (std::size_t i = 0; i < problem_.joint_rows.size(); ++i) {
      const JointRow& row = problem_.joint_rows[i];
      if (row.drive != 0) return true;
      const bool holds = row.kind == JointRowKind::hold;
      const double impulse = std::fabs(rows_.impulse[i]), at_start = std::fabs(row.along(problem_.velocity));
      takes = takes || (holds ? at_start > kUsable * step_.least_change() : impulse > 0);
      if (row.kind == JointRowKind::motor) given += impulse * std::max(at_start, std::fabs(joints_.speed(i)));
    }
    return gain <= given + kSmall * kinetic && (takes || gain >= -kSmall * kinetic);
  }

  std::vector<double> impulses_before() const {
    std::vector<double> impulses;
    for (const JointRow& row : problem_.joint_rows) impulses.push_back(row.impulse);
    return impulses;
  }

  // Rows of the start of the step, whatever comes of them at its end: bodies lose energy as they turn, but
  // there are always such velocities.
  bool solve_damped() { return solve_once() && put_in_place(); }

  bool solve_once() {
    if (!step_.solve_velocities()) return false;
    take_mean();
    if (!step_.solve_displacement()) return false;
    end_with_these();
    return true;
  }

  // Displacements that bring the joints where they ought to be at the end, or as near as this can.
  bool put_in_place() {
    constexpr int kMostCorrections = 10;
    constexpr double kMiss = 1e-11;  // metres and radians
    for (int i = 0; i < kMostCorrections && joints_.most_missed() > kMiss; ++i) {
      const double before = joints_.most_missed();
      const std::vector<Vector6> mean(scratch_.mean.begin(), scratch_.mean.end());
      joints_.set_end_rows(rows_.rows);
      rows_.way_impulse.assign(rows_.way_impulse.size(), 0);
      find_shifts();
      std::ranges::copy(mean, scratch_.goal.free.begin());
      if (!step_.solve_displacement()) return false;
      end_with_these();
      if (joints_.most_missed() <= before) continue;
      std::ranges::copy(mean, scratch_.mean.begin());
      break;
    }
    return true;
  }

  // Makes `goal.free` the mean velocity. advance() turns a body by its spin at the end; the half of what it
  // gained is to be that of an inertia in the middle of the step, so that the step is as good backwards as
  // forwards.
  void take_mean() {
    step_.take_mean();
    for (std::size_t j = 1; j < scratch_.mean.size() && has_mean_; ++j) {
      const MassScale& scale = problem_.stepped[j].scale;
      const std::uint32_t body = problem_.bodies[j];
      BodyState middle = problem_.states[body];
      middle.orientation =
          rotation_by(0.5 * input_.dt * (scale.spread * scratch_.mean[j].angular)) * middle.orientation;
      const Vector3 gain = 0.5 * (scratch_.end[j].angular - problem_.velocity[j].angular);
      const Vector3 momentum = inverse(transposed(scale.spread)) * gain;
      const Vector3 spin = world_inverse_inertia(input_.bodies[body], middle) * momentum;
      scratch_.goal.free[j].angular = scratch_.end[j].angular - inverse(scale.spread) * spin;
    }
    has_mean_ = true;
  }

  void end_with_these() {
    std::vector<Vector6> displacement(scratch_.mean.begin(), scratch_.mean.end());
    for (Vector6& of : displacement) of = input_.dt * of;
    joints_.end_with(scratch_.end, displacement);
  }

  // By how much the rows' velocities and ways, which are linear, miss those of the bodies at the end.
  void find_shifts() {
    for (std::size_t i = 0; i < rows_.rows.size(); ++i) {
      const JointRow& row = rows_.rows[i];
      rows_.velocity_shift[i] = row.along(scratch_.end) + row.drive - joints_.speed(i);
      rows_.way_shift[i] = input_.dt * (row.along(scratch_.mean) + row.drive) - joints_.way(i);
    }
  }

  const IslandProblem& problem_;
  const StepInput& input_;
  SerialTeam team_;
  OwnScratch scratch_;
  ConvexJoints rows_;
  JointSpan joints_;
  NewtonStep<SerialTeam, ConvexJoints> step_;
  bool has_mean_ = false, turned_far_ = false;
};

// target(i): of contact i.
template <typename Target>
Residual residual_of_all(const IslandProblem& problem, const Target& target) {
  Residual out;
  for (std::size_t i = 0; i < problem.contact_count(); ++i) out.add(residual_of(problem, i, target(i)));
  return out;
}

}  // namespace

std::optional<Residual> solve_newton_step(IslandProblem& problem, const StepInput& input,
                                          const SolverOptions& options, JointRule rule, bool* turned_far) {
  if (problem.joints.empty()) {
    if (turned_far != nullptr) *turned_far = false;
    const SerialTeam team;
    const OwnScratch scratch(problem);
    NoJoints none;
    NewtonStep step(team, problem, scratch, input, options.correction, none);
    if (!step.solve()) return {};
    return residual_of_all(problem, [&](std::size_t i) { return scratch.target[i]; });
  }
  JointedStep step(problem, input, options);
  const bool solved = step.solve(rule);
  if (turned_far != nullptr) *turned_far = step.turned_far();
  if (!solved) return {};
  step.write(problem);
  return residual_of_all(problem, [&](std::size_t i) { return step.target(i); });
}

}  // namespace tandem::dynamics
