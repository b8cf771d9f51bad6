#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "island_problem.h"

namespace tandem::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Pair = std::pair<std::uint32_t, std::uint32_t>;

// The blocks of a contact's bodies, the lower first. Condition: contacts move both.
Pair blocks_of(const IslandProblem& problem, std::size_t contact) {
  const auto [low, high] = std::minmax(problem.a[contact], problem.b[contact]);
  return {low - 1, high - 1};
}

bool is_between_two(const IslandProblem& problem, std::size_t contact) {
  return problem.a[contact] > 0 && problem.b[contact] > 0;
}

// A sparse symmetric matrix of 6 x 6 blocks: one for each body of an island and one for each two that touch.
// Its order of elimination is found once, its factors anew for each set of values.
class BlockMatrix {
 public:
  explicit BlockMatrix(const IslandProblem& problem) : problem_(problem), bodies_(problem.bodies.size() - 1) {
    find_pairs();
    lay_out();
    factors_.analyzePattern(matrix_);
  }

  void set_identity() {
    std::fill(diagonal_.begin(), diagonal_.end(), Matrix6::Identity());
    std::fill(beside_.begin(), beside_.end(), Matrix6::Zero());
  }

  // Adds left^T * weight * right, two rows of one contact.
  void add(std::size_t contact, const ContactRow& left, const ContactRow& right, double weight) {
    const std::uint32_t a = problem_.a[contact], b = problem_.b[contact];
    if (a > 0) diagonal_[a - 1].noalias() += (weight * left.a) * right.a.transpose();
    if (b > 0) diagonal_[b - 1].noalias() += (weight * left.b) * right.b.transpose();
    if (a == 0 || b == 0) return;
    if (a < b) {
      beside_[pair_[contact]].noalias() += (weight * left.b) * right.a.transpose();
    } else {
      beside_[pair_[contact]].noalias() += (weight * left.a) * right.b.transpose();
    }
  }

  // Result: false if the matrix is not positive definite, to rounding.
  bool factorise() {
    for (std::size_t j = 0; j < bodies_; ++j) {
      for (int c = 0; c < 6; ++c) {
        double* at = matrix_.valuePtr() + matrix_.outerIndexPtr()[6 * j + c];
        for (int r = c; r < 6; ++r) *at++ = diagonal_[j](r, c);
        for (std::size_t p = first_pair_[j]; p < first_pair_[j + 1]; ++p) {
          for (int r = 0; r < 6; ++r) *at++ = beside_[p](r, c);
        }
      }
    }
    factors_.factorize(matrix_);
    return factors_.info() == Eigen::Success;
  }

  // Condition: factorise() has been true.
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const { return factors_.solve(right); }

 private:
  void find_pairs() {
    const std::size_t contacts = problem_.contact_count();
    for (std::size_t i = 0; i < contacts; ++i) {
      if (is_between_two(problem_, i)) pairs_.push_back(blocks_of(problem_, i));
    }
    std::sort(pairs_.begin(), pairs_.end());
    pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
    pair_.resize(contacts);
    for (std::size_t i = 0; i < contacts; ++i) {
      if (!is_between_two(problem_, i)) continue;
      const auto found = std::lower_bound(pairs_.begin(), pairs_.end(), blocks_of(problem_, i));
      pair_[i] = static_cast<std::uint32_t>(found - pairs_.begin());
    }
    first_pair_.assign(bodies_ + 1, 0);
    for (const Pair& pair : pairs_) ++first_pair_[pair.first + 1];
    for (std::size_t j = 0; j < bodies_; ++j) first_pair_[j + 1] += first_pair_[j];
  }

  // Column by column: what is below the diagonal of a body's own block, then its blocks with higher bodies.
  void lay_out() {
    diagonal_.resize(bodies_);
    beside_.resize(pairs_.size());
    const auto size = static_cast<Eigen::Index>(6 * bodies_);
    matrix_.resize(size, size);
    std::vector<int> rows;
    rows.reserve(21 * bodies_ + 36 * pairs_.size());
    int* const begin = matrix_.outerIndexPtr();
    for (std::size_t j = 0; j < bodies_; ++j) {
      for (int c = 0; c < 6; ++c) {
        begin[6 * j + c] = static_cast<int>(rows.size());
        for (int r = c; r < 6; ++r) rows.push_back(static_cast<int>(6 * j) + r);
        for (std::size_t p = first_pair_[j]; p < first_pair_[j + 1]; ++p) {
          for (int r = 0; r < 6; ++r) rows.push_back(static_cast<int>(6 * pairs_[p].second) + r);
        }
      }
    }
    begin[size] = static_cast<int>(rows.size());
    matrix_.resizeNonZeros(static_cast<Eigen::Index>(rows.size()));
    std::copy(rows.begin(), rows.end(), matrix_.innerIndexPtr());
  }

  const IslandProblem& problem_;
  std::size_t bodies_;
  std::vector<Pair> pairs_;              // the lower body first, ascending
  std::vector<std::uint32_t> pair_;      // of each contact between two bodies
  std::vector<std::size_t> first_pair_;  // of each lower body
  std::vector<Matrix6> diagonal_, beside_;
  Eigen::SparseMatrix<double> matrix_;  // the lower triangle
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factors_;
};

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

// The impulses of contacts, and those that resist turning of the pairs.
struct IslandImpulses {
  std::vector<Vector3d> contact;  // along normal, first and second
  std::vector<Vector3d> turning;  // of each pair, about the axes of the world
};

// The numbers that the least of the convex function depends on beside the rows.
struct ConvexGoal {
  std::vector<Vector6> free;          // y*: velocities without contacts
  std::vector<double> target;         // of w along the normal
  IslandImpulses impulse;             // l
  std::vector<double> bound;          // of friction
  std::vector<double> turning_bound;  // of what resists turning
};

// Velocities y of an island that make the strictly convex function
//
//     |y - y*|^2 / 2 + sum over contacts of  R_n/2 max(0, l_n + (target - w_n)/R_n)^2 + R_t H(l_t - w_t/R_t)
//                    + sum over pairs of     R_s H(l_s - w_s/R_s)
//
// least. w: velocities of a contact, and of a pair's turning; R: `softness` times what an impulse of 1
// changes them by; H: half the square up to the bound, linear from there on (Huber), so that neither
// friction nor what resists turning depends on the impulse along the normal. The impulses are the
// derivatives. Newton's method on sparse LDL^T, with exact line search.
class ConvexContacts {
 public:
  explicit ConvexContacts(const IslandProblem& problem)
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

  void set_softness(double softness) {
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

  double normal_softness(std::size_t contact) const { return normal_softness_[contact]; }
  double friction_softness(std::size_t contact) const { return friction_softness_[contact]; }
  double turning_softness(std::size_t pair) const { return turning_softness_[pair]; }

  // The velocities of a contact but for its drive.
  Vector3d relative(std::size_t contact, const std::vector<Vector6>& y) const {
    return {problem_.along(problem_.normal[contact], contact, y),
            problem_.along(problem_.first[contact], contact, y),
            problem_.along(problem_.second[contact], contact, y)};
  }

 private:
  // Returns which gradient is zero but for rounding: that of the impulses is about 1e-16 |w| / R.
  double flat_below(const ConvexGoal& goal, const std::vector<Vector6>& y) const {
    constexpr double kFlat = 3e-9;
    double squares = 0;
    for (std::size_t j = 1; j < y.size(); ++j) {
      squares += (y[j] - goal.free[j]).squaredNorm() + 1e-6 * goal.free[j].squaredNorm();
    }
    return kFlat * std::sqrt(squares);
  }

  void find_gradient(const ConvexGoal& goal, const std::vector<Vector6>& y, IslandImpulses& impulse) {
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

  void push(std::size_t contact, const ContactRow& row, double impulse) {
    const std::uint32_t a = problem_.a[contact], b = problem_.b[contact];
    if (a > 0) gradient_.segment<6>(6 * (a - 1)) -= impulse * row.a;
    if (b > 0) gradient_.segment<6>(6 * (b - 1)) -= impulse * row.b;
  }

  void find_curvature(const ConvexGoal& goal) {
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

  bool find_way() {
    if (!matrix_.factorise()) return false;
    const VectorXd way = matrix_.solve(-gradient_);
    for (std::size_t j = 1; j < way_.size(); ++j) way_[j] = way.segment<6>(6 * (j - 1));
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) relative_way_[i] = relative(i, way_);
    for (std::size_t i = 0; i < problem_.pairs.size(); ++i)
      turning_way_[i] = problem_.turning(problem_.pairs[i], way_);
    return true;
  }

  // The root of the derivative along the way, by Newton's method within a bracket.
  double line_search(const ConvexGoal& goal, const std::vector<Vector6>& y) const {
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

  Vector2d wanted_friction(const ConvexGoal& goal, std::size_t i, const Vector3d& w) const {
    return goal.impulse.contact[i].tail<2>() - w.tail<2>() / friction_softness_[i];
  }

  Vector3d wanted_turning(const ConvexGoal& goal, std::size_t i, const Vector3d& w) const {
    return goal.impulse.turning[i] - w / turning_softness_[i];
  }

  Vector3d turning_at(const ConvexGoal& goal, std::size_t i, const Vector3d& w) const {
    return shortened(wanted_turning(goal, i, w), goal.turning_bound[i]);
  }

  // Returns the slope of a turning impulse, as impulse_slope() does of an impulse.
  Vector3d turning_slope(const ConvexGoal& goal, std::size_t i, const Vector3d& w,
                         const Vector3d& change) const {
    return shortened_change<Vector3d>(wanted_turning(goal, i, w), goal.turning_bound[i],
                                      change / turning_softness_[i]);
  }

  Vector3d impulse_at(const ConvexGoal& goal, std::size_t i, const Vector3d& w) const {
    const double normal =
        std::max(0.0, goal.impulse.contact[i].x() + (goal.target[i] - w.x()) / normal_softness_[i]);
    const Vector2d friction = shortened(wanted_friction(goal, i, w), goal.bound[i]);
    return {normal, friction.x(), friction.y()};
  }

  // The derivative of the impulse along a change of w, less its sign.
  Vector3d impulse_slope(const ConvexGoal& goal, std::size_t i, const Vector3d& w,
                         const Vector3d& change) const {
    const bool pushes = goal.impulse.contact[i].x() + (goal.target[i] - w.x()) / normal_softness_[i] > 0;
    const Vector2d slope = shortened_change<Vector2d>(wanted_friction(goal, i, w), goal.bound[i],
                                                      change.tail<2>() / friction_softness_[i]);
    return {pushes ? change.x() / normal_softness_[i] : 0, slope.x(), slope.y()};
  }

  const IslandProblem& problem_;
  BlockMatrix matrix_;
  std::vector<double> normal_softness_, friction_softness_, turning_softness_;
  VectorXd gradient_;
  std::vector<Vector6> way_;  // of a Newton step
  std::vector<Vector3d> relative_,
      relative_way_;                             // velocities of contacts, and how the way changes them
  std::vector<Vector3d> turning_, turning_way_;  // of pairs
};

constexpr int kMostPasses = 30;
constexpr std::uint32_t kMostFactorisations = 100;

class NewtonStep {
 public:
  NewtonStep(const IslandProblem& problem, const StepInput& input, const SolverOptions& options)
      : problem_(problem), input_(input), options_(options), contacts_(problem) {}

  // Result: whether it converged.
  bool solve() { return solve_velocities() && solve_displacement(); }

  // Condition: solve() converged.
  Residual write(IslandProblem& problem) {
    problem.velocity = std::move(end_);
    problem.impulse = std::move(impulse_.contact);
    for (std::size_t i = 0; i < problem.pairs.size(); ++i) problem.pairs[i].impulse = impulse_.turning[i];
    for (std::size_t j = 1; j < mean_.size(); ++j) problem.displacement[j] = input_.dt * mean_[j];
    return residual_of(problem, target_, options_.friction, 1);
  }

 private:
  bool solve_velocities() {
    constexpr double kSoftness = 1e-5;
    contacts_.set_softness(kSoftness);
    ConvexGoal goal = goal_of_velocities();
    target_ = goal.target;
    const double solved = least_change();
    end_ = problem_.velocity;
    for (int pass = 0; pass < kMostPasses; ++pass) {
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

  // Returns by how much another pass would change velocities of contacts.
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

  // Returns by how much another pass would change pairs that turn, as velocities at an arm about as long as
  // that of a contact.
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

std::optional<Residual> solve_newton_step(IslandProblem& problem, const StepInput& input,
                                          const SolverOptions& options) {
  NewtonStep step(problem, input, options);
  if (!step.solve()) return {};
  return step.write(problem);
}

}  // namespace tandem::simulation
