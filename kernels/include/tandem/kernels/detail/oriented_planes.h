#pragma once
#include "tandem/kernels/detail/leaf_planes.h"
#include "tandem/kernels/detail/oriented_test.h"

/// Planes of leaves against nodes of oriented blocks.
namespace tandem {

/// frame::beyond() of the box of an oriented node. The plane lies in a's frame; the node is a's, and then the
/// plane is that of a posed triangle of b, or of_b, and then it is that of a stored triangle of a. error:
/// frame_error(); slack: oriented_slack(). Condition: poses are rigid as is_rigid() says.
///
/// **Proof.** The notation is that of frame_test.h and of docs/box_test.md, section 5: P is the rotation of
/// the node's block, c and h are its box, M and t the relative pose, |M| <= mu <= 1 + 2^-16, and rho bounds
/// each |c_j| + h_j. A vertex below the node lies at z = P y, or z = M P y + t of b, with |y - c| <= h in
/// every coordinate, in real arithmetic. The volume of its image is off from n~ . (z - p~), p~ being the
/// plane's first corner as computed, by at most
///
///     E |n~|_1 + nu (|z - p~|_1 + 3 E),
///
/// for E bounds what the image of a corner of a and that of one of b are off together, epsilon included. It
/// remains to compute n~ . (z - p~) = n~ . (q - p~) + sum_j m_j (y_j - c_j), where q is the image of the
/// box's centre, P c or M P c + t, and m = P^T n~, or P^T M^T n~.
///
/// Let the vector g have the coordinates g_j = |c_j| + h_j, so that |g| <= sqrt(3) rho. P costs
/// 6.02 u, two of them for `inverse_length`, and M costs 4.01 u. So q, dotted with n~, and m, dotted with h,
/// are off together by at most
///
///     6.02 u sum_i |(M^T n~)_i| sum_j |P_ij| g_j <= 6.02 u (sqrt(3) mu |n~|) (sqrt(3) rho) <= 18.1 u mu rho
///     |n~| 4.01 u sum_i (sum_k |M_ki| |n~_k|) (sum_j |P_ij| g_j)
///         <= 4.01 u (sqrt(3) mu |n~|) (3 rho) <= 20.9 u mu rho |n~|,
///
/// and u |t|_inf |n~|_1 for the last sum of q: the first for rows of P have length 1, the second by the
/// Frobenius norms of M and P. As |n~| <= |n~|_1, these are less than `slack` times |n~|_1, which has 47.9 u
/// mu rho + 31 u |t| and more. Differences with p~, products and sums have four roundings a term.
///
/// |z - p~|_1 is at most that of q and sum_j |A_j|_1 h_j, A_j = M P's columns, |A_j|_1 <= sqrt(3) mu < 1.75.
/// Below the normal range a coordinate of q loses less than 2^-100, m_j h_j less than 2^-90, since h is below
/// 2^30 where E is finite: `slack` has 2^-88 to spare, and the bound 2^-80.
TANDEM_HD inline bool beyond(const frame::Plane<float, true>& plane, const RelativePose& b_in_a, bool of_b,
                             const OrientedBlock& block, int node, float error, float slack) {
  constexpr float kU = 0x1p-24f, kUnderflow = 0x1p-80f;
  const BlockFrame frame = frame_of(block.rotation);
  frame::Point<float> center;
  float half_extent[3], normal[3], along[3];
  for (int k = 0; k < 3; ++k) {
    const float* row = frame.scaled[k];
    center.x[k] =
        ((row[0] * block.center[0][node] + row[1] * block.center[1][node]) + row[2] * block.center[2][node]) *
        frame.inverse_length;
    half_extent[k] = block.half_extent[k][node];
    normal[k] = plane.normal[k];
  }
  if (of_b) {
    center = frame::posed(b_in_a, center);
    const auto& m = b_in_a.rotation;
    for (int k = 0; k < 3; ++k) normal[k] = box_terms::dot(m[0][k], m[1][k], m[2][k], plane.normal);
  }
  float w[3], term[3], reached = 0, half_sum = 0;
  for (int k = 0; k < 3; ++k) {
    along[k] = box_terms::dot(frame.scaled[0][k], frame.scaled[1][k], frame.scaled[2][k], normal) *
               frame.inverse_length;
    w[k] = center.x[k] - plane.origin.x[k];
    term[k] = w[k] * plane.normal[k];
    reached += std::fabs(along[k]) * half_extent[k];
    half_sum += half_extent[k];
  }
  const float far = frame::sum_of_magnitudes(w) + 1.75f * half_sum + 3 * (error + slack);
  const float bound = plane.normal_size + slack * frame::sum_of_magnitudes(plane.normal) +
                      plane.normal_error * far + 4 * kU * (frame::sum_of_magnitudes(term) + reached);
  return 1.001f * (reached + bound) + kUnderflow < std::fabs((term[0] + term[1]) + term[2]);
}

/// Of a leaf block and an internal one: the hits less those of nodes that lie beyond the plane of the
/// triangle, as for axis-aligned blocks. slack: oriented_slack().
TANDEM_HD inline std::uint32_t drop_beyond_planes(const OrientedBlock& a, const OrientedBlock& b,
                                                  std::uint32_t hits, const Triangle* triangles_a,
                                                  const Triangle* triangles_b, const RelativePose& b_in_a,
                                                  float error, float slack) {
  const bool leaf_a = a.is_leaf_block();
  const std::uint32_t first = (leaf_a ? a : b).first_below & ~OrientedBlock::kIsLeafBlock;
  std::uint32_t left = hits;
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
  for (; hits != 0; hits &= hits - 1) {
    const int bit = lowest_bit(hits), i = bit / 4, j = bit % 4;
    const TriangleInFrame t =
        leaf_a ? stored_triangle(triangles_a[first + static_cast<std::uint32_t>(i)])
               : posed_triangle(b_in_a, triangles_b[first + static_cast<std::uint32_t>(j)]);
    const frame::Plane<float, true> plane(t.corner[0], t.corner[1], t.corner[2], error);
    if (beyond(plane, b_in_a, leaf_a, leaf_a ? b : a, leaf_a ? j : i, error, slack)) left &= ~(1u << bit);
  }
  return left;
}

}  // namespace tandem
