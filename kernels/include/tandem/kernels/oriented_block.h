#pragma once
#include <cmath>
#include <cstdint>
#ifndef __CUDA_ARCH__
#include <bit>
#endif

#include "tandem/formats/box.h"
#include "tandem/kernels/relative_pose.h"

/// Blocks in frames of their own: the boxes of a block's four nodes lie along the axes of one rotation, which
/// fits what is below the block. They are thinner than boxes along the axes of the mesh, so fewer pairs of
/// them overlap.
namespace tandem {

/// A rotation by its quaternion w + xi + yj + zk, which need not have length 1: whole numbers of at most
/// kLargestQuaternionPart, not all 0, each stored with kQuaternionOffset added, w and y in the lower halves.
/// It is the exact rotation of these numbers, so its rows and columns are exactly orthonormal.
struct BlockRotation {
  std::uint32_t wx, yz;
};

inline constexpr int kLargestQuaternionPart = 2047;
inline constexpr std::uint32_t kQuaternionOffset = 2048;

/// A block's frame, as float32 computes with it: x_mesh = rotation * x_block, rotation = scaled / length.
/// `scaled` and the squared length of the quaternion are whole numbers of at most 2^24, which are exact.
struct BlockFrame {
  float scaled[3][3];
  float inverse_length;  ///< of the squared length, within two units of roundoff
};

namespace oriented_detail {

/// The whole number in the half of a word.
TANDEM_HD inline float quaternion_part(std::uint32_t word, bool upper) {
#ifdef __CUDA_ARCH__
  // 2^23 + n has n in its last bits.
  return __uint_as_float(__byte_perm(word, 0x4B000000u, upper ? 0x7632 : 0x7610)) -
         static_cast<float>(0x1p23 + kQuaternionOffset);
#else
  const std::uint32_t half = upper ? word >> 16 : word & 0xFFFFu;
  return static_cast<float>(static_cast<int>(half) - static_cast<int>(kQuaternionOffset));
#endif
}

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
  const float w = oriented_detail::quaternion_part(rotation.wx, false),
              x = oriented_detail::quaternion_part(rotation.wx, true),
              y = oriented_detail::quaternion_part(rotation.yz, false),
              z = oriented_detail::quaternion_part(rotation.yz, true);
  const float with_x = w * w + x * x, without_x = y * y + z * z, wx_less = w * w - x * x,
              yz_less = y * y - z * z;
  const float xy = x * y, xz = x * z, yz = y * z, wx = w * x, wy = w * y, wz = w * z;
  return {{{with_x - without_x, 2 * (xy - wz), 2 * (xz + wy)},
           {2 * (xy + wz), wx_less + yz_less, 2 * (yz - wx)},
           {2 * (xz - wy), 2 * (yz + wx), wx_less - yz_less}},
          oriented_detail::inverse(with_x + without_x)};
}

/// The quaternion nearest to w + xi + yj + zk. Condition: finite, not all 0.
TANDEM_HD inline BlockRotation rotation_near(float w, float x, float y, float z) {
  const float part[4] = {w, x, y, z};
  float largest = 0;
  for (const float p : part) largest = std::fmax(largest, std::fabs(p));
  std::uint32_t word[4];
  for (int i = 0; i < 4; ++i) {
    const float n = std::rint(part[i] / largest * static_cast<float>(kLargestQuaternionPart));
    word[i] = static_cast<std::uint32_t>(static_cast<int>(n) + static_cast<int>(kQuaternionOffset));
  }
  return {word[0] | word[1] << 16, word[2] | word[3] << 16};
}

/// The mesh's own axes.
TANDEM_HD inline BlockRotation no_rotation() {
  return rotation_near(1, 0, 0, 0);
}

/// How block b's frame lies in block a's, for tests by intervals: b's boxes in a's frame, a's boxes in b's.
struct OrientedPose {
  float rotation[3][3];  ///< x_a = rotation * x_b + translation
  float translation[3];
  float back_translation[3];  ///< x_b = transposed rotation * x_a + back_translation
  float slack;                ///< added to what a box reaches along an axis of the other's
};

/// The slack of the tests of all blocks of two trees, from the pose that relative_pose() made of them.
///
/// **Proof.** Notation is that of docs/box_test.md: a contact has v in A and x in B with |v - (M x + t)| <= s,
/// row by row, M and t being exact float32 numbers and s <= slack_a. Let the frames of two blocks be the
/// exact rotations P and R. In them the points are y = P^T v and z = R^T x, which lie in boxes [c^a +- h^a]
/// and [c^b +- h^b], and with K = P^T M R and T = P^T t
///
///     |y - (K z + T)|_i <= |s|,     |z - (K^T y + T')|_j <= mu |s| + |D|,     T' = -K^T T,          (1)
///
/// |.| of a vector being its length, mu >= |M| (as an operator), and D = (M^T M - I) x, whose parts are at
/// most lack_of_orthonormality() of the reach. So a contact obeys, on a's axis i and on b's axis j,
///
///     |(K c^b + T)_i - c^a_i| <= h^a_i + sum_j |K_ij| h^b_j + |s|,                                  (2)
///     |(K^T c^a + T')_j - c^b_j| <= h^b_j + sum_i |K_ij| h^a_i + mu |s| + |D|.                      (3)
///
/// *K as computed*, K~. n_P P and n_R R are exact, f = inverse_length of both, multiplied, is off by 5.01 u
/// of itself. M (n_R R) passes three roundings an entry, each of at most the sum of magnitudes, in matrix
/// norms: 3.01 u |M|_F |R|_F n_R <= 9.03 u mu n_R; the product with n_P P^T as many again, and the factor
/// 6.02 u sqrt(3) mu. So |K~ - K| <= 29 u mu.
/// *T as computed*: t inverse_length is off by 3.01 u, the sums by 3.01 u |P|_F |t|: 8.3 u |t|, and 2^-100
/// for results below the normal range. *T'*: 29 u mu |t| + 8.3 u mu |t| + 3.01 u sqrt(3) mu |t| <= 43 u mu
/// |t|.
///
/// *The test on a's axis i* is |P~_i - c^a_i| <= h^a_i + (((slack + Q_i0 h_0) + Q_i1 h_1) + Q_i2 h_2), Q =
/// |K~|, P~_i = ((T~_i + K~_i0 c_0) + K~_i1 c_1) + K~_i2 c_2. P~ is off by 29 u mu |c^b| + 8.3 u |t| + 3.01 u
/// |t| + 4.1 u mu |c^b|; sum Q h exceeds sum |K| h less 29 u mu |h^b|; what is computed of the right side
/// loses at most 5.1 u mu |h^b| + u h^a_i + 4.1 u slack, and the left side gains u times the right side. With
/// rho >= |c_j| + h_j for every box and axis, |c| + |h| <= sqrt(6) rho, so it is enough that
/// slack >= 1.0001 (|s| + u (11.4 |t| + 86.5 mu rho_b + 2.1 rho_a)).
/// *On b's axis j*, with T' and (3), 1.0001 (mu |s| + |D| + u (46.1 mu |t| + 86.5 mu rho_a + 2.1 rho_b)).
///
/// rho: no vertex of a tree is farther from its origin than the length of `reach`, in any frame, and
/// `box_along()` rounds by less than 2^-20 of it. Boxes are so rounded outwards that they hold their
/// vertices, but for 2^-140. *Imaginary boxes*: h = -infinity; Q h is -infinity or NaN, and the ordered
/// comparison false. *Range*: rho < 2^121 and |t_i| <= 2^123, so nothing overflows; entries of M are 0 or at
/// least 2^-32, so nothing of K falls below the normal range.
TANDEM_HD inline float oriented_slack(const RelativePose& b_in_a, const TreeExtent& tree_a,
                                      const TreeExtent& tree_b) {
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
  const double rounding = d::kU * mu * (46.2 * std::sqrt(t) + 88.7 * rho);
  return static_cast<float>(d::kSafety * (mu * std::sqrt(s) + std::sqrt(lack_size) + rounding) +
                            d::kLeastSlack);
}

/// How two blocks lie. rotation, translation: of the RelativePose of their trees; slack: oriented_slack().
/// The order of operations is open: the proof allows any, and fused ones.
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
TANDEM_HD inline float b_in_a(const OrientedPose& pose, int i, const float (&center)[3]) {
  const auto& m = pose.rotation;
  return ((pose.translation[i] + m[i][0] * center[0]) + m[i][1] * center[1]) + m[i][2] * center[2];
}

/// How far b reaches along a's axis i, slack included.
TANDEM_HD inline float b_along_a(const OrientedPose& pose, int i, const float (&half_extent)[3]) {
  const auto& m = pose.rotation;
  return ((pose.slack + std::fabs(m[i][0]) * half_extent[0]) + std::fabs(m[i][1]) * half_extent[1]) +
         std::fabs(m[i][2]) * half_extent[2];
}

/// Coordinate j of a's centre in b's frame.
TANDEM_HD inline float a_in_b(const OrientedPose& pose, int j, const float (&center)[3]) {
  const auto& m = pose.rotation;
  return ((pose.back_translation[j] + m[0][j] * center[0]) + m[1][j] * center[1]) + m[2][j] * center[2];
}

/// How far a reaches along b's axis j, slack included.
TANDEM_HD inline float a_along_b(const OrientedPose& pose, int j, const float (&half_extent)[3]) {
  const auto& m = pose.rotation;
  return ((pose.slack + std::fabs(m[0][j]) * half_extent[0]) + std::fabs(m[1][j]) * half_extent[1]) +
         std::fabs(m[2][j]) * half_extent[2];
}

}  // namespace oriented_terms

/// Whether no face normal of either box separates them: if it says no, no posed triangles in the boxes meet,
/// in exact arithmetic, as docs/box_test.md says.
TANDEM_HD inline bool overlap_oriented(const Box& a, const Box& b, const OrientedPose& pose) {
  bool overlap = true;
  for (int k = 0; k < 3; ++k) {
    const float in_a = oriented_terms::b_in_a(pose, k, b.center) - a.center[k];
    const float in_b = oriented_terms::a_in_b(pose, k, a.center) - b.center[k];
    overlap = overlap &&
              std::fabs(in_a) <= a.half_extent[k] + oriented_terms::b_along_a(pose, k, b.half_extent) &&
              std::fabs(in_b) <= b.half_extent[k] + oriented_terms::a_along_b(pose, k, a.half_extent);
  }
  return overlap;
}

/// A coordinate in a block's frame: of a vertex along the frame's axis k, float64, off by at most 2^-49 of
/// the vertex's distance from the origin.
TANDEM_HD inline double along_axis(const BlockFrame& frame, int k, const float (&vertex)[3]) {
  const auto at = [&](int i) { return static_cast<double>(frame.scaled[i][k]) * static_cast<double>(vertex[i]); };
  double squared = 0;  // each column of `scaled` is as long as the quaternion, squared
  for (int i = 0; i < 3; ++i) {
    squared += static_cast<double>(frame.scaled[i][k]) * static_cast<double>(frame.scaled[i][k]);
  }
  return ((at(0) + at(1)) + at(2)) / std::sqrt(squared);
}

/// Centre and half-extent along an axis of a box that holds what lies from `lowest` to `highest`, both of
/// along_axis(), `farthest` being at least the distance of each vertex from the origin.
TANDEM_HD inline void box_along(double lowest, double highest, double farthest, float& center,
                                float& half_extent) {
  center = static_cast<float>(0.5 * (lowest + highest));
  const double above = highest - static_cast<double>(center), below = static_cast<double>(center) - lowest;
  const double half = (above > below ? above : below) + 0x1p-48 * farthest;
  half_extent = static_cast<float>(half * (1 + 0x1p-22));
}

}  // namespace tandem
