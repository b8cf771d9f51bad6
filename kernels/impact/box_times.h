#pragma once
#include "kernels/common/traversal.h"
#include "kernels/impact/pair_motion.h"
#include "tandem/formats/block.h"
#include "tandem/formats/view.h"

/// These functions find how long the boxes of two moving trees stay apart.
///
/// **Along one axis.** Take a time u of the step, a direction n of length at most 1.00001 that does not move,
/// and a point of a tree's box at place p at that time. After s more its place along n is
///
///     n.p + s n.v(p) + e,   |e| <= s^2 / 2 times its greatest acceleration along n,
///
/// v(p) being its velocity at u: it moves straight ahead, and on a circle about an axis that stays. Velocity
/// is linear in p. So, with d the distance of two boxes' centres along n, e their
/// relative velocity, r the sum of both boxes' radii along n and f that of the radii that their velocities
/// have, points of the boxes are apart after s where
///
///     |d + s e| > r + s f + s^2 / 2 acceleration + slack.                                             (1)
///
/// On each of the two sides (d + s e > 0 or < 0) the difference of both sides of (1) is concave in s: where
/// it holds for two times it holds between them. It is linear once s^2 is replaced by s S, for s from 0 to S.
///
/// **Along six axes**: those of both boxes, as they are at u, whose times are joined: as long as each time of
/// an interval has an axis along which (1) holds, the boxes are apart in all of it.
namespace tandem::impact {

/// A tree's nodes in the frame of a tree, which stands still at some time of the step: x is the place of a
/// point of the other tree in that frame,
///
///     x = rotation * y + translation,    velocity of x along the frame's axes = spin * y + drift,
///
/// relative to the frame's origin; a point of the frame's own tree at x has the velocity own_spin * x.
struct FrameMotion {
  Matrix3 rotation, spin, own_spin;
  Vector3 translation, drift;
  double acceleration[3];  ///< acceleration_along() each axis
};

/// A body's tree at some time: stored point v is at matrix * v + arm from the body's centre.
struct TreePlace {
  Matrix3 matrix, inverse, spin;  ///< spin: of the velocity, turn x (matrix * v)
  Vector3 arm, drift;             ///< drift: turn x arm
};

TANDEM_HD inline TreePlace tree_place(const MovingBody& body, const Matrix3& turned) {
  TreePlace place;
  Matrix3 start;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) start.row[i][j] = body.start.rotation[i][j];
  }
  place.matrix = turned * start;
  relative_pose_detail::invert(place.matrix.row, place.inverse.row);
  place.spin = cross(body.turn, place.matrix);
  place.arm = turned * (vector_of(body.start.translation) - body.centre);
  place.drift = manifold::cross(body.turn, place.arm);
  return place;
}

/// offset, displacement: of the other's centre from the frame's own, and in the whole step.
TANDEM_HD inline FrameMotion frame_motion(const PairMotion& pair, const TreePlace& own,
                                          const TreePlace& other, const Vector3& offset,
                                          const Vector3& displacement) {
  FrameMotion frame;
  frame.rotation = own.inverse * other.matrix;
  frame.spin = own.inverse * other.spin;
  frame.translation = own.inverse * (offset + other.arm - own.arm);
  frame.drift = own.inverse * (displacement + other.drift - own.drift);
  frame.own_spin = own.inverse * own.spin;
  for (int k = 0; k < 3; ++k) {
    frame.acceleration[k] =
        acceleration_along(pair, vector_of(own.inverse.row[k]), pair.a->fastest, pair.b->fastest);
  }
  return frame;
}

/// The two frames of a pair from some time on.
struct PairFrames {
  FrameMotion of_a, of_b;
  double slack;
  double margin;  ///< how near nodes come in the times that time_apart() tells
};

TANDEM_HD inline PairFrames pair_frames(const PairMotion& pair, const PairPlace& place, double margin) {
  const TreePlace a = tree_place(*pair.a, place.turn_a), b = tree_place(*pair.b, place.turn_b);
  return {frame_motion(pair, a, b, place.offset, pair.displacement),
          frame_motion(pair, b, a, -place.offset, -pair.displacement), pair.slack, margin};
}

/// Nodes of a block along the axes of a frame: centres, their velocities, and the radii of both.
template <int kNodes>
struct MovingNodes {
  double centre[3][kNodes], velocity[3][kNodes];
  double radius[3][kNodes], spread[3][kNodes];
};

TANDEM_HD inline double row_times(const double* row, const float (&v)[3][kNodesPerBlock], int node) {
  return row[0] * static_cast<double>(v[0][node]) + row[1] * static_cast<double>(v[1][node]) +
         row[2] * static_cast<double>(v[2][node]);
}

/// Returns the product with the magnitudes of the row.
TANDEM_HD inline double sizes_times(const double* row, const float (&v)[3][kNodesPerBlock], int node) {
  return std::fabs(row[0]) * static_cast<double>(v[0][node]) +
         std::fabs(row[1]) * static_cast<double>(v[1][node]) +
         std::fabs(row[2]) * static_cast<double>(v[2][node]);
}

/// Places nodes of the frame's own tree: those of the block from `first` on.
template <int kNodes>
TANDEM_HD inline void own_nodes(const FrameMotion& frame, const Block& block, int first,
                                MovingNodes<kNodes>& out) {
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < kNodes; ++i) {
      out.centre[k][i] = static_cast<double>(block.centre[k][first + i]);
      out.radius[k][i] = static_cast<double>(block.half_extent[k][first + i]);
      out.velocity[k][i] = row_times(frame.own_spin.row[k], block.centre, first + i);
      out.spread[k][i] = sizes_times(frame.own_spin.row[k], block.half_extent, first + i);
    }
  }
}

/// Places nodes of the other tree.
template <int kNodes>
TANDEM_HD inline void other_nodes(const FrameMotion& frame, const Block& block, int first,
                                  MovingNodes<kNodes>& out) {
  const double t[3] = {frame.translation.x, frame.translation.y, frame.translation.z};
  const double drift[3] = {frame.drift.x, frame.drift.y, frame.drift.z};
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < kNodes; ++i) {
      out.centre[k][i] = row_times(frame.rotation.row[k], block.centre, first + i) + t[k];
      out.radius[k][i] = sizes_times(frame.rotation.row[k], block.half_extent, first + i);
      out.velocity[k][i] = row_times(frame.spin.row[k], block.centre, first + i) + drift[k];
      out.spread[k][i] = sizes_times(frame.spin.row[k], block.half_extent, first + i);
    }
  }
}

/// Nodes of a block pair along the axes of one frame: those of the frame's own tree, and of the other.
template <int kNodes>
struct FrameNodes {
  MovingNodes<kNodes> own, other;
};

/// An axis of (1): distance, velocity, radius with slack, and how fast the radius grows within `most`.
struct AxisMotion {
  double distance, velocity, radius, growth;
};

template <int kNodes>
TANDEM_HD inline AxisMotion axis_motion(const MovingNodes<kNodes>& x, int i, const MovingNodes<kNodes>& y,
                                        int j, int k, double slack, double acceleration, double most) {
  return {y.centre[k][j] - x.centre[k][i], y.velocity[k][j] - x.velocity[k][i],
          y.radius[k][j] + x.radius[k][i] + slack,
          y.spread[k][j] + x.spread[k][i] + 0.5 * acceleration * most};
}

/// Raises margins to more than 0 for pairs of node i of x and each node of y that an axis of the frame tells
/// apart from now on for `most`. Imaginary nodes have any value.
template <int kNodes>
TANDEM_HD inline void raise_margins(const FrameMotion& frame, const MovingNodes<kNodes>& x, int i,
                                    const MovingNodes<kNodes>& y, double slack, double most,
                                    double (&margin)[kNodes]) {
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < kNodes; ++j) {
      const AxisMotion m = axis_motion(x, i, y, j, k, slack, frame.acceleration[k], most);
      const double d = m.distance + most * m.velocity, r = m.radius + most * m.growth;
      const double above = manifold::lesser(m.distance - m.radius, d - r),
                   below = manifold::lesser(-m.distance - m.radius, -d - r);
      margin[j] = manifold::greater(margin[j], manifold::greater(above, below));
    }
  }
}

/// Returns how long real nodes i and j surely stay apart by the margin from now on, at most `most`; 0 where
/// they are nearer now.
template <int kNodes>
TANDEM_HD inline double time_apart(const PairFrames& frames, const FrameNodes<kNodes>& in_a,
                                   const FrameNodes<kNodes>& in_b, int i, int j, double most) {
  double start[12], slope[12];  // of the difference in (1), on each side of each axis
  for (int axis = 0; axis < 6; ++axis) {
    const int k = axis % 3;
    const AxisMotion m =
        axis < 3
            ? axis_motion(in_a.own, i, in_a.other, j, k, frames.slack, frames.of_a.acceleration[k], most)
            : axis_motion(in_b.other, i, in_b.own, j, k, frames.slack, frames.of_b.acceleration[k], most);
    start[2 * axis] = m.distance - (m.radius + frames.margin);
    slope[2 * axis] = m.velocity - m.growth;
    start[2 * axis + 1] = -m.distance - (m.radius + frames.margin);
    slope[2 * axis + 1] = -m.velocity - m.growth;
  }
  // The axes that hold now do so until they fall to 0, the last of them for the time ahead / fall; compared
  // by products, of which one may be taken that is shorter by rounding.
  double ahead = 0, fall = 1;
  bool lasts = false;
  for (int k = 0; k < 12; ++k) {
    const bool holds = start[k] > 0, falls = slope[k] < 0;
    lasts = lasts || (holds && !falls);
    if (holds && falls && start[k] * fall > ahead * -slope[k]) {
      ahead = start[k];
      fall = -slope[k];
    }
  }
  const double time = ahead / fall * (1 - 0x1p-50);
  // An axis that holds then and does not fall holds for the rest.
  for (int k = 0; k < 12; ++k) lasts = lasts || (!(slope[k] < 0) && start[k] + time * slope[k] > 0);
  return lasts || !(time < most) ? most : time;
}

/// Returns how long node i of a and node j of b, both real, surely stay apart from now on: `most` where that
/// is so for all of it.
TANDEM_HD inline double node_pair_time(const PairFrames& frames, const Block& a, int i, const Block& b, int j,
                                       double most) {
  FrameNodes<1> in_a, in_b;
  double margin[1] = {-INFINITY};
  own_nodes(frames.of_a, a, i, in_a.own);
  other_nodes(frames.of_a, b, j, in_a.other);
  raise_margins(frames.of_a, in_a.own, 0, in_a.other, frames.slack, most, margin);
  if (margin[0] > 0) return most;
  own_nodes(frames.of_b, b, j, in_b.own);
  other_nodes(frames.of_b, a, i, in_b.other);
  raise_margins(frames.of_b, in_b.other, 0, in_b.own, frames.slack, most, margin);
  return margin[0] > 0 ? most : time_apart(frames, in_a, in_b, 0, 0, most);
}

/// The real nodes of a block, a bit each; imaginary ones come last.
TANDEM_HD inline std::uint32_t real_nodes(const Block& block) {
  std::uint32_t mask = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if (block.half_extent[0][i] >= 0) mask |= 1u << i;
  }
  return mask;
}

/// Node pairs that may meet before some time, and for each of them how long it is surely apart.
struct NodeTimes {
  std::uint32_t hits;
  double apart[16];
};

/// Finds the node pairs that may meet before `most` among those in `mask`, which are apart until `known` from
/// now on.
TANDEM_HD inline void node_times(const PairFrames& frames, const Block& a, const Block& b, std::uint32_t mask,
                                 double known, double most, NodeTimes& out) {
  out.hits = 0;
  FrameNodes<kNodesPerBlock> in_a, in_b;
  double margin[kNodesPerBlock][kNodesPerBlock];
  // Most block pairs are told apart in the first frame.
  own_nodes(frames.of_a, a, 0, in_a.own);
  other_nodes(frames.of_a, b, 0, in_a.other);
  const std::uint32_t real_b = real_nodes(b);
  std::uint32_t open = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const std::uint32_t row = a.half_extent[0][i] >= 0 ? mask >> 4 * i & real_b : 0;
    if (row == 0) continue;
    for (int j = 0; j < kNodesPerBlock; ++j) margin[i][j] = -INFINITY;
    raise_margins(frames.of_a, in_a.own, i, in_a.other, frames.slack, most, margin[i]);
    for (int j = 0; j < kNodesPerBlock; ++j) {
      if ((row >> j & 1) != 0 && !(margin[i][j] > 0)) open |= 1u << (4 * i + j);
    }
  }
  if (open == 0) return;
  own_nodes(frames.of_b, b, 0, in_b.own);
  other_nodes(frames.of_b, a, 0, in_b.other);
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const std::uint32_t row = open >> 4 * i & 0xFu;
    if (row == 0) continue;
    raise_margins(frames.of_b, in_b.other, i, in_b.own, frames.slack, most, margin[i]);
    for (int j = 0; j < kNodesPerBlock; ++j) {
      if ((row >> j & 1) == 0 || margin[i][j] > 0) continue;
      const double apart = time_apart(frames, in_a, in_b, i, j, most);
      if (apart >= most) continue;
      out.hits |= 1u << (4 * i + j);
      out.apart[4 * i + j] = manifold::greater(apart, known);
    }
  }
}

}  // namespace tandem::impact
