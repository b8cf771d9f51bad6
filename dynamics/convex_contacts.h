#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "dynamics/block_matrix.h"

namespace tandem::dynamics {

using manifold::Vector2;

/// The derivative of Huber's function: what is wanted, but no longer than the bound.
template <typename Vector>
Vector shortened(const Vector& wanted, double bound) {
  const double size = norm(wanted);
  return size > bound ? (bound / size) * wanted : wanted;
}

/// The derivative of shortened() along a change of what is wanted.
template <typename Vector>
Vector shortened_change(const Vector& wanted, double bound, const Vector& change) {
  const double size = norm(wanted);
  if (size <= bound) return change;
  const Vector along = (1 / size) * wanted;
  return (bound / size) * (change - dot(along, change) * along);
}

/// The part of a contact's vector that is across the normal.
inline Vector2 across(const Vector3& of_contact) {
  return {of_contact.y, of_contact.z};
}

/// The impulses of contacts, those that resist turning of the pairs, and those of the rows of joints.
struct IslandImpulses {
  std::vector<Vector3> contact;  // along normal, first and second
  std::vector<Vector3> turning;  // of each pair, about the axes of the world
  std::vector<double> joint;
};

/// The velocities that a row of a joint leaves alone, and the bounds of its impulse.
struct JointGoal {
  double low, high, least_push, most_push;
};

/// The numbers that the least of the convex function depends on beside the rows.
struct ConvexGoal {
  std::vector<Vector6> free;          // y*: velocities without contacts
  std::vector<double> target;         // of w along the normal
  IslandImpulses impulse;             // l
  std::vector<double> bound;          // of friction
  std::vector<double> turning_bound;  // of what resists turning
  std::vector<JointGoal> joint;       // of each row
  std::vector<Vector6> near;          // y that the least is to be near to,
  std::vector<Matrix3> nearness;  // by half the square in this metric of how far spins are from it; or empty
};

/// Velocities y of an island that make the strictly convex function
///
///     |y - y*|^2 / 2 + sum over contacts of  R_n/2 max(0, l_n + (target - w_n)/R_n)^2 + R_t H(l_t - w_t/R_t)
///                    + sum over pairs of     R_s H(l_s - w_s/R_s)
///                    + sum over rows of joints  R_j/2 of the square of an impulse, held within its bounds
///
/// least. The impulse of a joint's row is l_j + (low - w_j)/R_j where that is more than 0, l_j + (high -
/// w_j)/R_j where that is less, and 0 between; low = high of what is held. w: velocities of a contact, of a
/// pair's turning, and of a joint's row; R: `softness` times what an impulse of 1 changes them by; H: half
/// the square up to the bound, linear from there on (Huber), so that neither friction nor what resists
/// turning depends on the impulse along the normal. The impulses are the derivatives. Where y is to be near
/// to others, what that adds is of no moment once it is there. Newton's method on sparse LDL^T, with exact
/// line search.
class ConvexContacts {
 public:
  explicit ConvexContacts(const IslandProblem& problem)
      : problem_(problem),
        matrix_(problem),
        normal_softness_(problem.contact_count()),
        friction_softness_(problem.contact_count()),
        turning_softness_(problem.pairs.size()),
        way_(problem.bodies.size(), Vector6{}),
        relative_(problem.contact_count()),
        relative_way_(problem.contact_count()),
        turning_(problem.pairs.size()),
        turning_way_(problem.pairs.size()),
        joint_rows_(problem.joint_rows),
        joint_softness_(joint_rows_.size()),
        joint_(joint_rows_.size()),
        joint_way_(joint_rows_.size()) {}

  // The rows that joints have now.
  std::vector<JointRow>& joint_rows() { return joint_rows_; }

  void set_softness(double softness) {
    for (std::size_t i = 0; i < joint_rows_.size(); ++i)
      joint_softness_[i] = kJointSoftness * joint_rows_[i].gradient.mobility();
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      normal_softness_[i] = softness * problem_.normal[i].mobility();
      friction_softness_[i] = softness * problem_.friction_mobility(i);
    }
    for (std::size_t i = 0; i < problem_.pairs.size(); ++i)
      turning_softness_[i] = softness * problem_.pairs[i].mobility;
  }

  // y: where to start, then the least. impulse: those there, a result. Result: false if it takes
  // more factorisations than are left in `factorisations`, which this counts down.
  bool minimise(const ConvexGoal& goal, std::vector<Vector6>& y, IslandImpulses& impulse,
                std::uint32_t& factorisations) {
    while (true) {
      find_gradient(goal, y, impulse);
      if (size_of_gradient() <= flat_below(goal, y)) return true;
      if (factorisations == 0) return false;
      --factorisations;
      find_curvature(goal);
      if (!find_way()) return false;
      const double length = line_search(goal, y);
      if (!(length > 0)) return false;
      for (std::size_t j = 1; j < y.size(); ++j) y[j] += length * way_[j];
    }
  }

  // Returns what velocities miss of y* and the impulses, after minimise().
  const std::vector<Vector6>& gradient() const { return gradient_; }

  double joint_softness(std::size_t row) const { return joint_softness_[row]; }
  double normal_softness(std::size_t contact) const { return normal_softness_[contact]; }
  double friction_softness(std::size_t contact) const { return friction_softness_[contact]; }
  double turning_softness(std::size_t pair) const { return turning_softness_[pair]; }

  // The velocities of a contact but for its drive.
  Vector3 relative(std::size_t contact, const std::vector<Vector6>& y) const {
    return {problem_.along(problem_.normal[contact], contact, y),
            problem_.along(problem_.first[contact], contact, y),
            problem_.along(problem_.second[contact], contact, y)};
  }

 private:
  // Joints are never slack, so a softness that contacts could not have does them good.
  static constexpr double kJointSoftness = 1e-7;

  // Returns which gradient is zero but for rounding: that of the impulses is about 1e-16 |w| / R.
  double flat_below(const ConvexGoal& goal, const std::vector<Vector6>& y) const {
    constexpr double kFlat = 3e-9, kRounding = 4e-16 / kJointSoftness;
    double rounded = 0;
    for (const JointRow& row : joint_rows_) rounded += square(y[row.a]) + square(y[row.b]);
    double squares = rounded * (kRounding / kFlat) * (kRounding / kFlat);
    for (std::size_t j = 1; j < y.size(); ++j) {
      squares += square(y[j] - goal.free[j]) + 1e-6 * square(goal.free[j]);
    }
    return kFlat * std::sqrt(squares);
  }

  double size_of_gradient() const {
    double squares = 0;
    for (std::size_t j = 1; j < gradient_.size(); ++j) squares += square(gradient_[j]);
    return std::sqrt(squares);
  }

  void find_gradient(const ConvexGoal& goal, const std::vector<Vector6>& y, IslandImpulses& impulse) {
    gradient_.resize(y.size());
    for (std::size_t j = 1; j < y.size(); ++j) gradient_[j] = y[j] - goal.free[j] + drawn(goal, j, y[j]);
    impulse.contact.resize(problem_.contact_count());
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      relative_[i] = relative(i, y) + problem_.drive[i];
      impulse.contact[i] = impulse_at(goal, i, relative_[i]);
      push(i, problem_.normal[i], impulse.contact[i].x);
      push(i, problem_.first[i], impulse.contact[i].y);
      push(i, problem_.second[i], impulse.contact[i].z);
    }
    impulse.turning.resize(problem_.pairs.size());
    for (std::size_t i = 0; i < problem_.pairs.size(); ++i) {
      const TouchingPair& pair = problem_.pairs[i];
      turning_[i] = problem_.turning(pair, y) + pair.drive;
      impulse.turning[i] = turning_at(goal, i, turning_[i]);
      for (int k = 0; k < 3; ++k) push(pair.begin, pair.turn[k], at(impulse.turning[i], k));
    }
    impulse.joint.resize(joint_rows_.size());
    for (std::size_t i = 0; i < joint_rows_.size(); ++i) {
      const JointRow& row = joint_rows_[i];
      joint_[i] = row.along(y) + row.drive;
      impulse.joint[i] = joint_at(goal, i, joint_[i]);
      if (row.a > 0) gradient_[row.a] -= impulse.joint[i] * row.gradient.a;
      if (row.b > 0) gradient_[row.b] -= impulse.joint[i] * row.gradient.b;
    }
  }

  // Returns how a y is drawn to where it is to be near.
  Vector6 drawn(const ConvexGoal& goal, std::size_t j, const Vector6& y) const {
    if (goal.nearness.empty()) return {};
    return drawn_by(goal, j, y - goal.near[j]);
  }

  Vector6 drawn_by(const ConvexGoal& goal, std::size_t j, const Vector6& way) const {
    const Matrix3& spread = problem_.scale[j].spread;
    return {{}, transposed(spread) * (goal.nearness[j] * (spread * way.angular))};
  }

  void push(std::size_t contact, const ContactRow& row, double impulse) {
    const std::uint32_t a = problem_.a[contact], b = problem_.b[contact];
    if (a > 0) gradient_[a] -= impulse * row.a;
    if (b > 0) gradient_[b] -= impulse * row.b;
  }

  void find_curvature(const ConvexGoal& goal) {
    matrix_.set_identity();
    for (std::uint32_t j = 1; j < problem_.bodies.size() && !goal.nearness.empty(); ++j) {
      for (const Vector3& axis : Matrix3::identity().row) {
        const Vector6 unit = {{}, axis};
        const ContactRow of = {unit, {}}, drawn = {drawn_by(goal, j, unit), {}};
        matrix_.add(j, 0, drawn, of, 1);
      }
    }
    const auto add = [&](std::size_t contact, const ContactRow& left, const ContactRow& right,
                         double weight) {
      matrix_.add(problem_.a[contact], problem_.b[contact], left, right, weight);
    };
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const ContactRow &n = problem_.normal[i], &f = problem_.first[i], &s = problem_.second[i];
      const double normal = impulse_slope(goal, i, relative_[i], {1, 0, 0}).x;
      const Vector3 first = impulse_slope(goal, i, relative_[i], {0, 1, 0});
      const Vector3 second = impulse_slope(goal, i, relative_[i], {0, 0, 1});
      if (normal > 0) add(i, n, n, normal);
      if (goal.bound[i] <= 0) continue;
      add(i, f, f, first.y);
      add(i, s, s, second.z);
      if (first.z == 0) continue;
      add(i, f, s, first.z);
      add(i, s, f, first.z);
    }
    for (std::size_t i = 0; i < problem_.pairs.size(); ++i) {
      if (goal.turning_bound[i] <= 0) continue;
      const TouchingPair& pair = problem_.pairs[i];
      for (int k = 0; k < 3; ++k) {
        const Vector3 column = turning_slope(goal, i, turning_[i], Matrix3::identity().row[k]);
        for (int j = 0; j < 3; ++j) {
          if (at(column, j) != 0) add(pair.begin, pair.turn[j], pair.turn[k], at(column, j));
        }
      }
    }
    for (std::size_t i = 0; i < joint_rows_.size(); ++i) {
      const JointRow& row = joint_rows_[i];
      const double slope = joint_slope(goal, i, joint_[i]);
      if (slope > 0) matrix_.add(row.a, row.b, row.gradient, row.gradient, slope);
    }
  }

  bool find_way() {
    if (!matrix_.factorise()) return false;
    for (std::size_t j = 1; j < way_.size(); ++j) way_[j] = -gradient_[j];
    matrix_.solve(way_);
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) relative_way_[i] = relative(i, way_);
    for (std::size_t i = 0; i < problem_.pairs.size(); ++i)
      turning_way_[i] = problem_.turning(problem_.pairs[i], way_);
    for (std::size_t i = 0; i < joint_rows_.size(); ++i) joint_way_[i] = joint_rows_[i].along(way_);
    return true;
  }

  // The root of the derivative along the way, by Newton's method within a bracket.
  double line_search(const ConvexGoal& goal, const std::vector<Vector6>& y) const {
    constexpr int kMost = 40;
    constexpr double kEnough = 1e-3;
    double linear = 0, quadratic = 0, fall = 0;
    for (std::size_t j = 1; j < y.size(); ++j) {
      linear += dot(y[j] - goal.free[j] + drawn(goal, j, y[j]), way_[j]);
      quadratic += square(way_[j]);
      if (!goal.nearness.empty()) quadratic += dot(drawn_by(goal, j, way_[j]), way_[j]);
      fall -= dot(gradient_[j], way_[j]);
    }
    double low = 0, high = 0, length = 1;
    for (int k = 0; k < kMost; ++k) {
      double slope = linear + length * quadratic, curvature = quadratic;
      for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
        const Vector3 w = relative_[i] + length * relative_way_[i];
        slope -= dot(impulse_at(goal, i, w), relative_way_[i]);
        curvature += dot(impulse_slope(goal, i, w, relative_way_[i]), relative_way_[i]);
      }
      for (std::size_t i = 0; i < problem_.pairs.size(); ++i) {
        const Vector3 w = turning_[i] + length * turning_way_[i];
        slope -= dot(turning_at(goal, i, w), turning_way_[i]);
        curvature += dot(turning_slope(goal, i, w, turning_way_[i]), turning_way_[i]);
      }
      for (std::size_t i = 0; i < joint_rows_.size(); ++i) {
        const double w = joint_[i] + length * joint_way_[i];
        slope -= joint_at(goal, i, w) * joint_way_[i];
        curvature += joint_slope(goal, i, w) * joint_way_[i] * joint_way_[i];
      }
      if (std::fabs(slope) <= kEnough * fall) return length;
      (slope > 0 ? high : low) = length;
      const double next = length - slope / curvature;
      const bool is_inside = next > low && (high == 0 || next < high);
      length = is_inside ? next : high > 0 ? 0.5 * (low + high) : 2 * length;
    }
    return low > 0 ? low : length;
  }

  double joint_at(const ConvexGoal& goal, std::size_t i, double w) const {
    const JointGoal& of = goal.joint[i];
    const double least = goal.impulse.joint[i] + (of.low - w) / joint_softness_[i];
    const double most = goal.impulse.joint[i] + (of.high - w) / joint_softness_[i];
    return std::clamp(least > 0 ? least : std::min(most, 0.0), of.least_push, of.most_push);
  }

  // The derivative of joint_at() by w, less its sign.
  double joint_slope(const ConvexGoal& goal, std::size_t i, double w) const {
    const JointGoal& of = goal.joint[i];
    const double push = joint_at(goal, i, w);
    const bool acts = push != 0 || of.low == of.high;
    return acts && push > of.least_push && push < of.most_push ? 1 / joint_softness_[i] : 0;
  }

  Vector2 wanted_friction(const ConvexGoal& goal, std::size_t i, const Vector3& w) const {
    return across(goal.impulse.contact[i]) - (1 / friction_softness_[i]) * across(w);
  }

  Vector3 wanted_turning(const ConvexGoal& goal, std::size_t i, const Vector3& w) const {
    return goal.impulse.turning[i] - w / turning_softness_[i];
  }

  Vector3 turning_at(const ConvexGoal& goal, std::size_t i, const Vector3& w) const {
    return shortened(wanted_turning(goal, i, w), goal.turning_bound[i]);
  }

  // Returns the slope of a turning impulse, as impulse_slope() does of an impulse.
  Vector3 turning_slope(const ConvexGoal& goal, std::size_t i, const Vector3& w,
                        const Vector3& change) const {
    return shortened_change<Vector3>(wanted_turning(goal, i, w), goal.turning_bound[i],
                                     change / turning_softness_[i]);
  }

  Vector3 impulse_at(const ConvexGoal& goal, std::size_t i, const Vector3& w) const {
    const double normal =
        std::max(0.0, goal.impulse.contact[i].x + (goal.target[i] - w.x) / normal_softness_[i]);
    const Vector2 friction = shortened(wanted_friction(goal, i, w), goal.bound[i]);
    return {normal, friction.x, friction.y};
  }

  // The derivative of the impulse along a change of w, less its sign.
  Vector3 impulse_slope(const ConvexGoal& goal, std::size_t i, const Vector3& w,
                        const Vector3& change) const {
    const bool pushes = goal.impulse.contact[i].x + (goal.target[i] - w.x) / normal_softness_[i] > 0;
    const Vector2 slope = shortened_change<Vector2>(wanted_friction(goal, i, w), goal.bound[i],
                                                    (1 / friction_softness_[i]) * across(change));
    return {pushes ? change.x / normal_softness_[i] : 0, slope.x, slope.y};
  }

  const IslandProblem& problem_;
  BlockMatrix matrix_;
  std::vector<double> normal_softness_, friction_softness_, turning_softness_;
  std::vector<Vector6> gradient_;
  std::vector<Vector6> way_;  // of a Newton step
  std::vector<Vector3> relative_,
      relative_way_;                            // velocities of contacts, and how the way changes them
  std::vector<Vector3> turning_, turning_way_;  // of pairs
  std::vector<JointRow> joint_rows_;
  std::vector<double> joint_softness_, joint_, joint_way_;  // of these
};

}  // namespace tandem::dynamics
