#pragma once
#include <cmath>

#include "tandem/formats/box.h"
#include "tandem/kernels/pose.h"

/// The relative pose of two assets says how one lies in the frame of the other, in float32, with what
/// rounding can do to it. It is the input of the box tests.
namespace tandem {

/// The place of b's frame in a's: x_a = rotation * x_b + translation. Made by relative_pose().
struct RelativePose {
  float rotation[3][3];
  float abs_rotation[3][3];  ///< what half-extents are multiplied by: |rotation|, rounded up
  float translation[3];
  float slack_a[3];  ///< added to the half-extents of a's boxes, along a's axes
  float slack_b[3];  ///< added to the half-extents of b's boxes, along b's axes
};

enum class [[nodiscard]] RelativePoseStatus{
    kOk,
    kOutOfRange,  ///< see kLargestReach; or a pose that is far from rigid
};

/// The largest reach of a tree, and the largest slack, that float32 box tests take: about 1.3e36. Posed
/// points whose float64 rounding exceeds it, those of translations beyond 10^51, are out of range too.
inline constexpr double kLargestReach = 0x1p120;

namespace relative_pose_detail {

inline constexpr double kU = 0x1p-24;    ///< unit roundoff of float32
inline constexpr double kU64 = 0x1p-53;  ///< of float64

/// The whole reserve of the slack, for what the proof in docs/box_test.md leaves to it: the roundings of the
/// bound itself, terms of second order, and the slack's own part 4.02u. It must not be trimmed: touches that
/// were constructed to need much use up to 0.9990 of the slack of the six axes, and the test
/// BoxTest.TouchesNeedAllOfTheSlackButItsReserve climbs nearly as far on every run.
inline constexpr double kSafety = 1.001;
inline constexpr double kLargestEntry = 1.01;      ///< of a rotation; no nearly rigid pose exceeds it
inline constexpr double kSmallestEntry = 0x1p-32;  ///< rotation entries below it become 0
inline constexpr double kLeastSlack = 0x1p-88;
inline constexpr double kFarthest = 0x1p123;

/// Adjugate over determinant. Any matrix would do (proof below); a good inverse makes the slack small.
TANDEM_HD inline void invert(const double (&r)[3][3], double (&out)[3][3]) {
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      out[j][i] = r[i1][j1] * r[i2][j2] - r[i1][j2] * r[i2][j1];
    }
  }
  const double factor = 1 / (r[0][0] * out[0][0] + r[0][1] * out[1][0] + r[0][2] * out[2][0]);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] *= factor;
  }
}

/// Returns how far apply() may be from real arithmetic in row i, over the points of a tree: from that of the
/// stored points, where vertices are stored rounded (widen_for_rounding()).
TANDEM_HD inline double posing_error(const Pose& pose, const TreeExtent& tree, int i) {
  double size = 0;
  for (int k = 0; k < 3; ++k) size += std::fabs(pose.rotation[i][k]) * tree.posed_reach[k];
  return kU64 * std::fabs(pose.translation[i]) + 4.01 * kU64 * size;
}

/// Rotation and translation from the poses. Result: s of the proof, or NaN where an entry of the rotation is
/// none of a nearly rigid pose.
TANDEM_HD inline void relate(const Pose& a, const TreeExtent& tree_a, const Pose& b, const TreeExtent& tree_b,
                             RelativePose& out, double (&s)[3]) {
  double n[3][3], posing[3], offset[3];
  invert(a.rotation, n);
  for (int k = 0; k < 3; ++k) {
    posing[k] = posing_error(a, tree_a, k) + posing_error(b, tree_b, k);
    offset[k] = b.translation[k] - a.translation[k];
  }
  for (int i = 0; i < 3; ++i) {
    double t = 0, t_size = 0;
    s[i] = 0;
    for (int j = 0; j < 3; ++j) {
      double m = 0, m_size = 0, f = 0, f_size = i == j ? 1 : 0;
      for (int k = 0; k < 3; ++k) {
        m += n[i][k] * b.rotation[k][j];
        m_size += std::fabs(n[i][k] * b.rotation[k][j]);
        f += n[i][k] * a.rotation[k][j];
        f_size += std::fabs(n[i][k] * a.rotation[k][j]);
      }
      f -= i == j ? 1 : 0;
      const bool fits = std::fabs(m) <= kLargestEntry, keep = fits && std::fabs(m) >= kSmallestEntry;
      out.rotation[i][j] = keep ? static_cast<float>(m) : 0.0f;
      t += n[i][j] * offset[j];
      t_size += std::fabs(n[i][j] * offset[j]);
      s[i] +=
          std::fabs(n[i][j]) * posing[j] + (std::fabs(f) + 4.01 * kU64 * f_size) * tree_a.reach[j] +
          (std::fabs(m - static_cast<double>(out.rotation[i][j])) + 3.01 * kU64 * m_size) * tree_b.reach[j];
      if (!fits) s[i] = NAN;
    }
    if (std::fabs(t) > kFarthest) t = t > 0 ? kFarthest : -kFarthest;
    out.translation[i] = static_cast<float>(t);
    s[i] += std::fabs(t - static_cast<double>(out.translation[i])) + 4.01 * kU64 * t_size;
  }
}

/// |rotation|, large enough for what its columns lack to be orthonormal and for rounding.
TANDEM_HD inline void bound_rotation(RelativePose& pose) {
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    const float *row1 = pose.rotation[i1], *row2 = pose.rotation[i2];
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const double cross = std::fabs(static_cast<double>(row1[j1]) * static_cast<double>(row2[j2]) -
                                     static_cast<double>(row1[j2]) * static_cast<double>(row2[j1]));
      const double entry = std::fabs(static_cast<double>(pose.rotation[i][j]));
      pose.abs_rotation[i][j] = static_cast<float>((cross > entry ? cross : entry) * (1 + 10 * kU) + 0x1p-60);
    }
  }
}

/// sum_k |M_j . M_k - delta_jk| h_k.
TANDEM_HD inline double lack_of_orthonormality(const RelativePose& pose, const double (&half_extent)[3],
                                               int j) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    double dot = j == k ? -1 : 0;
    for (int i = 0; i < 3; ++i) {
      dot += static_cast<double>(pose.rotation[i][j]) * static_cast<double>(pose.rotation[i][k]);
    }
    sum += (std::fabs(dot) + 8 * kU64) * half_extent[k];
  }
  return sum;
}

/// Writes a slack where it is at most `largest`, and so within the range of float32. Result: whether it is;
/// NaN is not.
TANDEM_HD inline bool store_slack(double slack, double largest, float& out) {
  const bool fits = slack <= largest;
  out = fits ? static_cast<float>(slack) : 0;
  return fits;
}

}  // namespace relative_pose_detail

/// Makes room for vertices that are not those stored, but farther from them by up to `rounding` along each
/// axis: apply() of a vertex v is then within posing_error() of the image in real arithmetic of the stored
/// point s. By |R_i . (v - s)| <= sum |R_ik| rounding_k, and |v_k| <= reach_k + rounding_k in the bound of
/// apply() itself, what has to be added to 4.01 u reach_k is (1 + 4.01 u) rounding_k.
TANDEM_HD inline void widen_for_rounding(const double (&rounding)[3], TreeExtent& extent) {
  constexpr double kFactor = (1 + 0x1p-40) * (1 / (4.01 * relative_pose_detail::kU64));
  for (int k = 0; k < 3; ++k) extent.posed_reach[k] = extent.reach[k] + kFactor * rounding[k];
}

/// Finds where b lies relative to a, with the slack that makes the box tests conservative: if
/// overlap_6_axes(), overlap_15_axes() or block_pair_mask() says no for a box of tree a and a box of tree b,
/// then no two posed triangles in them meet, in exact arithmetic on the float64 points of apply(). Proof:
/// docs/box_test.md.
///
/// The poses are those of stored coordinates (for_stored_coordinates()). They need not be checked: the result
/// is kOutOfRange, and b_in_a of no use, unless the proof holds. Poses that is_rigid() accepts are in range
/// if both trees reach at most kLargestReach and translations stay below 10^51.
TANDEM_HD inline RelativePoseStatus relative_pose(const Pose& a, const TreeExtent& tree_a, const Pose& b,
                                                  const TreeExtent& tree_b, RelativePose& b_in_a) {
  namespace d = relative_pose_detail;
  double s[3];
  d::relate(a, tree_a, b, tree_b, b_in_a, s);
  d::bound_rotation(b_in_a);
  double half_extent_b[3];
  bool in_range = true;
  for (int j = 0; j < 3; ++j) {
    const double h = tree_b.half_extent[j];
    const double slack =
        d::kSafety * (d::lack_of_orthonormality(b_in_a, tree_b.half_extent, j) + 2 * d::kU * h) +
        d::kLeastSlack;
    half_extent_b[j] = h + slack;
    const bool fits = d::store_slack(slack, 16 * kLargestReach, b_in_a.slack_b[j]);
    in_range = in_range && fits && tree_a.reach[j] <= kLargestReach && tree_b.reach[j] <= kLargestReach;
  }
  for (int i = 0; i < 3; ++i) {
    double size = 0, farthest = tree_a.half_extent[i];
    for (int j = 0; j < 3; ++j) {
      size += std::fabs(static_cast<double>(b_in_a.rotation[i][j])) * tree_b.reach[j];
      farthest += static_cast<double>(b_in_a.abs_rotation[i][j]) * half_extent_b[j];
    }
    const double centres =
        4.01 * d::kU * size + d::kU * std::fabs(static_cast<double>(b_in_a.translation[i]));
    const double slack = d::kSafety * (s[i] + centres + 4.1 * d::kU * farthest) + d::kLeastSlack;
    const bool fits = d::store_slack(slack, kLargestReach, b_in_a.slack_a[i]);
    in_range = in_range && fits;
  }
  return in_range ? RelativePoseStatus::kOk : RelativePoseStatus::kOutOfRange;
}

}  // namespace tandem
