#include "block_matrix.h"

#include <algorithm>

namespace tandem::simulation {
namespace {

using Pair = std::pair<std::uint32_t, std::uint32_t>;

// The blocks of a contact's bodies, the lower first. Condition: contacts move both.
Pair blocks_of(const IslandProblem& problem, std::size_t contact) {
  const auto [low, high] = std::minmax(problem.a[contact], problem.b[contact]);
  return {low - 1, high - 1};
}

bool is_between_two(const IslandProblem& problem, std::size_t contact) {
  return problem.a[contact] > 0 && problem.b[contact] > 0;
}

}  // namespace

BlockMatrix::BlockMatrix(const IslandProblem& problem)
    : problem_(problem), bodies_(problem.bodies.size() - 1) {
  find_pairs();
  lay_out();
  factors_.analyzePattern(matrix_);
}

void BlockMatrix::set_identity() {
  std::fill(diagonal_.begin(), diagonal_.end(), Matrix6::Identity());
  std::fill(beside_.begin(), beside_.end(), Matrix6::Zero());
}

void BlockMatrix::add(std::size_t contact, const ContactRow& left, const ContactRow& right, double weight) {
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

bool BlockMatrix::factorise() {
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

void BlockMatrix::find_pairs() {
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
void BlockMatrix::lay_out() {
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

}  // namespace tandem::simulation
