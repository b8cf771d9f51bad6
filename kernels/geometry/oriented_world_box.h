#pragma once
#include <cmath>
#include <cstdint>

#include "tandem/formats/box.h"
#include "tandem/formats/oriented_block.h"
#include "tandem/kernels/world_box.h"

/// World boxes of oriented nodes, float64: for pairs of bodies that float32 cannot take.
namespace tandem {

/// Returns how far the points of a tree lie from the mesh's origin at most, but for roundings of float64.
TANDEM_HD inline double farthest_of(const TreeExtent& tree) {
  double squared = 0;
  for (int k = 0; k < 3; ++k) squared += tree.reach[k] * tree.reach[k];
  return std::sqrt(squared);
}

/// The world box of a real node of a posed oriented block: it contains every posed vertex below the node.
/// farthest: farthest_of() the tree. pose: of stored coordinates, rigid as is_rigid() says.
///
/// **Proof.** Let w = 2^-53, R and t be the pose, S / n the block's rotation P, c and h the node's box. The
/// file is sound, so a vertex v below the node is P y with |y - c| <= h in every coordinate, |v| <= farthest,
/// and |c_j| + h_j <= (1 + 2^-20) farthest (check_oriented.cpp). Let r be the sum of |R_ik| over k, times
/// farthest. In real arithmetic
///
///     (R v)_i lies within sum_j |(R P)_ij| h_j of sum_j (R P)_ij c_j.
///
/// apply() computes (R v)_i with at most three roundings of each term, off by 3.01 w r. Here R S is off by
/// 3.01 w sum_k |R_ik| |S_kj| in entry (i, j); products with c and h, their sums and the quotient add 4.01
/// roundings; so centre and radius are off, together, by at most
///
///     7.03 w sum_k |R_ik| sum_j |P_kj| (|c_j| + h_j) <= 7.03 w sqrt(3) (1 + 2^-20) r <= 12.2 w r,
///
/// since rows of P have length 1. Centre and radius are at most 1.74 r each, so the last sums, of numbers
/// below 3.5 r, add 7.1 w r at most. These are 22.4 w r, less than the margin of 2^-48 r = 32 w r, which has
/// few roundings itself, those of `farthest` included. Results below the normal range are off by 2^-1075
/// each, entries of R S included, whose products with c and h are then off by 2^-1070 farthest. But r is at
/// least farthest / 2, as rows of R have nearly length 1, and farthest at least 2^-149 where any coordinate
/// is not 0, and so is the margin more than 2^-199. Where all are 0, all is exact.
///
/// Last, apply() adds t and rounds once, as here: rounding is monotone, so the sums keep their order.
TANDEM_HD inline WorldBox node_world_box(const Pose& pose, const OrientedBlock& block, int node,
                                         double farthest) {
  const ScaledRotation rotation = scaled_rotation(block.rotation);
  const double length = rotation.squared_length;
  WorldBox box;
  for (int i = 0; i < 3; ++i) {
    const double* row = pose.rotation[i];
    double centre = 0, radius = 0, size = 0;
    for (int j = 0; j < 3; ++j) {
      double turned = 0;  // R S
      for (int k = 0; k < 3; ++k) turned += row[k] * static_cast<double>(rotation.scaled[k][j]);
      centre += turned * static_cast<double>(block.centre[j][node]);
      radius += std::fabs(turned) * static_cast<double>(block.half_extent[j][node]);
      size += std::fabs(row[j]);
    }
    centre /= length;
    radius = radius / length + 0x1p-48 * size * farthest;
    box.lo[i] = detail::plus(centre - radius, pose.translation[i]);
    box.hi[i] = detail::plus(centre + radius, pose.translation[i]);
  }
  return box;
}

/// The node pairs whose world boxes meet; imaginary nodes never do. farthest_a, farthest_b: of the trees.
/// within: boxes at most so far apart along each axis count too; the gap as computed is too large by 2^-53 of
/// itself at most.
TANDEM_HD inline std::uint32_t world_block_pair_mask(const Pose& pose_a, const OrientedBlock& a,
                                                     double farthest_a, const Pose& pose_b,
                                                     const OrientedBlock& b, double farthest_b,
                                                     double within = 0) {
  const double reach = within * (1 + 0x1p-50);
  std::uint32_t mask = 0;
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if (!(a.half_extent[0][i] >= 0)) continue;
    const WorldBox box_a = node_world_box(pose_a, a, i, farthest_a);
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
    for (int j = 0; j < kNodesPerBlock; ++j) {
      if (!(b.half_extent[0][j] >= 0)) continue;
      const WorldBox box_b = node_world_box(pose_b, b, j, farthest_b);
      if (within > 0 ? are_near(box_a, box_b, reach) : overlap(box_a, box_b)) mask |= 1u << (4 * i + j);
    }
  }
  return mask;
}

}  // namespace tandem
