#include "convex_contacts.h"

#include <algorithm>
#include <cmath>

namespace tandem::simulation {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

// The derivative of Huber's function: what is wanted, but no longer than the bound.
template <typename Vector>
Vector shortened(const Vector& wanted, double bound) {
  const double size = wanted.norm();
  return size > bound ? Vector(wanted * (bound / size)) : wanted;
}

// The derivative of shortened() along a change of what is wanted.
template <typename Vector>
Vector shortened_change(const Vector& wanted, double bound, const Vector& change) {
  const double size = wanted.norm();
  if (size <= bound) return change;
  const Vector along = wanted / size;
  return (bound / size) * (change - along.dot(change) * along);
}

}  // namespace

ConvexContacts::ConvexContacts(const IslandProblem& problem)
    : problem_(problem),
      matrix_(problem),
      normal_softness_(problem.contact_count()),
      friction_softness_(problem.contact_count()),
      turning_softness_(problem.pairs.size()),
      way_(problem.bodies.size(), Vector6::Zero()),
      relative_(problem.contact_count()),
      relative_way_(problem.contact_count()),
      turning_(problem.pairs.size()),
      turning_way_(problem.pairs.size()) {}

void ConvexContacts::set_softness(double softness) {
  for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
    normal_softness_[i] = softness * problem_.normal[i].mobility();
    friction_softness_[i] = softness * problem_.friction_mobility(i);
  }
  for (std::size_t i = 0; i < problem_.pairs.size(); ++i)
    turning_softness_[i] = softness * problem_.pairs[i].mobility;
}

bool ConvexContacts::minimise(const ConvexGoal& goal, std::vector<Vector6>& y, IslandImpulses& impulse,
                              std::uint32_t& factorisations) {
  while (true) {
    find_gradient(goal, y, impulse);
    if (gradient_.norm() <= flat_below(goal, y)) return true;
    if (factorisations == 0) return false;
    --factorisations;
    find_curvature(goal);
    if (!find_way()) return false;
    const double length = line_search(goal, y);
    if (!(length > 0)) return false;
    for (std::size_t j = 1; j < y.size(); ++j) y[j] += length * way_[j];
  }
}

// Which gradient is zero but for rounding: that of the impulses is about 1e-16 |w| / R.
double ConvexContacts::flat_below(const ConvexGoal& goal, const std::vector<Vector6>& y) const {
  constexpr double kFlat = 3e-9;
  double squares = 0;
  for (std::size_t j = 1; j < y.size(); ++j) {
    squares += (y[j] - goal.free[j]).squaredNorm() + 1e-6 * goal.free[j].squaredNorm();
  }
  return kFlat * std::sqrt(squares);
}

Vector3d ConvexContacts::relative(std::size_t contact, const std::vector<Vector6>& y) const {
  return {problem_.along(problem_.normal[contact], contact, y),
          problem_.along(problem_.first[contact], contact, y),
          problem_.along(problem_.second[contact], contact, y)};
}

void ConvexContacts::find_gradient(const ConvexGoal& goal, const std::vector<Vector6>& y,
                                   IslandImpulses& impulse) {
  gradient_.resize(static_cast<Eigen::Index>(6 * (y.size() - 1)));
  for (std::size_t j = 1; j < y.size(); ++j) gradient_.segment<6>(6 * (j - 1)) = y[j] - goal.free[j];
  impulse.contact.resize(problem_.contact_count());
  for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
    relative_[i] = relative(i, y) + problem_.drive[i];
    impulse.contact[i] = impulse_at(goal, i, relative_[i]);
    push(i, problem_.normal[i], impulse.contact[i].x());
    push(i, problem_.first[i], impulse.contact[i].y());
    push(i, problem_.second[i], impulse.contact[i].z());
  }
  impulse.turning.resize(problem_.pairs.size());
  for (std::size_t i = 0; i < problem_.pairs.size(); ++i) {
    const TouchingPair& pair = problem_.pairs[i];
    turning_[i] = problem_.turning(pair, y) + pair.drive;
    impulse.turning[i] = turning_at(goal, i, turning_[i]);
    for (int k = 0; k < 3; ++k) push(pair.begin, pair.turn[k], impulse.turning[i][k]);
  }
}

void ConvexContacts::push(std::size_t contact, const ContactRow& row, double impulse) {
  const std::uint32_t a = problem_.a[contact], b = problem_.b[contact];
  if (a > 0) gradient_.segment<6>(6 * (a - 1)) -= impulse * row.a;
  if (b > 0) gradient_.segment<6>(6 * (b - 1)) -= impulse * row.b;
}

bool ConvexContacts::find_way() {
  if (!matrix_.factorise()) return false;
  const VectorXd way = matrix_.solve(-gradient_);
  for (std::size_t j = 1; j < way_.size(); ++j) way_[j] = way.segment<6>(6 * (j - 1));
  for (std::size_t i = 0; i < problem_.contact_count(); ++i) relative_way_[i] = relative(i, way_);
  for (std::size_t i = 0; i < problem_.pairs.size(); ++i)
    turning_way_[i] = problem_.turning(problem_.pairs[i], way_);
  return true;
}

Vector2d ConvexContacts::wanted_friction(const ConvexGoal& goal, std::size_t i, const Vector3d& w) const {
  return goal.impulse.contact[i].tail<2>() - w.tail<2>() / friction_softness_[i];
}

Vector3d ConvexContacts::wanted_turning(const ConvexGoal& goal, std::size_t i, const Vector3d& w) const {
  return goal.impulse.turning[i] - w / turning_softness_[i];
}

Vector3d ConvexContacts::turning_at(const ConvexGoal& goal, std::size_t i, const Vector3d& w) const {
  return shortened(wanted_turning(goal, i, w), goal.turning_bound[i]);
}

// As impulse_slope().
Vector3d ConvexContacts::turning_slope(const ConvexGoal& goal, std::size_t i, const Vector3d& w,
                                       const Vector3d& change) const {
  return shortened_change<Vector3d>(wanted_turning(goal, i, w), goal.turning_bound[i],
                                    change / turning_softness_[i]);
}

Vector3d ConvexContacts::impulse_at(const ConvexGoal& goal, std::size_t i, const Vector3d& w) const {
  const double normal =
      std::max(0.0, goal.impulse.contact[i].x() + (goal.target[i] - w.x()) / normal_softness_[i]);
  const Vector2d friction = shortened(wanted_friction(goal, i, w), goal.bound[i]);
  return {normal, friction.x(), friction.y()};
}

// The derivative of the impulse along a change of w, less its sign.
Vector3d ConvexContacts::impulse_slope(const ConvexGoal& goal, std::size_t i, const Vector3d& w,
                                       const Vector3d& change) const {
  const bool pushes = goal.impulse.contact[i].x() + (goal.target[i] - w.x()) / normal_softness_[i] > 0;
  const Vector2d slope = shortened_change<Vector2d>(wanted_friction(goal, i, w), goal.bound[i],
                                                    change.tail<2>() / friction_softness_[i]);
  return {pushes ? change.x() / normal_softness_[i] : 0, slope.x(), slope.y()};
}

void ConvexContacts::find_curvature(const ConvexGoal& goal) {
  matrix_.set_identity();
  for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
    const ContactRow &n = problem_.normal[i], &f = problem_.first[i], &s = problem_.second[i];
    const double normal = impulse_slope(goal, i, relative_[i], Vector3d::UnitX()).x();
    const Vector3d first = impulse_slope(goal, i, relative_[i], Vector3d::UnitY());
    const Vector3d second = impulse_slope(goal, i, relative_[i], Vector3d::UnitZ());
    if (normal > 0) matrix_.add(i, n, n, normal);
    if (goal.bound[i] <= 0) continue;
    matrix_.add(i, f, f, first.y());
    matrix_.add(i, s, s, second.z());
    if (first.z() == 0) continue;
    matrix_.add(i, f, s, first.z());
    matrix_.add(i, s, f, first.z());
  }
  for (std::size_t i = 0; i < problem_.pairs.size(); ++i) {
    if (goal.turning_bound[i] <= 0) continue;
    const TouchingPair& pair = problem_.pairs[i];
    for (int k = 0; k < 3; ++k) {
      const Vector3d column = turning_slope(goal, i, turning_[i], Vector3d::Unit(k));
      for (int j = 0; j < 3; ++j) {
        if (column[j] != 0) matrix_.add(pair.begin, pair.turn[j], pair.turn[k], column[j]);
      }
    }
  }
}

// The root of the derivative along the way, by Newton's method within a bracket.
double ConvexContacts::line_search(const ConvexGoal& goal, const std::vector<Vector6>& y) const {
  constexpr int kMost = 40;
  constexpr double kEnough = 1e-3;
  double linear = 0, quadratic = 0, fall = 0;
  for (std::size_t j = 1; j < y.size(); ++j) {
    linear += (y[j] - goal.free[j]).dot(way_[j]);
    quadratic += way_[j].squaredNorm();
    fall -= gradient_.segment<6>(6 * (j - 1)).dot(way_[j]);
  }
  double low = 0, high = 0, length = 1;
  for (int k = 0; k < kMost; ++k) {
    double slope = linear + length * quadratic, curvature = quadratic;
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const Vector3d w = relative_[i] + length * relative_way_[i];
      slope -= impulse_at(goal, i, w).dot(relative_way_[i]);
      curvature += impulse_slope(goal, i, w, relative_way_[i]).dot(relative_way_[i]);
    }
    for (std::size_t i = 0; i < problem_.pairs.size(); ++i) {
      const Vector3d w = turning_[i] + length * turning_way_[i];
      slope -= turning_at(goal, i, w).dot(turning_way_[i]);
      curvature += turning_slope(goal, i, w, turning_way_[i]).dot(turning_way_[i]);
    }
    if (std::fabs(slope) <= kEnough * fall) return length;
    (slope > 0 ? high : low) = length;
    const double next = length - slope / curvature;
    const bool is_inside = next > low && (high == 0 || next < high);
    length = is_inside ? next : high > 0 ? 0.5 * (low + high) : 2 * length;
  }
  return low > 0 ? low : length;
}

}  // namespace tandem::simulation
