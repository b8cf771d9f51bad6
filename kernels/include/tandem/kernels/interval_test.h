#pragma once
#include <cmath>

#include "tandem/formats/box.h"
#include "tandem/kernels/relative_pose.h"

/// Box tests by intervals: b's box in a's frame, a's box in b's frame, each as an interval an axis. Where a
/// box takes part in many tests, what depends on it alone is computed once; what is left of a test are six
/// comparisons of the form |d| <= r. The axes are those of overlap_6_axes(), and so is what is pruned.
///
/// Conservative, whether or not a compiler fuses multiplies and adds: the proof is that of docs/box_test.md,
/// with other bounds of rounding, below.
namespace tandem {

/// A RelativePose whose slack is that of interval tests, and a's origin in b's frame.
struct IntervalPose {
  RelativePose b_in_a;
  float back_translation[3];
};

/// From the pose that relative_pose() made and the same trees.
///
/// **Proof.** Notation, s, and (1) are those of docs/box_test.md; s <= slack_a as given. Let T be b's centre
/// in a's frame as computed, ((t + M_0 c_0) + M_1 c_1) + M_2 c_2: at most six roundings, of sums of at most
/// |t| + sum |M_ij| W_j, so off by at most E_i = 4.01 u (sum_j |M_ij| W_j + |t_i|) + 2^-122.
///
/// *a's axis i.* From (2), |d_i| <= h^a_i + s_i + sum_j |M_ij| h^b_j. Computed are |T_i - c^a_i|, one
/// rounding more, and r = h^a_i + (((slack + Q_i0 h_0) + Q_i1 h_1) + Q_i2 h_2), in which h^a_i passes one
/// rounding, slack and the products at most six, and (1 - u)^6 (1 + 8 u) >= 1 + u. So it is enough that
/// slack_a >= 1.0001 (s_i + E_i + 2.1 u H^a_i + 2^-122).
///
/// *b's axis j.* A contact has v in box a, x in box b, |v - (M x + t)| <= s. Multiplied by M_j:
/// |M_j . v - M_j . t - x_j| <= sum_i |M_ij| s_i + sum_k |M_j . M_k - delta_jk| W_k. The test computes
/// T'_j = ((t'_j + M_0j c_0) + M_1j c_1) + M_2j c_2 of a's centre, t' being -M_j . t in float64, off by at
/// most 5 w sum |M_ij t_i|, rounded to float32: all of it off by at most E'_j = 4.01 u (sum_i |M_ij| V_i +
/// |t'_j|)
/// + u |t'_j| + 5 w sum |M_ij t_i| + 2^-122. Then |T'_j - c^b_j| <= h^b_j + (slack + sum_i Q_ij h^a_i), as
/// above, if slack_b >= 1.0001 (sum_i |M_ij| s_i + sum_k |M_j . M_k - delta_jk| W_k + E'_j + 2.1 u H^b_j +
/// 2^-122).
///
/// Imaginary boxes: Q > 0, so r is -infinity and the comparison false. Range: t' and T' stay below 2^126.
TANDEM_HD inline IntervalPose interval_pose(const RelativePose& b_in_a, const TreeExtent& tree_a,
                                            const TreeExtent& tree_b) {
  namespace d = relative_pose_detail;
  IntervalPose out;
  out.b_in_a = b_in_a;
  const auto& m = b_in_a.rotation;
  for (int i = 0; i < 3; ++i) {
    double size = std::fabs(static_cast<double>(b_in_a.translation[i]));
    for (int j = 0; j < 3; ++j) size += std::fabs(static_cast<double>(m[i][j])) * tree_b.reach[j];
    const double own = 4.01 * d::kU * size + 2.1 * d::kU * tree_a.half_extent[i];
    out.b_in_a.slack_a[i] =
        static_cast<float>(d::kSafety * (static_cast<double>(b_in_a.slack_a[i]) + own) + d::kLeastSlack);
  }
  for (int j = 0; j < 3; ++j) {
    double back = 0, back_size = 0, size = 0, s = 0;
    for (int i = 0; i < 3; ++i) {
      const double entry = static_cast<double>(m[i][j]), t = static_cast<double>(b_in_a.translation[i]);
      back -= entry * t;
      back_size += std::fabs(entry * t);
      size += std::fabs(entry) * tree_a.reach[i];
      s += std::fabs(entry) * static_cast<double>(b_in_a.slack_a[i]);
    }
    out.back_translation[j] = static_cast<float>(back);
    const double own = 4.01 * d::kU * (size + std::fabs(back)) + 1.01 * d::kU * std::fabs(back) +
                       5 * d::kU64 * back_size + 2.1 * d::kU * tree_b.half_extent[j];
    out.b_in_a.slack_b[j] = static_cast<float>(
        d::kSafety * (s + d::lack_of_orthonormality(b_in_a, tree_b.reach, j) + own) + d::kLeastSlack);
  }
  return out;
}

/// The terms of the tests, of a box's centre or half-extents.
namespace interval_terms {

/// Coordinate i of b's centre in a's frame.
TANDEM_HD inline float b_in_a(const RelativePose& pose, int i, const float (&center)[3]) {
  const float* row = pose.rotation[i];
  return ((pose.translation[i] + row[0] * center[0]) + row[1] * center[1]) + row[2] * center[2];
}

/// How far b reaches along a's axis i, slack included.
TANDEM_HD inline float b_along_a(const RelativePose& pose, int i, const float (&half_extent)[3]) {
  const float* row = pose.abs_rotation[i];
  return ((pose.slack_a[i] + row[0] * half_extent[0]) + row[1] * half_extent[1]) + row[2] * half_extent[2];
}

/// Coordinate j of a's centre in b's frame.
TANDEM_HD inline float a_in_b(const RelativePose& pose, const float (&back)[3], int j,
                              const float (&center)[3]) {
  const auto& m = pose.rotation;
  return ((back[j] + m[0][j] * center[0]) + m[1][j] * center[1]) + m[2][j] * center[2];
}

/// How far a reaches along b's axis j, slack included.
TANDEM_HD inline float a_along_b(const RelativePose& pose, int j, const float (&half_extent)[3]) {
  const auto& m = pose.abs_rotation;
  return ((pose.slack_b[j] + m[0][j] * half_extent[0]) + m[1][j] * half_extent[1]) + m[2][j] * half_extent[2];
}

}  // namespace interval_terms

/// Whether no face normal of either box separates them, as overlap_6_axes().
TANDEM_HD inline bool overlap_intervals(const Box& a, const Box& b, const IntervalPose& pose) {
  bool overlap = true;
  for (int k = 0; k < 3; ++k) {
    const float in_a = interval_terms::b_in_a(pose.b_in_a, k, b.center) - a.center[k];
    const float in_b = interval_terms::a_in_b(pose.b_in_a, pose.back_translation, k, a.center) - b.center[k];
    overlap =
        overlap &&
        std::fabs(in_a) <= a.half_extent[k] + interval_terms::b_along_a(pose.b_in_a, k, b.half_extent) &&
        std::fabs(in_b) <= b.half_extent[k] + interval_terms::a_along_b(pose.b_in_a, k, a.half_extent);
  }
  return overlap;
}

}  // namespace tandem
