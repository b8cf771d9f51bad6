#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "dynamics/block_matrix.h"
#include "dynamics/island_problem.h"

namespace tandem::dynamics {

/// The velocities that a row of a joint leaves alone, and the bounds of its impulse.
struct JointGoal {
  double low, high, least_push, most_push;
};

/// What the rows of joints add to the function of ConvexContacts:
///
///     sum over rows  R/2 of the square of an impulse, held within its bounds
///
/// The impulse of a row is l + (low - w)/R where that is more than 0, l + (high - w)/R where that is less,
/// and 0 between; low = high of what is held. Where y is to be near to others, what that adds is of no moment
/// once it is there.
class ConvexJoints {
 public:
  static constexpr bool kAny = true;

  explicit ConvexJoints(const IslandProblem& problem)
      : rows(problem.joint_rows),
        impulse(rows.size(), 0),
        way_impulse(rows.size(), 0),
        velocity_shift(rows.size(), 0),
        way_shift(rows.size(), 0),
        problem_(problem),
        softness_(rows.size()),
        w_(rows.size()),
        change_of_w_(rows.size()) {}

  // The rows that joints have now; impulses of the step and of its displacement; by how much the velocities
  // and ways of rows, which are linear, miss those of the bodies at the end.
  std::vector<JointRow> rows;
  std::vector<double> impulse, way_impulse, velocity_shift, way_shift;
  std::vector<Matrix3> stiffness;  // of joints, see JointSpan; empty: there is none

  void set_softness() {
    for (std::size_t i = 0; i < rows.size(); ++i) softness_[i] = kSoftness * rows[i].gradient.mobility();
  }

  // near: y that the least is to be near to, where there is a stiffness.
  void aim_at_velocities(double dt, std::span<const Vector6> near) {
    goals_.clear(), near_.clear();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const JointRow& row = problem_.joint_rows[i];
      const double by = velocity_shift[i];
      switch (row.kind) {
        case JointRowKind::hold:
          goals_.push_back({by, by, -INFINITY, INFINITY});
          break;
        case JointRowKind::limit:
          goals_.push_back({std::min(0.0, row.least_way) / dt + by, std::max(0.0, row.most_way) / dt + by,
                            -INFINITY, INFINITY});
          break;
        case JointRowKind::motor:
          goals_.push_back({row.speed + by, row.speed + by, row.least_push, row.most_push});
          break;
      }
    }
    if (!stiffness.empty()) near_.assign(near.begin(), near.end());
    now_ = impulse;
  }

  void aim_at_ways(double dt) {
    goals_.clear(), near_.clear();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const JointRow& row = problem_.joint_rows[i];
      const double push = row.kind == JointRowKind::motor ? 0 : INFINITY;
      goals_.push_back(
          {(row.least_way + way_shift[i]) / dt, (row.most_way + way_shift[i]) / dt, -push, push});
    }
    before_ = way_impulse;
    now_.assign(rows.size(), 0);
  }

  void take_impulses() { before_ = impulse = now_; }
  void take_way_impulses() { way_impulse = now_; }

  // Returns by how much another pass would change velocities of joints.
  double next_change() {
    impulse = now_;
    double change = 0;
    for (std::size_t i = 0; i < rows.size(); ++i)
      change = std::max(change, softness_[i] * std::fabs(impulse[i] - before_[i]));
    return change;
  }

  // Returns the largest part of a row's velocity that one of its bodies has, at the start or at the end.
  double fastest(std::span<const Vector6> start, std::span<const Vector6> end) const {
    double most = 0;
    for (const JointRow& row : problem_.joint_rows) {
      for (const auto& y : {start, end})
        most = std::max(
            {most, std::fabs(dot(row.gradient.a, y[row.a])), std::fabs(dot(row.gradient.b, y[row.b]))});
    }
    return most;
  }

  // Returns what rounding of impulses, about 1e-16 |w| / R, adds to the squares of which a gradient counts as
  // zero that is `flat` of them.
  double rounded(std::span<const Vector6> y, double flat) const {
    constexpr double kRounding = 4e-16 / kSoftness;
    double squares = 0;
    for (const JointRow& row : rows) squares += square(y[row.a]) + square(y[row.b]);
    return squares * (kRounding / flat) * (kRounding / flat);
  }

  // Returns how a y is drawn to where it is to be near.
  Vector6 drawn(std::size_t j, const Vector6& y) const {
    return near_.empty() ? Vector6{} : drawn_by(j, y - near_[j]);
  }
  double curvature_of_nearness(std::size_t j, const Vector6& way) const {
    return near_.empty() ? 0 : dot(drawn_by(j, way), way);
  }
  void add_nearness(std::size_t j, BlockPart<SerialTeam>& sum) const {
    if (near_.empty()) return;
    for (const Vector3& axis : Matrix3::identity().row) {
      const Vector6 unit = {{}, axis};
      sum.add(1, drawn_by(j, unit), unit);
    }
  }

  void push(std::span<const Vector6> y, std::span<Vector6> gradient) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const JointRow& row = rows[i];
      w_[i] = row.along(y) + row.drive;
      now_[i] = impulse_at(i, w_[i]);
      if (row.a > 0) gradient[row.a] -= now_[i] * row.gradient.a;
      if (row.b > 0) gradient[row.b] -= now_[i] * row.gradient.b;
    }
  }

  void add_curvature(const BlockMatrix& matrix) const {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const JointRow& row = rows[i];
      const double slope = slope_at(i, w_[i]);
      if (!(slope > 0)) continue;
      const Vector6 &a = row.gradient.a, &b = row.gradient.b;
      if (row.a > 0) add_product(matrix.diagonal[row.a - 1], slope, a, a);
      if (row.b > 0) add_product(matrix.diagonal[row.b - 1], slope, b, b);
      if (row.a == 0 || row.b == 0) continue;
      if (row.a < row.b)
        add_product(matrix.beside(row.a - 1, row.b - 1), slope, b, a);
      else
        add_product(matrix.beside(row.b - 1, row.a - 1), slope, a, b);
    }
  }

  void take_way(std::span<const Vector6> way) {
    for (std::size_t i = 0; i < rows.size(); ++i) change_of_w_[i] = rows[i].along(way);
  }

  void add_slopes(double length, double& slope, double& curvature) const {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double w = w_[i] + length * change_of_w_[i];
      slope -= impulse_at(i, w) * change_of_w_[i];
      curvature += slope_at(i, w) * change_of_w_[i] * change_of_w_[i];
    }
  }

 private:
  // Joints are never slack, so a softness that contacts could not have does them good.
  static constexpr double kSoftness = 1e-7;

  Vector6 drawn_by(std::size_t j, const Vector6& way) const {
    const Matrix3& spread = problem_.stepped[j].scale.spread;
    return {{}, transposed(spread) * (stiffness[j] * (spread * way.angular))};
  }

  double impulse_at(std::size_t i, double w) const {
    const JointGoal& of = goals_[i];
    const double least = before_[i] + (of.low - w) / softness_[i];
    const double most = before_[i] + (of.high - w) / softness_[i];
    return std::clamp(least > 0 ? least : std::min(most, 0.0), of.least_push, of.most_push);
  }

  // The derivative of impulse_at() by w, less its sign.
  double slope_at(std::size_t i, double w) const {
    const JointGoal& of = goals_[i];
    const double push = impulse_at(i, w);
    const bool acts = push != 0 || of.low == of.high;
    return acts && push > of.least_push && push < of.most_push ? 1 / softness_[i] : 0;
  }

  const IslandProblem& problem_;
  std::vector<double> softness_, w_, change_of_w_;  // of rows
  std::vector<JointGoal> goals_;
  std::vector<double> before_, now_;  // impulses that the function starts from, and those at y
  std::vector<Vector6> near_;         // where stiffness counts; else empty
};

}  // namespace tandem::dynamics
