#include "dynamics/island_joints.h"

#include <algorithm>
#include <cmath>

namespace tandem::dynamics {
namespace {

JointedBody jointed_body(const IslandProblem& problem, const StepInput& input, std::uint32_t body,
                         std::uint32_t place) {
  return {body, input.bodies.data(), problem.states.data(),
          place > 0 ? &problem.stepped[place].scale : nullptr};
}

JointGeometry geometry_at_start(const IslandProblem& problem, const StepInput& input, std::uint32_t joint) {
  const Joint& of = input.joints[joint];
  return geometry_of(of, state_of(of.a, problem.states), state_of(of.b, problem.states),
                     input.joint_memory[joint].position);
}

}  // namespace

void add_joint_rows(IslandProblem& problem, const StepInput& input, std::uint32_t joint, std::uint32_t a,
                    std::uint32_t b) {
  const Joint& of = input.joints[joint];
  const JointDirections from = directions_of(of, geometry_at_start(problem, input, joint));
  const JointedBody body_a = jointed_body(problem, input, of.a, a),
                    body_b = jointed_body(problem, input, of.b, b);
  for (std::size_t k = 0; k < from.count; ++k) {
    problem.joint_rows.push_back(
        {constraint_of(of, input.joint_memory[joint], from.row[k], body_a, body_b, input.dt), joint, a, b});
  }
}

JointSpan::JointSpan(const IslandProblem& problem, const StepInput& input)
    : problem_(problem), input_(input), last_(problem.joints.size()), end_(problem.joint_rows.size()) {
  for (const std::uint32_t joint : problem.joints) first_.push_back(geometry_at_start(problem, input, joint));
}

void JointSpan::end_with(std::span<const Vector6> velocity, std::span<const Vector6> displacement) {
  const auto state = [&](std::uint32_t body, std::uint32_t place) {
    if (place > 0) return state_at_end(problem_, input_, place, velocity[place], displacement[place]);
    JointedBody unmoved = jointed_body(problem_, input_, body, place);
    if (unmoved.is_driven) advance(input_.bodies[body], unmoved.start, {}, {}, input_.dt);
    return unmoved.start;
  };
  std::size_t row = 0;
  for (std::size_t i = 0; i < problem_.joints.size(); ++i) {
    const Joint& joint = input_.joints[problem_.joints[i]];
    const JointRow& at = problem_.joint_rows[row];
    const BodyState a = state(joint.a, at.a), b = state(joint.b, at.b);
    JointMemory memory;
    memory.position = first_[i].position;
    follow(joint, a, b, input_.dt, memory);
    last_[i] = geometry_of(joint, a, b, memory.position);
    const JointDirections directions = directions_of(joint, last_[i]);
    for (std::size_t k = 0; k < directions.count; ++k, ++row) {
      const JointDirection& direction = directions.row[k];
      const JointRow& start = problem_.joint_rows[row];
      const double way = std::isfinite(start.least_way) ? start.least_way - direction.least_way
                                                        : start.most_way - direction.most_way;
      const double miss = std::max({0.0, direction.least_way, -direction.most_way});
      end_[row] = {direction.speed_of(a, b), way, miss};
    }
  }
}

std::vector<Matrix3> JointSpan::stiffness(std::span<const double> impulses) const {
  std::vector<Matrix3> stiffness(problem_.bodies.size());
  // A spin at the end counts for half of the turn, and the arm at the end for half of the mean arm. Impulses
  // across an arm, and those that press, are left out: the sum is to be positive.
  const auto pull = [&](const Vector3& arm, const Vector3& impulse) {
    const double along = dot(arm, impulse), length = square(arm);
    if (!(along > 0)) return Matrix3{};
    return 0.25 * input_.dt * along * (Matrix3::identity() - (1 / length) * outer(arm, arm));
  };
  std::size_t row = 0;
  for (std::size_t i = 0; i < problem_.joints.size(); ++i) {
    const JointRow& at = problem_.joint_rows[row];
    const JointDirections from = directions_of(input_.joints[problem_.joints[i]], last_[i]);
    Vector3 impulse;
    for (std::size_t k = 0; k < from.count; ++k, ++row) impulse += impulses[row] * from.row[k].linear;
    stiffness[at.a] = stiffness[at.a] + pull(last_[i].arm_a + last_[i].apart, -impulse);
    stiffness[at.b] = stiffness[at.b] + pull(last_[i].arm_b, impulse);
  }
  return stiffness;
}

double JointSpan::fastest_held() const {
  double most = 0;
  for (std::size_t i = 0; i < end_.size(); ++i) {
    if (problem_.joint_rows[i].kind == JointRowKind::hold) most = std::max(most, std::fabs(end_[i].speed));
  }
  return most;
}

double JointSpan::most_missed() const {
  double most = 0;
  for (const End& end : end_) most = std::max(most, end.miss);
  return most;
}

// geometry(i): of a joint.
template <typename Geometry>
void JointSpan::set_rows(std::span<JointRow> rows, const Geometry& geometry) const {
  auto row = rows.begin();
  for (std::size_t i = 0; i < problem_.joints.size(); ++i) {
    const Joint& joint = input_.joints[problem_.joints[i]];
    const JointDirections from = directions_of(joint, geometry(i));
    const JointedBody a = jointed_body(problem_, input_, joint.a, row->a),
                      b = jointed_body(problem_, input_, joint.b, row->b);
    for (std::size_t k = 0; k < from.count; ++k, ++row) set_direction(from.row[k], a, b, *row);
  }
}

void JointSpan::set_middle_rows(std::span<JointRow> rows) const {
  set_rows(rows, [&](std::size_t i) { return middle(first_[i], last_[i]); });
}

void JointSpan::set_end_rows(std::span<JointRow> rows) const {
  set_rows(rows, [&](std::size_t i) { return last_[i]; });
}

}  // namespace tandem::dynamics
