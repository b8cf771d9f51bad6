#include "dynamics/island_joints.h"

#include <algorithm>
#include <cmath>

namespace tandem::dynamics {
namespace {

bool is_driven(const StepInput& input, std::uint32_t body) {
  return body != kNoIndex && input.bodies[body].motion == Motion::kinematic;
}

// The state of a body that only its own velocities move: at rest, unless it is kinematic.
BodyState unmoved(const IslandProblem& problem, const StepInput& input, std::uint32_t body) {
  BodyState state = state_of(body, problem.states);
  if (!is_driven(input, body)) state.velocity = state.angular_velocity = Vector3{};
  return state;
}

Vector6 gradient(const IslandProblem& problem, std::uint32_t place, const Vector3& linear,
                 const Vector3& angular) {
  if (place == 0) return {};
  const MassScale& scale = problem.stepped[place].scale;
  return {linear / scale.root_mass, transposed(scale.spread) * angular};
}

void set_row(const IslandProblem& problem, const StepInput& input, const JointDirection& from,
             JointRow& row) {
  row.gradient.a = -gradient(problem, row.a, from.linear, from.angular_a);
  row.gradient.b = gradient(problem, row.b, from.linear, from.angular_b);
  const Joint& joint = input.joints[row.joint];
  row.drive = is_driven(input, joint.a) || is_driven(input, joint.b)
                  ? from.speed_of(row.a > 0 ? BodyState() : unmoved(problem, input, joint.a),
                                  row.b > 0 ? BodyState() : unmoved(problem, input, joint.b))
                  : 0;
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
  for (std::size_t k = 0; k < from.count; ++k) {
    const JointDirection& direction = from.row[k];
    JointRow row = {};
    row.joint = joint, row.kind = direction.kind, row.slot = direction.slot, row.a = a, row.b = b;
    row.least_way = direction.least_way, row.most_way = direction.most_way;
    row.speed = of.speed;
    row.most_push = direction.kind == JointRowKind::motor ? input.dt * of.most_effort : INFINITY;
    row.least_push = -row.most_push;
    row.impulse = std::clamp(input.joint_memory[joint].impulse[row.slot], row.least_push, row.most_push);
    set_row(problem, input, direction, row);
    problem.joint_rows.push_back(row);
  }
}

void follow_joints(const IslandProblem& problem, const StepInput& input,
                   std::span<const Vector6> displacement, double time, std::span<JointRow> rows) {
  const auto moved = [&](std::uint32_t body, std::uint32_t place) {
    BodyState state = unmoved(problem, input, body);
    Vector3 way = time * state.velocity, turn = time * state.angular_velocity;
    if (place > 0) {
      way = displacement[place].linear / problem.stepped[place].scale.root_mass;
      turn = problem.stepped[place].scale.spread * displacement[place].angular;
    }
    state.position += way;
    state.orientation = rotation_by(turn) * state.orientation;
    return state;
  };
  for (auto row = rows.begin(); row != rows.end();) {
    const Joint& joint = input.joints[row->joint];
    const JointGeometry geometry = geometry_of(joint, moved(joint.a, row->a), moved(joint.b, row->b),
                                               input.joint_memory[row->joint].position);
    const JointDirections from = directions_of(joint, geometry);
    for (std::size_t k = 0; k < from.count; ++k, ++row) {
      set_row(problem, input, from.row[k], *row);
      row->least_way = from.row[k].least_way, row->most_way = from.row[k].most_way;
    }
  }
}

JointSpan::JointSpan(const IslandProblem& problem, const StepInput& input)
    : problem_(problem), input_(input), last_(problem.joints.size()), end_(problem.joint_rows.size()) {
  for (const std::uint32_t joint : problem.joints) first_.push_back(geometry_at_start(problem, input, joint));
}

void JointSpan::end_with(std::span<const Vector6> velocity, std::span<const Vector6> displacement) {
  const auto state = [&](std::uint32_t body, std::uint32_t place) {
    if (place > 0) return state_at_end(problem_, input_, place, velocity[place], displacement[place]);
    BodyState at_end = unmoved(problem_, input_, body);
    if (is_driven(input_, body)) advance(input_.bodies[body], at_end, {}, {}, input_.dt);
    return at_end;
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
    const JointDirections from = directions_of(input_.joints[problem_.joints[i]], geometry(i));
    for (std::size_t k = 0; k < from.count; ++k, ++row) set_row(problem_, input_, from.row[k], *row);
  }
}

void JointSpan::set_middle_rows(std::span<JointRow> rows) const {
  set_rows(rows, [&](std::size_t i) { return middle(first_[i], last_[i]); });
}

void JointSpan::set_end_rows(std::span<JointRow> rows) const {
  set_rows(rows, [&](std::size_t i) { return last_[i]; });
}

}  // namespace tandem::dynamics
