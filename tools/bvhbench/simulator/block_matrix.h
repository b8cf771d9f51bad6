#pragma once
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cstdint>
#include <utility>
#include <vector>

#include "island_problem.h"

namespace tandem::simulation {

/// A sparse symmetric matrix of 6 x 6 blocks: one for each body of an island and one for each two that touch.
/// Its order of elimination is found once, its factors anew for each set of values.
class BlockMatrix {
 public:
  explicit BlockMatrix(const IslandProblem& problem);

  void set_identity();

  /// Adds left^T * weight * right, two rows of one contact.
  void add(std::size_t contact, const ContactRow& left, const ContactRow& right, double weight);

  /// Result: false if the matrix is not positive definite, to rounding.
  bool factorise();

  /// Condition: factorise() has been true.
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const { return factors_.solve(right); }

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  void find_pairs();
  void lay_out();

  const IslandProblem& problem_;
  std::size_t bodies_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;  // the lower body first, ascending
  std::vector<std::uint32_t> pair_;                             // of each contact between two bodies
  std::vector<std::size_t> first_pair_;                         // of each lower body
  std::vector<Matrix6> diagonal_, beside_;
  Eigen::SparseMatrix<double> matrix_;  // the lower triangle
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factors_;
};

}  // namespace tandem::simulation
