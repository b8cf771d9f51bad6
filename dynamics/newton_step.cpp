#include <algorithm>
#include <cmath>

#include <utility>
#include <vector>

#include "dynamics/island_joints.h"
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

// A sparse symmetric matrix of 6 x 6 blocks: one for each body of an island and one for each two that touch
// or are joined, and its Cholesky factors. Bodies are eliminated in their order (make_island_problem()): by
// ascending layer, so that the matrix is a band, or in one that elimination_order() has found.
class BlockMatrix {
 public:
  explicit BlockMatrix(const IslandProblem& problem)
      : rows_(problem.bodies.size() - 1), block_(rows_.size()), diagonal_(rows_.size()) {
    const auto join = [&](std::uint32_t a, std::uint32_t b) {
      if (a > 0 && b > 0) rows_[std::min(a, b) - 1].push_back(std::max(a, b) - 1);
    };
    for (std::size_t i = 0; i < problem.contact_count(); ++i) join(problem.a[i], problem.b[i]);
    for (const JointRow& row : problem.joint_rows) join(row.a, row.b);
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

  // Adds left^T * weight * right, two rows of the bodies a and b.
  void add(std::uint32_t a, std::uint32_t b, const ContactRow& left, const ContactRow& right, double weight) {
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

// The impulses of contacts, those that resist turning of the pairs, and those of the rows of joints.
struct IslandImpulses {
  std::vector<Vector3> contact;  // along normal, first and second
  std::vector<Vector3> turning;  // of each pair, about the axes of the world
  std::vector<double> joint;
};

// The velocities that a row of a joint leaves alone, and the bounds of its impulse.
struct JointGoal {
  double low, high, least_push, most_push;
};

// The numbers that the least of the convex function depends on beside the rows.
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

// Velocities y of an island that make the strictly convex function
//
//     |y - y*|^2 / 2 + sum over contacts of  R_n/2 max(0, l_n + (target - w_n)/R_n)^2 + R_t H(l_t - w_t/R_t)
//                    + sum over pairs of     R_s H(l_s - w_s/R_s)
//                    + sum over rows of joints  R_j/2 of the square of an impulse, held within its bounds
//
// least. The impulse of a joint's row is l_j + (low - w_j)/R_j where that is more than 0, l_j + (high -
// w_j)/R_j where that is less, and 0 between; low = high of what is held. w: velocities of a contact, of a
// pair's turning, and of a joint's row; R: `softness` times what an impulse of 1 changes them by; H: half the
// square up to the bound, linear from there on (Huber), so that neither friction nor what resists turning
// depends on the impulse along the normal. The impulses are the derivatives. Where y is to be near to others,
// what that adds is of no moment once it is there. Newton's method on sparse LDL^T, with exact line search.
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

  // What velocities miss of y* and the impulses, after minimise().
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

  // How a y is drawn to where it is to be near.
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
