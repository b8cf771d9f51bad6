#pragma once
#include "kernels/geometry/relative_pose.h"
#include "tandem/formats/view.h"

/// Queries at a level of detail know this of the finest level, on CPU and GPU.
namespace tandem {

/// Returns how far a posed level may be from the posed finest level, in the world: no point of the one
/// surface is farther than this from the other surface, either way; 0 for the finest level itself. The
/// surfaces are those that queries are about, triangles of the float64 points of apply(). level: of an asset
/// with these bounds, in stored coordinates; pose: of these, and is_rigid().
///
/// **Proof.** Let F be the union of the finest level's stored triangles, L that of the level's, R and t the
/// pose, and e the error_bound, at least the Hausdorff distance of F and L. Corners of both are within the
/// bounds, so e need not be larger than their diagonal, which is below 2^130.
///
/// A point x of the posed finest surface is a sum of posed corners with weights that are not negative and sum
/// to 1. So x = R p + t + d, where p is the same sum of stored corners, a point of F, and |d|_k is at most
/// posing_error() in row k, less what underflows. There is a point q of L with |p - q| <= e, and in the same
/// way a point y = R q + t + d' of the posed level. |x - y| <= |R (p - q)| + |d| + |d'|, and that is at most
/// sigma e + 2 (sum of the rows' posing_error()), sigma being the largest singular value of R. No entry of
/// R^T R, as is_rigid() computes it, is farther than kRigidTolerance from the identity's, so sigma^2 <= 1 + 3
/// (kRigidTolerance + 2^-50), and sigma < 1 + 2 kRigidTolerance. The same holds with F and L exchanged.
///
/// All terms are positive and less than 64 operations round them: 2^-40 covers that. Products that underflow
/// lose 2^-1074 each, which 2^-1000 covers.
TANDEM_HD inline double posed_level_error(const LevelView& level, const float* lower, const float* upper,
                                          const Pose& pose) {
  if (level.number == 0) return 0;
  TreeExtent bounds = {};
  for (int k = 0; k < 3; ++k) {
    const double below = std::fabs(static_cast<double>(lower[k])),
                 above = std::fabs(static_cast<double>(upper[k]));
    bounds.posed_reach[k] = below < above ? above : below;
  }
  double posing = 0;
  for (int k = 0; k < 3; ++k) posing += relative_pose_detail::posing_error(pose, bounds, k);
  const double e = level.error_bound < 0x1p130 ? level.error_bound : 0x1p130;
  return (e * (1 + 2 * kRigidTolerance) + 2 * posing) * (1 + 0x1p-40) + 0x1p-1000;
}

/// The clearance that levels are asked for, so that finest levels of a pair whose levels are farther apart
/// are surely farther apart than `within`: by the triangle inequality twice, as a point of either finest
/// surface is within the posed_level_error() of a point of its level. Finest levels that are asked about
/// themselves are asked for `within` itself.
TANDEM_HD inline double clearance_of_levels(double within, double error_a, double error_b) {
  const double errors = error_a + error_b;
  return errors > 0 ? (within + errors) * (1 + 0x1p-50) : within;
}

}  // namespace tandem
