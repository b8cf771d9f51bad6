#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "dynamics/island_problem.h"

namespace tandem::dynamics {

/// A block of a matrix: of the six velocities of one body by those of another.
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

/// m += left right^T
inline void add_product(Matrix6& m, const Vector6& left, const Vector6& right) {
  const Array6 p(left), q(right);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) m.at[i][j] += p.at[i] * q.at[j];
  }
}

/// m -= p q^T
inline void subtract_product(Matrix6& m, const Matrix6& p, const Matrix6& q) {
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) {
      for (int j = 0; j < 6; ++j) m.at[i][j] -= p.at[i][k] * q.at[j][k];
    }
  }
}

/// m becomes its lower triangle L with L L^T = m. False: it is not positive definite, to rounding.
inline bool factorise_block(Matrix6& m) {
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

/// m becomes m L^-T.
inline void divide_by_transposed(Matrix6& m, const Matrix6& lower) {
  for (auto& row : m.at) {
    for (int j = 0; j < 6; ++j) {
      for (int k = 0; k < j; ++k) row[j] -= row[k] * lower.at[j][k];
      row[j] /= lower.at[j][j];
    }
  }
}

/// A sparse symmetric matrix of 6 x 6 blocks: one for each body of an island and one for each two that touch
/// or are joined, and its Cholesky factors. Bodies are eliminated in their order (make_island_problem()): by
/// ascending layer, so that the matrix is a band, or in one that elimination_order() has found.
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

}  // namespace tandem::dynamics
