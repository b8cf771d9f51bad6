#pragma once
#include "kernels/impact/pair_motion.h"

/// How long parts of two bodies stay apart because one turns within the other, or beside it on one axis: a
/// ball in a socket, a shaft in a bearing. Boxes tell that for short times alone, triangle by triangle.
///
/// **Proof.** A body's turn changes neither a point's distance from the body's centre, nor that from the axis
/// through it, nor its place along the axis. A body that does not turn has any centre and any axis, so it
/// takes the other's. Two bodies that turn have one axis where theirs are parallel, else none. That is so
/// where their product rounds to 0: then they are so but for 2^-50, or one turns by less than 2^-500 and may
/// have any axis too. None of the three lengths differs for two points by more than the points are apart, nor
/// where it is measured from centres that are so far apart. So points stay apart where one of the lengths
/// differs by more than the offset of the centres, or for the distance from the axis its part across the
/// axis, is at any time. Along the axis both are measured from a's centre at the start, so there only the
/// displacement counts. Offsets are longest at the beginning or the end. Slack is for what is computed here
/// too: no more than 100 roundings from numbers of that size, of which the time has no part, so it holds for
/// any turn.
namespace tandem::impact {

/// Least and largest of the three lengths: from the centre, from the axis, along the axis.
struct Shell {
  double low[3], high[3];
};

inline constexpr Shell kNoShell = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

TANDEM_HD inline Shell joined(const Shell& x, const Shell& y) {
  Shell out;
  for (int k = 0; k < 3; ++k) {
    out.low[k] = manifold::lesser(x.low[k], y.low[k]);
    out.high[k] = manifold::greater(x.high[k], y.high[k]);
  }
  return out;
}

/// What the shells of a pair are measured from.
struct ShellAxes {
  Vector3 centre_a, centre_b;    ///< at the start, in the world
  Vector3 axis;                  ///< of length 1; 0: none
  Vector3 offset, displacement;  ///< between these centres
};

/// Condition: one of the bodies turns.
TANDEM_HD inline ShellAxes shell_axes(const PairMotion& pair) {
  const MovingBody &a = *pair.a, &b = *pair.b;
  ShellAxes out = {a.centre, b.centre, {0, 0, 0}, pair.offset, pair.displacement};
  if (!(a.angle > 0)) out.centre_a = b.centre;
  if (!(b.angle > 0)) out.centre_b = a.centre;
  if (!(a.angle > 0 && b.angle > 0)) out.offset = {0, 0, 0};
  const Vector3 across = manifold::cross(a.turn, b.turn);
  const bool parallel = across.x == 0 && across.y == 0 && across.z == 0;
  const Vector3& turn = a.angle > b.angle ? a.turn : b.turn;
  if (parallel && norm(turn) >= 0x1p-400) out.axis = (1 / norm(turn)) * turn;
  return out;
}

/// A lower bound, but for rounding, of a triangle's distance from the origin: along its normal, and along the
/// nearest points of its edges.
TANDEM_HD inline double least_length(const Vector3 (&x)[3]) {
  double least = 0;
  const auto try_along = [&](const Vector3& n) {
    const double length = norm(n);
    if (!(length >= 0x1p-400)) return;
    const double along = manifold::lesser(manifold::lesser(dot(n, x[0]), dot(n, x[1])), dot(n, x[2]));
    least = manifold::greater(least, along / length);
  };
  const Vector3 normal = manifold::cross(x[1] - x[0], x[2] - x[0]);
  try_along(normal);
  try_along(-normal);
  for (int i = 0; i < 3; ++i) {
    const Vector3 edge = x[(i + 1) % 3] - x[i];
    const double square = dot(edge, edge);
    const double part = square > 0 ? -dot(edge, x[i]) / square : 0;
    try_along(x[i] + manifold::lesser(manifold::greater(part, 0.0), 1.0) * edge);
  }
  return least;
}

/// The shell of a triangle. x: its corners, from the centre; from_a: added to places along the axis.
TANDEM_HD inline Shell shell_of(const Vector3& axis, const Vector3 (&x)[3], double from_a) {
  Shell out = kNoShell;
  Vector3 across[3];
  for (int c = 0; c < 3; ++c) {
    const double along = dot(axis, x[c]);
    across[c] = x[c] - along * axis;
    out.high[0] = manifold::greater(out.high[0], norm(x[c]));
    out.high[1] = manifold::greater(out.high[1], norm(across[c]));
    out.low[2] = manifold::lesser(out.low[2], along + from_a);
    out.high[2] = manifold::greater(out.high[2], along + from_a);
  }
  out.low[0] = least_length(x);
  out.low[1] = least_length(across);
  return out;
}

/// How far apart shells must be for what is in them to stay more than the tolerance apart until `end`, a part
/// of the step. Advancing such triangles would not stop them either, so answers are those of a GPU, which has
/// no shells.
struct ShellGaps {
  double least[3];
};

TANDEM_HD inline ShellGaps shell_gaps(const PairMotion& pair, const ShellAxes& axes, double end,
                                      double tolerance) {
  const Vector3 later = axes.offset + end * axes.displacement;
  const auto across = [&](const Vector3& x) { return norm(x - dot(axes.axis, x) * axes.axis); };
  const double spare = pair.slack + tolerance;
  const bool has_axis = norm(axes.axis) > 0;
  return {{manifold::greater(norm(axes.offset), norm(later)) + spare,
           has_axis ? manifold::greater(across(axes.offset), across(later)) + spare : INFINITY,
           has_axis ? std::fabs(end * dot(axes.axis, axes.displacement)) + spare : INFINITY}};
}

TANDEM_HD inline bool stay_apart(const Shell& a, const Shell& b, const ShellGaps& gaps) {
  bool apart = false;
  for (int k = 0; k < 3; ++k)
    apart = apart || b.low[k] - a.high[k] > gaps.least[k] || a.low[k] - b.high[k] > gaps.least[k];
  return apart;
}

}  // namespace tandem::impact
