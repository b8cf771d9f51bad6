#pragma once
#include <cmath>

#include "kernels/geometry/relative_pose.h"
#include "tandem/formats/box.h"
#include "tandem/formats/oriented_block.h"

/// Tests of blocks in frames of their own: the boxes of a block against those of another, by intervals
/// between the two frames.
namespace tandem {

/// A block's frame, as float32 computes with it: x_mesh = rotation * x_block, rotation = scaled / length.
/// `scaled` and the squared length of the quaternion are whole numbers of at most 2^24, which are exact.
struct BlockFrame {
  float scaled[3][3];
  float inverse_length;  ///< of the squared length, within two units of roundoff
};

namespace oriented_detail {

TANDEM_HD inline float inverse(float x) {
#ifdef __CUDA_ARCH__
  float y;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(x));  // within one unit in the last place
  return y;
#else
  return 1.0f / x;
#endif
}

}  // namespace oriented_detail

TANDEM_HD inline BlockFrame frame_of(const BlockRotation& rotation) {
  const ScaledRotation exact = scaled_rotation(rotation);
  BlockFrame frame;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) frame.scaled[i][k] = exact.scaled[i][k];
  }
  frame.inverse_length = oriented_detail::inverse(exact.squared_length);
  return frame;
}

/// The pose of block b's frame in block a's, for tests by intervals: b's boxes in a's frame, a's boxes in
/// b's.
struct OrientedPose {
  float rotation[3][3];  ///< x_a = rotation * x_b + translation
  float translation[3];
  float back_translation[3];  ///< x_b = transposed rotation * x_a + back_translation
  float slack;                ///< added to what a box reaches along an axis of the other's
};

/// The slack of the tests of all blocks of two trees, from the pose that relative_pose() made of them, such
/// that what overlap_oriented() calls apart is apart. Proof: docs/oriented_box_test.md. Condition: the pose
/// is in range. length: in a's frame; what is apart is then farther apart than that.
TANDEM_HD inline float oriented_slack(const RelativePose& b_in_a, const TreeExtent& tree_a,
                                      const TreeExtent& tree_b, float length = 0) {
  namespace d = relative_pose_detail;
  double norm = 0, lack_size = 0, s = 0, t = 0, rho_a = 0, rho_b = 0;
  for (int j = 0; j < 3; ++j) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      double dot = 0;
      for (int i = 0; i < 3; ++i) {
        dot += static_cast<double>(b_in_a.rotation[i][j]) * static_cast<double>(b_in_a.rotation[i][k]);
      }
      sum += std::fabs(dot);
    }
    if (sum > norm) norm = sum;  // |M|^2 <= the largest row sum of |M^T M|
    const double lack = d::lack_of_orthonormality(b_in_a, tree_b.reach, j);
    lack_size += lack * lack;
    s += static_cast<double>(b_in_a.slack_a[j]) * static_cast<double>(b_in_a.slack_a[j]);
    t += static_cast<double>(b_in_a.translation[j]) * static_cast<double>(b_in_a.translation[j]);
    rho_a += tree_a.reach[j] * tree_a.reach[j];
    rho_b += tree_b.reach[j] * tree_b.reach[j];
  }
  const double mu = norm > 1 ? std::sqrt(norm) : 1;
  const double rho = std::sqrt(rho_a > rho_b ? rho_a : rho_b) * (1 + 0x1p-20);
  const double rounding = d::kU * mu * (31 * std::sqrt(t) + 47.9 * rho);
  double error = std::sqrt(s);
  if (length > 0) error += static_cast<double>(length);
  return static_cast<float>(d::kSafety * (mu * error + std::sqrt(lack_size) + rounding) + d::kLeastSlack);
}

/// Returns how two blocks lie to each other. rotation, translation: those of the RelativePose of their trees;
/// slack: oriented_slack(). The proof allows sums in any order, and fused operations.
TANDEM_HD inline OrientedPose oriented_pose(const float (&rotation)[3][3], const float (&translation)[3],
                                            float slack, const BlockFrame& a, const BlockFrame& b) {
  OrientedPose out;
  const float factor = a.inverse_length * b.inverse_length;
  for (int j = 0; j < 3; ++j) {
    float column[3];
    for (int k = 0; k < 3; ++k) {
      column[k] = (rotation[k][0] * b.scaled[0][j] + rotation[k][1] * b.scaled[1][j]) +
                  rotation[k][2] * b.scaled[2][j];
    }
    for (int i = 0; i < 3; ++i) {
      out.rotation[i][j] =
          ((a.scaled[0][i] * column[0] + a.scaled[1][i] * column[1]) + a.scaled[2][i] * column[2]) * factor;
    }
  }
  const float t[3] = {translation[0] * a.inverse_length, translation[1] * a.inverse_length,
                      translation[2] * a.inverse_length};
  for (int i = 0; i < 3; ++i) {
    out.translation[i] = (a.scaled[0][i] * t[0] + a.scaled[1][i] * t[1]) + a.scaled[2][i] * t[2];
  }
  for (int j = 0; j < 3; ++j) {
    out.back_translation[j] =
        -((out.rotation[0][j] * out.translation[0] + out.rotation[1][j] * out.translation[1]) +
          out.rotation[2][j] * out.translation[2]);
  }
  out.slack = slack;
  return out;
}

/// The terms of the tests, of a box's centre or half-extents.
namespace oriented_terms {

/// Coordinate i of b's centre in a's frame.
TANDEM_HD inline float b_in_a(const OrientedPose& pose, int i, const float (&centre)[3]) {
  const auto& m = pose.rotation;
  return ((pose.translation[i] + m[i][0] * centre[0]) + m[i][1] * centre[1]) + m[i][2] * centre[2];
}

/// Returns how far b reaches along a's axis i, slack included.
TANDEM_HD inline float b_along_a(const OrientedPose& pose, int i, const float (&half_extent)[3]) {
  const auto& m = pose.rotation;
  return ((pose.slack + std::fabs(m[i][0]) * half_extent[0]) + std::fabs(m[i][1]) * half_extent[1]) +
         std::fabs(m[i][2]) * half_extent[2];
}

/// Coordinate j of a's centre in b's frame.
TANDEM_HD inline float a_in_b(const OrientedPose& pose, int j, const float (&centre)[3]) {
  const auto& m = pose.rotation;
  return ((pose.back_translation[j] + m[0][j] * centre[0]) + m[1][j] * centre[1]) + m[2][j] * centre[2];
}

/// Returns how far a reaches along b's axis j, slack included.
TANDEM_HD inline float a_along_b(const OrientedPose& pose, int j, const float (&half_extent)[3]) {
  const auto& m = pose.rotation;
  return ((pose.slack + std::fabs(m[0][j]) * half_extent[0]) + std::fabs(m[1][j]) * half_extent[1]) +
         std::fabs(m[2][j]) * half_extent[2];
}

}  // namespace oriented_terms

/// Returns whether no face normal of either box separates them: if it says no, no posed triangles in the
/// boxes meet, in exact arithmetic, as docs/oriented_box_test.md says.
inline bool overlap_oriented(const Box& a, const Box& b, const OrientedPose& pose) {
  bool overlap = true;
  for (int k = 0; k < 3; ++k) {
    const float in_a = oriented_terms::b_in_a(pose, k, b.centre) - a.centre[k];
    const float in_b = oriented_terms::a_in_b(pose, k, a.centre) - b.centre[k];
    overlap = overlap &&
              std::fabs(in_a) <= a.half_extent[k] + oriented_terms::b_along_a(pose, k, b.half_extent) &&
              std::fabs(in_b) <= b.half_extent[k] + oriented_terms::a_along_b(pose, k, a.half_extent);
  }
  return overlap;
}

}  // namespace tandem
