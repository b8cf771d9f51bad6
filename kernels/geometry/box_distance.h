#pragma once
#include <cmath>

#include "kernels/geometry/box_test.h"
#include "kernels/geometry/frame_test.h"
#include "kernels/geometry/relative_pose.h"
#include "tandem/formats/box.h"

/// Lower bounds of the distance of what lies in two boxes, one posed relative to the other, float32, for CPU
/// and GPU.
///
/// **Proof.** Notation and what is cited are those of docs/box_test.md. Let p and q be posed points of
/// triangles in the boxes, w = p - q, which is p = R_A v + t_A + e_A less q = R_B x + t_B + e_B. Multiplied
/// with N, as in section 1 but with w on one side,
///
///     |v - (M^ x + t^) - N w|_i <= s_i.                                                              (1')
///
/// *a's axis i.* With (1'), |(N w)_i| >= |d_i| - h^a_i - sum_j |M^_ij| h^b_j - s_i. As section 2 shows, T_i
/// as computed is at most (1 + u) (|d_i| + eps_i), and the radius as computed, r, at least (1 + u) (h^a_i +
/// s_i + eps_i + sum_j |M^_ij| h^b_j). So g_i = fl(|T_i| - r) is at most (1 + u)^2 |(N w)_i| where it is
/// positive.
///
/// *b's axis j.* |M^_j . N w| >= |M^_j . d| - sum_k |M^_j . M^_k| h^b_k - sum_i |M^_ij| (h^a_i + s_i). The
/// product M^_j . d as computed is too large by at most sum_i |M^_ij| (eps_i + 4.02 u |T_i|) + 2^-124, of
/// which 8 u sum_i |T_i| is taken away before the radius is: that covers 4.07 u, and the rounding of the
/// difference. The radius as computed is at least h^b_j + sum_k |M^_j . M^_k - delta_jk| h^b_k + sum_i
/// |M^_ij| (h^a_i + s_i + eps_i) + 2^-124 by section 2, whose slack has 2^-88 to spare. So g'_j is at most (1
/// + u) |M^_j . N w| where it is positive.
///
/// *Together.* sum g_i^2 <= (1 + u)^4 |N w|^2, and sum g'_j^2 <= (1 + u)^2 |M^^T N w|^2 <= (1 + u)^2 mu^2 |N
/// w|^2, where mu^2 >= 1 is at least the largest row sum of |M^ M^^T|. Squares and sums add (1 + u)^3 and at
/// most 2^-147 below the normal range. With |N w| <= nu |w|, nu^2 the largest row sum of |N N^T|,
///
///     |w|^2 >= (the larger sum as computed - 2^-120) (1 - 2^-20) / (mu^2 nu^2).
///
/// Imaginary nodes have radii of -infinity, as abs_rotation has no entry that is 0, and so bounds of
/// +infinity. Nothing else overflows where frame_error() is finite: coordinates are below 2^33.
namespace tandem {

/// What lengths in a body's frame tell of distances in the world.
struct FrameLengths {
  double square_to_world;                ///< of a bound of boxes: 1 / (mu^2 nu^2), rounded down
  double least_in_world, most_in_world;  ///< of a length in the frame: at least so much, at most so much
};

/// The pose of b in a's frame, and what lengths in that frame tell of the posed points' distances.
struct DistanceFrame : FrameLengths {
  RelativePose b_in_a;
  float error;  ///< frame_error()
};

namespace distance {

inline constexpr double kSquareSpare = 0x1p-120;

/// The largest row sum of |m m^T - I|, rounded up.
template <typename Real>
TANDEM_HD inline double lack_of_orthonormality(const Real (&m)[3][3]) {
  double largest = 0;
  for (int i = 0; i < 3; ++i) {
    double sum = 0;
    for (int j = 0; j < 3; ++j) {
      double product = i == j ? -1 : 0;
      for (int k = 0; k < 3; ++k) product += static_cast<double>(m[i][k]) * static_cast<double>(m[j][k]);
      sum += std::fabs(product) + 0x1p-49;
    }
    if (!(sum <= largest)) largest = sum;
  }
  return largest;
}

}  // namespace distance

/// Finds what lengths in a frame tell. inverse: of the rotation of the body whose frame it is; of_m:
/// lack_of_orthonormality() of the other body's rotation in it, 0 where there is none. False: the rotations
/// are far from orthonormal.
TANDEM_HD inline bool bound_lengths(const double (&inverse)[3][3], double of_m, FrameLengths& lengths) {
  const double of_a = distance::lack_of_orthonormality(inverse);
  lengths = {};
  if (!(of_a < 0.125 && of_m < 0.125)) return false;
  lengths.square_to_world = (1 - 0x1p-20) / ((1 + of_a) * (1 + of_m));
  // Eigenvalues of N N^T are from 1 - of_a to 1 + of_a; four roundings are spared.
  lengths.least_in_world = (1 - 0x1p-50) / std::sqrt(1 + of_a);
  lengths.most_in_world = (1 + 0x1p-50) / std::sqrt(1 - of_a);
  return true;
}

/// Finds what lengths in a frame tell that has b_in_a and error. False: float32 cannot take the pair, and the
/// frame is of no use.
TANDEM_HD inline bool bound_lengths(const Pose& pose_a, DistanceFrame& frame) {
  double inverse[3][3];
  relative_pose_detail::invert(pose_a.rotation, inverse);
  const double of_m = distance::lack_of_orthonormality(frame.b_in_a.rotation);
  return bound_lengths(inverse, of_m, frame) && frame.error <= static_cast<float>(kLargestInFrame);
}

/// False: as of bound_lengths(). pose_a, pose_b: of stored coordinates.
TANDEM_HD inline bool distance_frame(const Pose& pose_a, const TreeExtent& tree_a, const Pose& pose_b,
                                     const TreeExtent& tree_b, DistanceFrame& out) {
  if (relative_pose(pose_a, tree_a, pose_b, tree_b, out.b_in_a) != RelativePoseStatus::kOk) return false;
  out.error = frame_error(out.b_in_a, tree_a, tree_b);
  return bound_lengths(pose_a, out);
}

namespace distance {

using frame::less;
using frame::magnitude;
using frame::select;

template <typename Value>
TANDEM_HD inline Value positive_part(const Value& x) {
  return select(less(Value{}, x), x, Value{});
}

/// The larger sum of the proof. d: of the centres in a's frame; radii along a's and along b's axes, both
/// boxes' together, with their slack.
template <typename Value>
TANDEM_HD inline Value box_bound(const RelativePose& b_in_a, const Value (&d)[3],
                                 const Value (&radius_on_a)[3], const Value (&radius_on_b)[3]) {
  const Value far = 0x1p-21f * ((magnitude(d[0]) + magnitude(d[1])) + magnitude(d[2]));
  Value on_a[3], on_b[3];
  for (int i = 0; i < 3; ++i) {
    on_a[i] = positive_part(magnitude(d[i]) - radius_on_a[i]);
    on_b[i] = positive_part((magnitude(box_terms::distance_on_face(b_in_a, i, d)) - far) - radius_on_b[i]);
  }
  const Value of_a = (on_a[0] * on_a[0] + on_a[1] * on_a[1]) + on_a[2] * on_a[2];
  const Value of_b = (on_b[0] * on_b[0] + on_b[1] * on_b[1]) + on_b[2] * on_b[2];
  return select(less(of_a, of_b), of_b, of_a);
}

/// The least bound of boxes from which on whatever is in them is at least so far apart, in the world.
TANDEM_HD inline float limit_of(const FrameLengths& frame, double distance) {
  const double square = distance * distance / frame.square_to_world * (1 + 0x1p-22) + 2 * kSquareSpare;
  return square < 0x1p120 ? static_cast<float>(square) : INFINITY;
}

/// Returns how far apart, in the world, what is in boxes with this bound is at least.
TANDEM_HD inline double distance_of(const FrameLengths& frame, float bound) {
  const double square = static_cast<double>(bound) - kSquareSpare;
  return square > 0 ? std::sqrt(square * frame.square_to_world) * (1 - 0x1p-50) : 0;
}

}  // namespace distance

/// A bound of two boxes, of which limit_of() and distance_of() tell the meaning: the square of a length in
/// a's frame.
TANDEM_HD inline float box_distance_bound(const Box& a, const Box& b, const RelativePose& b_in_a) {
  const detail::BoxDistance s = detail::distance(a, b, b_in_a);
  float radius_on_a[3], radius_on_b[3];
  for (int i = 0; i < 3; ++i) {
    radius_on_a[i] = s.half_extent_a[i] + box_terms::b_on_face(b_in_a, i, s.half_extent_b);
    radius_on_b[i] = s.half_extent_b[i] + box_terms::a_on_face(b_in_a, i, s.half_extent_a);
  }
  return distance::box_bound(b_in_a, s.d, radius_on_a, radius_on_b);
}

}  // namespace tandem
