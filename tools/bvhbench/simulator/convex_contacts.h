#pragma once
#include <vector>

#include "block_matrix.h"
#include "island_problem.h"

namespace tandem::simulation {

/// What contacts do, and what resists turning of the pairs.
struct IslandImpulses {
  std::vector<Eigen::Vector3d> contact;  ///< along normal, first and second
  std::vector<Eigen::Vector3d> turning;  ///< of each pair, about the axes of the world
};

/// What the least of the convex function depends on beside the rows.
struct ConvexGoal {
  std::vector<Vector6> free;          ///< y*: velocities without contacts
  std::vector<double> target;         ///< of w along the normal
  IslandImpulses impulse;             ///< l
  std::vector<double> bound;          ///< of friction
  std::vector<double> turning_bound;  ///< of what resists turning
};

/// Velocities y of an island that make the strictly convex function
///
///     |y - y*|^2 / 2 + sum over contacts of  R_n/2 max(0, l_n + (target - w_n)/R_n)^2 + R_t H(l_t - w_t/R_t)
///                    + sum over pairs of     R_s H(l_s - w_s/R_s)
///
/// least. w: velocities of a contact, and of a pair's turning; R: `softness` times what an impulse of 1
/// changes them by; H: half the square up to the bound, linear from there on (Huber), so that neither
/// friction nor what resists turning depends on the impulse along the normal. The impulses are the
/// derivatives. Newton's method on sparse LDL^T, with exact line search.
class ConvexContacts {
 public:
  explicit ConvexContacts(const IslandProblem& problem);

  void set_softness(double softness);

  /// y: where to start, then the least. impulse: those there, a result. Result: false if it takes
  /// more factorisations than are left in `factorisations`, which this counts down.
  bool minimise(const ConvexGoal& goal, std::vector<Vector6>& y, IslandImpulses& impulse,
                std::uint32_t& factorisations);

  double normal_softness(std::size_t contact) const { return normal_softness_[contact]; }
  double friction_softness(std::size_t contact) const { return friction_softness_[contact]; }
  double turning_softness(std::size_t pair) const { return turning_softness_[pair]; }

  /// The velocities of a contact but for its drive.
  Eigen::Vector3d relative(std::size_t contact, const std::vector<Vector6>& y) const;

 private:
  double flat_below(const ConvexGoal& goal, const std::vector<Vector6>& y) const;
  void find_gradient(const ConvexGoal& goal, const std::vector<Vector6>& y, IslandImpulses& impulse);
  void push(std::size_t contact, const ContactRow& row, double impulse);
  void find_curvature(const ConvexGoal& goal);
  bool find_way();
  double line_search(const ConvexGoal& goal, const std::vector<Vector6>& y) const;
  Eigen::Vector2d wanted_friction(const ConvexGoal& goal, std::size_t contact,
                                  const Eigen::Vector3d& w) const;
  Eigen::Vector3d wanted_turning(const ConvexGoal& goal, std::size_t pair, const Eigen::Vector3d& w) const;
  Eigen::Vector3d turning_at(const ConvexGoal& goal, std::size_t pair, const Eigen::Vector3d& w) const;
  Eigen::Vector3d turning_slope(const ConvexGoal& goal, std::size_t pair, const Eigen::Vector3d& w,
                                const Eigen::Vector3d& change) const;
  Eigen::Vector3d impulse_at(const ConvexGoal& goal, std::size_t contact, const Eigen::Vector3d& w) const;
  Eigen::Vector3d impulse_slope(const ConvexGoal& goal, std::size_t contact, const Eigen::Vector3d& w,
                                const Eigen::Vector3d& change) const;

  const IslandProblem& problem_;
  BlockMatrix matrix_;
  std::vector<double> normal_softness_, friction_softness_, turning_softness_;
  Eigen::VectorXd gradient_;
  std::vector<Vector6> way_;  // of a Newton step
  std::vector<Eigen::Vector3d> relative_,
      relative_way_;  // velocities of contacts, and how the way changes them
  std::vector<Eigen::Vector3d> turning_, turning_way_;  // of pairs
};

}  // namespace tandem::simulation
