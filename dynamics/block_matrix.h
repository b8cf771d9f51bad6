#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/carver.h"
#include "dynamics/linear.h"
#include "dynamics/team.h"

namespace tandem::dynamics {

/// A block of a matrix: of the six velocities of one body by those of another.
struct Matrix6 {
  double at[6][6];
};

/// Return the six numbers of a body's velocities as an array.
TANDEM_HD inline const double* numbers_of(const Vector6& v) {
  static_assert(sizeof(Vector6) == 6 * sizeof(double));
  return reinterpret_cast<const double*>(&v);
}
TANDEM_HD inline double* numbers_of(Vector6& v) {
  return reinterpret_cast<double*>(&v);
}

/// So many parts a team makes of a block: each thread of many has a row.
template <typename Team>
inline constexpr std::uint32_t kPartsOfBlock = Team::kIsMany ? 6 : 1;

/// The rows of a block that a thread of a team sums up.
template <typename Team>
struct BlockPart {
  static constexpr std::uint32_t kRows = 6 / kPartsOfBlock<Team>;

  std::uint32_t first;  // row
  double at[kRows][6];

  TANDEM_HD explicit BlockPart(std::uint32_t part) : first(part * kRows), at{} {}

  /// Adds these rows of the identity.
  TANDEM_HD void add_identity() {
    for (std::uint32_t i = 0; i < kRows; ++i) {
      for (std::uint32_t j = 0; j < 6; ++j) at[i][j] += first + i == j ? 1 : 0;
    }
  }
  /// Adds weight left right^T.
  TANDEM_HD void add(double weight, const Vector6& left, const Vector6& right) {
    const double* const q = numbers_of(right);
    for (std::uint32_t i = 0; i < kRows; ++i) {
      const double by = weight * numbers_of(left)[first + i];
      for (int j = 0; j < 6; ++j) at[i][j] += by * q[j];
    }
  }
  TANDEM_HD void write(Matrix6& to) const {
    for (std::uint32_t i = 0; i < kRows; ++i) {
      for (int j = 0; j < 6; ++j) to.at[first + i][j] = at[i][j];
    }
  }
};

/// Calls visit(k) for each row k of a part of a block.
template <typename Team, typename Visit>
TANDEM_HD void for_rows_of_part(std::uint32_t part, const Visit& visit) {
  constexpr std::uint32_t kRows = BlockPart<Team>::kRows;
  for (std::uint32_t k = 0; k < kRows; ++k) visit(part * kRows + k);
}

/// m += weight left right^T
TANDEM_HD inline void add_product(Matrix6& m, double weight, const Vector6& left, const Vector6& right) {
  const double *const p = numbers_of(left), *const q = numbers_of(right);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) m.at[i][j] += weight * p[i] * q[j];
  }
}

/// m -= p q^T, in one of its rows.
TANDEM_HD inline void subtract_product(Matrix6& m, std::uint32_t row, const Matrix6& p, const Matrix6& q) {
  double own[6];
  for (int j = 0; j < 6; ++j) own[j] = m.at[row][j];
  for (int k = 0; k < 6; ++k) {
    for (int j = 0; j < 6; ++j) own[j] -= p.at[row][k] * q.at[j][k];
  }
  for (int j = 0; j < 6; ++j) m.at[row][j] = own[j];
}

/// Returns 1 / sqrt(x).
TANDEM_HD inline double inverse_root(double x) {
#ifdef __CUDA_ARCH__
  return rsqrt(x);
#else
  return 1 / std::sqrt(x);
#endif
}

/// The lower triangle L of a block L L^T, with the inverse of each number on its diagonal: a division takes a
/// GPU as long as thirty products.
struct Factor6 {
  double at[6][6];
  bool exists;  ///< the block is positive definite, to rounding

  TANDEM_HD explicit Factor6(const Matrix6& m) : exists(true) {
    for (int j = 0; j < 6; ++j) {
      double rest = m.at[j][j];
      for (int k = 0; k < j; ++k) rest -= at[j][k] * at[j][k];
      exists = exists && rest > 0;
      at[j][j] = inverse_root(rest);
      for (int i = j + 1; i < 6; ++i) {
        double value = m.at[i][j];
        for (int k = 0; k < j; ++k) value -= at[i][k] * at[j][k];
        at[i][j] = value * at[j][j];
      }
    }
  }

  TANDEM_HD void write(Matrix6& to) const {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) to.at[i][j] = at[i][j];
    }
  }
  /// A row x becomes x L^-T, so as a column it becomes L^-1 x.
  TANDEM_HD void divide_by_transposed(double* x) const {
    double own[6];
    for (int j = 0; j < 6; ++j) {
      own[j] = x[j];
      for (int k = 0; k < j; ++k) own[j] -= own[k] * at[j][k];
      own[j] *= at[j][j];
    }
    for (int j = 0; j < 6; ++j) x[j] = own[j];
  }
};

/// x becomes L^-T x. lower: what a Factor6 has written.
TANDEM_HD inline void divide_by_factor(const Matrix6& lower, double* x) {
  double own[6];
  for (int i = 6; i-- > 0;) {
    own[i] = x[i];
    for (int k = i + 1; k < 6; ++k) own[i] -= lower.at[k][i] * own[k];
    own[i] *= lower.at[i][i];
  }
  for (int i = 0; i < 6; ++i) x[i] = own[i];
}

/// A sparse symmetric matrix of 6 x 6 blocks: one for each body of an island and one for each two that touch
/// or are joined, and its Cholesky factors. Bodies are eliminated in their order (make_island_problem()): by
/// ascending layer, so that the matrix is a band, or in one that elimination_order() has found. Bodies are
/// counted from 0 here.
struct BlockMatrix {
  // rows lists the bodies further on that the column of each body has, ascending, with those that elimination
  // joins to it. Those of body j are rows[begin[j]] ... rows[begin[j + 1]).
  std::span<std::uint32_t> begin, rows;
  std::span<Matrix6> diagonal;
  std::span<Matrix6> blocks;  // of each of the rows

  TANDEM_HD void carve(Carver& carver, std::size_t body_count, std::size_t block_count) {
    carver.take(body_count + 1, begin), carver.take(block_count, rows);
    carver.take(body_count, diagonal), carver.take(block_count, blocks);
  }

  TANDEM_HD std::uint32_t body_count() const { return static_cast<std::uint32_t>(diagonal.size()); }

  /// Returns which block two bodies have. Condition: low < high, and the column of `low` has `high`.
  TANDEM_HD std::uint32_t block_of(std::uint32_t low, std::uint32_t high) const {
    // In a column without gaps this is the place; else it is too far on.
    std::uint32_t first = begin[low], count = begin[low + 1] - first;
    const std::uint32_t guess = first + std::min(high - low, count) - 1;
    if (rows[guess] == high) return guess;
    count = guess - first;
    while (count > 0) {
      const std::uint32_t half = count / 2;
      if (rows[first + half] < high)
        first += half + 1, count -= half + 1;
      else
        count = half;
    }
    return first;
  }
  TANDEM_HD Matrix6& beside(std::uint32_t low, std::uint32_t high) const {
    return blocks[block_of(low, high)];
  }

  /// Solves for x, one for each body: the right side, then the solution. The factors take the place of the
  /// matrix. Result: false if it is not positive definite, to rounding.
  template <typename Team>
  TANDEM_HD bool solve(const Team& team, std::span<Vector6> x) const {
    if (!factorise(team, x)) return false;
    for (std::uint32_t j = body_count(); j-- > 0;) {
      team.each(kPartsOfBlock<Team>, [&](std::uint32_t part) { subtract_columns<Team>(x, j, part); });
      team.barrier();
      if (team.rank() == 0) divide_by_factor(diagonal[j], numbers_of(x[j]));
      team.barrier();
    }
    return true;
  }

 private:
  // The right side goes along as one more row.
  template <typename Team>
  TANDEM_HD bool factorise(const Team& team, std::span<Vector6> x) const {
    constexpr std::uint32_t kParts = kPartsOfBlock<Team>;
    for (std::uint32_t j = 0; j < body_count(); ++j) {
      const Factor6 own(diagonal[j]);  // each thread has one, which is faster than to wait for another's
      if (!own.exists) return false;
      const std::uint32_t first = begin[j], count = begin[j + 1] - first;
      team.each(count * kParts + 1, [&](std::uint32_t i) {
        if (i == count * kParts) return own.divide_by_transposed(numbers_of(x[j]));
        for_rows_of_part<Team>(i % kParts, [&](std::uint32_t row) {
          own.divide_by_transposed(blocks[first + i / kParts].at[row]);
        });
      });
      team.barrier();
      if (team.rank() == 0) own.write(diagonal[j]);
      each_of_triangle(team, count, kParts, [&](std::uint32_t high, std::uint32_t low, std::uint32_t part) {
        const std::uint32_t column = rows[first + low];
        Matrix6& to = low == high ? diagonal[column] : beside(column, rows[first + high]);
        for_rows_of_part<Team>(part, [&](std::uint32_t row) {
          subtract_product(to, row, blocks[first + high], blocks[first + low]);
        });
      });
      team.each(count * kParts, [&](std::uint32_t i) {
        double* const other = numbers_of(x[rows[first + i / kParts]]);
        const double* const by = numbers_of(x[j]);
        for_rows_of_part<Team>(i % kParts, [&](std::uint32_t row) {
          double own_of_other = other[row];
          for (int k = 0; k < 6; ++k) own_of_other -= blocks[first + i / kParts].at[row][k] * by[k];
          other[row] = own_of_other;
        });
      });
      team.barrier();
    }
    return true;
  }

  // Subtracts from a part of x[j] its column times the bodies further on, whose x is known.
  template <typename Team>
  TANDEM_HD void subtract_columns(std::span<Vector6> x, std::uint32_t j, std::uint32_t part) const {
    constexpr std::uint32_t kRows = BlockPart<Team>::kRows;
    double* const to = numbers_of(x[j]) + part * kRows;
    double own[kRows];
    for (std::uint32_t k = 0; k < kRows; ++k) own[k] = to[k];
    for (std::uint32_t p = begin[j]; p < begin[j + 1]; ++p) {
      const double* const other = numbers_of(x[rows[p]]);
      for (int i = 0; i < 6; ++i) {
        for (std::uint32_t k = 0; k < kRows; ++k) own[k] -= blocks[p].at[i][part * kRows + k] * other[i];
      }
    }
    for (std::uint32_t k = 0; k < kRows; ++k) to[k] = own[k];
  }
};

/// The columns of a BlockMatrix.
class BlockColumns {
 public:
  explicit BlockColumns(std::size_t bodies) : rows_(bodies) {}

  void join(std::uint32_t a, std::uint32_t b) { rows_[std::min(a, b)].push_back(std::max(a, b)); }

  /// Adds what elimination joins. Result: how many blocks there are.
  std::size_t eliminate() {
    std::size_t blocks = 0;
    for (auto& rows : rows_) {
      std::sort(rows.begin(), rows.end());
      rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
      if (!rows.empty()) rows_[rows[0]].insert(rows_[rows[0]].end(), rows.begin() + 1, rows.end());
      blocks += rows.size();
    }
    return blocks;
  }

  /// Condition: the matrix has room for these bodies and blocks.
  void write(const BlockMatrix& to) const {
    std::uint32_t at = 0;
    for (std::size_t j = 0; j < rows_.size(); ++j) {
      to.begin[j] = at;
      for (const std::uint32_t row : rows_[j]) to.rows[at++] = row;
    }
    to.begin[rows_.size()] = at;
  }

 private:
  std::vector<std::vector<std::uint32_t>> rows_;
};

}  // namespace tandem::dynamics
