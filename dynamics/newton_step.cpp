#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "dynamics/island_problem.h"

namespace tandem::dynamics {
namespace {

using manifold::Vector2;

// A block of a matrix: of the six velocities of one body by those of another.
struct Matrix6 {
  double at[6][6];

  static Matrix6 identity() {
    Matrix6 out = {};
    for (int i = 0; i < 6; ++i) out.at[i][i] = 1;
    return out;
  }
};

struct Array6 {
  double at[6];

  explicit Array6(const Vector6& v)
      : at{v.linear.x, v.linear.y, v.linear.z, v.angular.x, v.angular.y, v.angular.z} {}
  Vector6 vector() const { return {{at[0], at[1], at[2]}, {at[3], at[4], at[5]}}; }
};

// m += left right^T
void add_product(Matrix6& m, const Vector6& left, const Vector6& right) {
  const Array6 p(left), q(right);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) m.at[i][j] += p.at[i] * q.at[j];
  }
}

// m -= p q^T
void subtract_product(Matrix6& m, const Matrix6& p, const Matrix6& q) {
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) {
      for (int j = 0; j < 6; ++j) m.at[i][j] -= p.at[i][k] * q.at[j][k];
    }
  }
}

// m becomes its lower triangle L with L L^T = m. False: it is not positive definite, to rounding.
bool factorise_block(Matrix6& m) {
  for (int j = 0; j < 6; ++j) {
    double rest = m.at[j][j];
    for (int k = 0; k < j; ++k) rest -= m.at[j][k] * m.at[j][k];
    if (!(rest > 0)) return false;
    m.at[j][j] = std::sqrt(rest);
    for (int i = j + 1; i < 6; ++i) {
      double value = m.at[i][j];
      for (int k = 0; k < j; ++k) value -= m.at[i][k] * m.at[j][k];
      m.at[i][j] = value / m.at[j][j];
    }
  }
  return true;
}

// m becomes m L^-T.
void divide_by_transposed(Matrix6& m, const Matrix6& lower) {
  for (auto& row : m.at) {
    for (int j = 0; j < 6; ++j) {
      for (int k = 0; k < j; ++k) row[j] -= row[k] * lower.at[j][k];
      row[j] /= lower.at[j][j];
    }
  }
}

// A sparse symmetric matrix of 6 x 6 blocks: one for each body of an island and one for each two that touch,
// and its Cholesky factors. Bodies come by ascending layer (make_island_problem()), so that the matrix is a
// band, and are eliminated in this order.
class BlockMatrix {
 public:
  explicit BlockMatrix(const IslandProblem& problem)
      : problem_(problem), rows_(problem.bodies.size() - 1), block_(rows_.size()), diagonal_(rows_.size()) {
    for (std::size_t i = 0; i < problem.contact_count(); ++i) {
      if (problem.a[i] == 0 || problem.b[i] == 0) continue;
      const auto [low, high] = std::minmax(problem.a[i], problem.b[i]);
      rows_[low - 1].push_back(high - 1);
    }
    // Eliminating a body joins all that it touches further on.
    for (auto& rows : rows_) {
      std::sort(rows.begin(), rows.end());
      rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
      if (!rows.empty()) rows_[rows[0]].insert(rows_[rows[0]].end(), rows.begin() + 1, rows.end());
    }
    for (std::size_t j = 0; j < rows_.size(); ++j) block_[j].resize(rows_[j].size());
  }

  void set_identity() {
    std::fill(diagonal_.begin(), diagonal_.end(), Matrix6::identity());
    for (auto& blocks : block_) std::fill(blocks.begin(), blocks.end(), Matrix6{});
  }

  // Adds left^T * weight * right, two rows of one contact.
  void add(std::size_t contact, const ContactRow& left, const ContactRow& right, double weight) {
    const std::uint32_t a = problem_.a[contact], b = problem_.b[contact];
    if (a > 0) add_product(diagonal_[a - 1], weight * left.a, right.a);
    if (b > 0) add_product(diagonal_[b - 1], weight * left.b, right.b);
    if (a == 0 || b == 0) return;
    if (a < b)
      add_product(beside(a - 1, b - 1), weight * left.b, right.a);
    else
      add_product(beside(b - 1, a - 1), weight * left.a, right.b);
  }

  // The factors take the place of the matrix. Result: false if it is not positive definite, to rounding.
  bool factorise() {
    for (std::uint32_t j = 0; j < rows_.size(); ++j) {
      if (!factorise_block(diagonal_[j])) return false;
      for (Matrix6& block : block_[j]) divide_by_transposed(block, diagonal_[j]);
      for (std::size_t q = 0; q < rows_[j].size(); ++q) {
        const std::uint32_t column = rows_[j][q];
        subtract_product(diagonal_[column], block_[j][q], block_[j][q]);
        auto row = rows_[column].begin();
        for (std::size_t p = q + 1; p < rows_[j].size(); ++p) {
          row = std::lower_bound(row, rows_[column].end(), rows_[j][p]);
          subtract_product(block_[column][static_cast<std::size_t>(row - rows_[column].begin())],
                           block_[j][p], block_[j][q]);
        }
      }
    }
    return true;
  }

  // x: the right side, then the solution; x[0] is nobody's. Condition: factorise() has been true.
  void solve(std::vector<Vector6>& x) const {
    for (std::size_t j = 0; j < rows_.size(); ++j) {
      Array6 own(x[j + 1]);
      for (int i = 0; i < 6; ++i) {
        for (int k = 0; k < i; ++k) own.at[i] -= diagonal_[j].at[i][k] * own.at[k];
        own.at[i] /= diagonal_[j].at[i][i];
      }
      x[j + 1] = own.vector();
      for (std::size_t p = 0; p < rows_[j].size(); ++p) {
        Array6 other(x[rows_[j][p] + 1]);
        for (int i = 0; i < 6; ++i) {
          for (int k = 0; k < 6; ++k) other.at[i] -= block_[j][p].at[i][k] * own.at[k];
        }
        x[rows_[j][p] + 1] = other.vector();
      }
    }
    for (std::size_t j = rows_.size(); j-- > 0;) {
      Array6 own(x[j + 1]);
      for (std::size_t p = 0; p < rows_[j].size(); ++p) {
        const Array6 other(x[rows_[j][p] + 1]);
        for (int i = 0; i < 6; ++i) {
          for (int k = 0; k < 6; ++k) own.at[k] -= block_[j][p].at[i][k] * other.at[i];
        }
      }
      for (int i = 6; i-- > 0;) {
        for (int k = i + 1; k < 6; ++k) own.at[i] -= diagonal_[j].at[k][i] * own.at[k];
        own.at[i] /= diagonal_[j].at[i][i];
      }
      x[j + 1] = own.vector();
    }
  }

 private:
  Matrix6& beside(std::uint32_t low, std::uint32_t high) {
    const auto& rows = rows_[low];
    return block_[low]
                 [static_cast<std::size_t>(std::lower_bound(rows.begin(), rows.end(), high) - rows.begin())];
  }

  const IslandProblem& problem_;
  std::vector<std::vector<std::uint32_t>> rows_;  // of each body: those further on that its column has
  std::vector<std::vector<Matrix6>> block_;       // of each of these
  std::vector<Matrix6> diagonal_;
};

// The derivative of Huber's function: what is wanted, but no longer than the bound.
template <typename Vector>
Vector shortened(const Vector& wanted, double bound) {
  const double size = norm(wanted);
  return size > bound ? (bound / size) * wanted : wanted;
}

// The derivative of shortened() along a change of what is wanted.
template <typename Vector>
Vector shortened_change(const Vector& wanted, double bound, const Vector& change) {
  const double size = norm(wanted);
  if (size <= bound) return change;
  const Vector along = (1 / size) * wanted;
  return (bound / size) * (change - dot(along, change) * along);
}

// The part of a contact's vector that is across the normal.
Vector2 across(const Vector3& of_contact) {
  return {of_contact.y, of_contact.z};
}

// The impulses of contacts, and those that resist turning of the pairs.
struct IslandImpulses {
  std::vector<Vector3> contact;  // along normal, first and second
  std::vector<Vector3> turning;  // of each pair, about the axes of the world
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
        way_(problem.bodies.size(), Vector6{}),
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
  // Returns which gradient is zero but for rounding: that of the impulses is about 1e-16 |w| / R.
  double flat_below(const ConvexGoal& goal, const std::vector<Vector6>& y) const {
    constexpr double kFlat = 3e-9;
    double squares = 0;
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
    for (std::size_t j = 1; j < y.size(); ++j) gradient_[j] = y[j] - goal.free[j];
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
  }

  void push(std::size_t contact, const ContactRow& row, double impulse) {
    const std::uint32_t a = problem_.a[contact], b = problem_.b[contact];
    if (a > 0) gradient_[a] -= impulse * row.a;
    if (b > 0) gradient_[b] -= impulse * row.b;
  }

  void find_curvature(const ConvexGoal& goal) {
    matrix_.set_identity();
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const ContactRow &n = problem_.normal[i], &f = problem_.first[i], &s = problem_.second[i];
      const double normal = impulse_slope(goal, i, relative_[i], {1, 0, 0}).x;
      const Vector3 first = impulse_slope(goal, i, relative_[i], {0, 1, 0});
      const Vector3 second = impulse_slope(goal, i, relative_[i], {0, 0, 1});
      if (normal > 0) matrix_.add(i, n, n, normal);
      if (goal.bound[i] <= 0) continue;
      matrix_.add(i, f, f, first.y);
      matrix_.add(i, s, s, second.z);
      if (first.z == 0) continue;
      matrix_.add(i, f, s, first.z);
      matrix_.add(i, s, f, first.z);
    }
    for (std::size_t i = 0; i < problem_.pairs.size(); ++i) {
      if (goal.turning_bound[i] <= 0) continue;
      const TouchingPair& pair = problem_.pairs[i];
      for (int k = 0; k < 3; ++k) {
        const Vector3 column = turning_slope(goal, i, turning_[i], Matrix3::identity().row[k]);
        for (int j = 0; j < 3; ++j) {
          if (at(column, j) != 0) matrix_.add(pair.begin, pair.turn[j], pair.turn[k], at(column, j));
        }
      }
    }
  }

  bool find_way() {
    if (!matrix_.factorise()) return false;
    for (std::size_t j = 1; j < way_.size(); ++j) way_[j] = -gradient_[j];
    matrix_.solve(way_);
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
      linear += dot(y[j] - goal.free[j], way_[j]);
      quadratic += square(way_[j]);
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
      if (std::fabs(slope) <= kEnough * fall) return length;
      (slope > 0 ? high : low) = length;
      const double next = length - slope / curvature;
      const bool is_inside = next > low && (high == 0 || next < high);
      length = is_inside ? next : high > 0 ? 0.5 * (low + high) : 2 * length;
    }
    return low > 0 ? low : length;
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
    Residual out;
    for (std::size_t i = 0; i < problem.contact_count(); ++i) out.add(residual_of(problem, i, target_[i], 1));
    return out;
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
      goal.target.push_back(problem_.rebound[i] > 0 ? rebound_at_end(i, gap) : -gap / input_.dt);
    }
    IslandImpulses before = {problem_.impulse, {}};
    for (const TouchingPair& pair : problem_.pairs) before.turning.push_back(pair.impulse);
    take_impulses(goal, before);
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

  double least_change() const {
    constexpr double kOfGravity = 1e-4, kOfApproach = 1e-6;
    double approach = 0;
    for (std::size_t i = 0; i < problem_.contact_count(); ++i) {
      const Vector3 w = contacts_.relative(i, problem_.velocity) + problem_.drive[i];
      approach = std::max(approach, norm(w));
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

  bool solve_displacement() {
    constexpr double kSoftness = 1e-2;  // what is left is corrected in the next step
    contacts_.set_softness(kSoftness);
    ConvexGoal goal;
    goal.free = problem_.velocity;
    for (std::size_t j = 1; j < goal.free.size(); ++j) goal.free[j] = 0.5 * (goal.free[j] + end_[j]);
    for (const double s : problem_.separation)
      goal.target.push_back(-(s < 0 ? options_.correction : 1) * s / input_.dt);
    goal.impulse = {std::vector<Vector3>(problem_.contact_count(), Vector3{}),
                    std::vector<Vector3>(problem_.pairs.size(), Vector3{})};
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

}  // namespace tandem::dynamics
