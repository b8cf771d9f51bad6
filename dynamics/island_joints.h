#pragma once
#include <span>
#include <vector>

#include "dynamics/island_problem.h"

namespace tandem::dynamics {

/// Adds the rows of a joint as it is at the start of the step. a, b: places of its bodies.
void add_joint_rows(IslandProblem& problem, const StepInput& input, std::uint32_t joint, std::uint32_t a,
                    std::uint32_t b);

/// The joints of an island over a step, from states at its start to states at its end, of which a solver has
/// guesses that become better.
class JointSpan {
 public:
  JointSpan(const IslandProblem& problem, const StepInput& input);

  bool empty() const { return problem_.joints.empty(); }

  /// Takes the velocities and displacements that the bodies are guessed to end with.
  void end_with(std::span<const Vector6> velocity, std::span<const Vector6> displacement);

  /// Make the rows those of the mean of both ends, or of the end. Their ways stay those from the start.
  void set_middle_rows(std::span<JointRow> rows) const;
  void set_end_rows(std::span<JointRow> rows) const;

  /// Returns for each place how much more torque impulse, by radians per second, a body gets that turns away
  /// from where these impulses pull its anchors: what stretches a joint holds its bodies in line.
  std::vector<Matrix3> stiffness(std::span<const double> impulses) const;

  /// Return w of a row at the end, and what it has changed by in the step.
  double speed(std::size_t row) const { return end_[row].speed; }
  double way(std::size_t row) const { return end_[row].way; }

  /// Return the largest speed of rows that are held, and by how much rows miss their bounds at most, at the
  /// end.
  double fastest_held() const;
  double most_missed() const;

 private:
  struct End {
    double speed, way, miss;
  };
  template <typename Geometry>
  void set_rows(std::span<JointRow> rows, const Geometry& geometry) const;

  const IslandProblem& problem_;
  const StepInput& input_;
  std::vector<JointGeometry> first_, last_;  // of each joint
  std::vector<End> end_;                     // of each row
};

}  // namespace tandem::dynamics
