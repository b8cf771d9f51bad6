#pragma once
#include <cmath>
#include <cstdint>
#include <cstring>

#include "kernels/geometry/frame_test.h"
#include "tandem/formats/box.h"
#include "tandem/formats/view.h"

/// The first stage of the triangle test where everything ties, as in a stack of boxes: two instances on a
/// grid so coarse that float32 computes in the first one's frame without rounding. Ties are then as certain
/// as other signs, and only triangles that are flat stay undecided.
///
/// **Proof.** Let G be a power of two that all stored corners of both meshes and both translations are
/// multiples of, and let every entry of both rotations be 0, 1 or -1. So rotations permute the axes and turn
/// some round. Let M_k bound the magnitude of coordinate k of all corners in a's frame, those of b as posed
/// there, and D_k be the larger of 2 M_k / G and 1. Conditions: 6 D_0 D_1 D_2 <= 2^24, translations are at
/// most 2^52 G, and 2^-40 <= G <= 2^30.
///
/// In units of G all of these are integers, and M_k < 2^21. Corners plus translations are below 2^53, so
/// apply() rounds nothing, nor does the difference of translations; and relative_pose() computes sums of
/// which one term is not zero: its rotation is exact, and so is its translation, at most M_k, in float32. The
/// images of b's corners in a's frame are then exact, and the map into a's frame is a rotation, which keeps
/// the sign of every volume.
///
/// Differences of corners along axis k are at most D_k. A product of two of them, along different axes, is at
/// most D_i D_j, a minor, or area, 2 D_i D_j <= 2^24, and a volume, with all sums on the way to it, 6 D_0 D_1
/// D_2 <= 2^24. Integers up to 2^24 are float32 numbers, so nothing is rounded. Their units, G, G^2 and G^3,
/// are normal numbers, and 2^24 G^3 is finite.
namespace tandem {

namespace grid_detail {

inline constexpr double kFinest = 0x1p-40, kCoarsest = 0x1p30;

/// The largest power of two that x is a multiple of; infinite for 0.
TANDEM_HD inline double unit_of(double x) {
  if (x == 0) return INFINITY;
  std::uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  if ((bits & 0xFFFFFFFFFFFFFu) == 0) return std::fabs(x);
  bits &= bits - 1;  // without its last binary digit
  double rest;
  memcpy(&rest, &bits, sizeof rest);
  return std::fabs(x - rest);
}

/// Returns the smaller of two numbers that are not NaN. (std::fmin and std::fmax are calls where NaN
/// matters.)
TANDEM_HD inline double smaller(double x, double y) {
  return y < x ? y : x;
}

TANDEM_HD inline double larger(double x, double y) {
  return x < y ? y : x;
}

/// Returns whether the conditions on G and M hold. What roundings add or take, also those of a reach, is less
/// than from one integer to the next.
TANDEM_HD inline bool coarse(double grid, const double (&largest)[3]) {
  if (!(grid >= kFinest && grid <= kCoarsest)) return false;
  double product = 6;
  for (int k = 0; k < 3; ++k) product *= larger(2 * largest[k] / grid, 1);
  return product <= 0x1p24;
}

/// Returns whether all entries are 0, 1 or -1.
TANDEM_HD inline bool permutes_axes(const double (&rotation)[3][3]) {
  for (const auto& row : rotation) {
    for (const double x : row) {
      if (x != 0 && std::fabs(x) != 1) return false;
    }
  }
  return true;
}

}  // namespace grid_detail

/// The largest power of two, up to 2^30, that all coordinates of a mesh are multiples of; 0 where it is too
/// fine for this stage, which the first few corners mostly tell.
inline double grid_of(const LevelView& tree, const TreeExtent& extent) {
  double grid = grid_detail::kCoarsest;
  for (std::uint32_t i = 0; i < tree.triangle_count; ++i) {
    for (const auto& corner : tree.triangles[i].corner) {
      for (const float x : corner.position) {
        const double unit = grid_detail::unit_of(static_cast<double>(x));
        if (unit >= grid) continue;
        grid = unit;
        if (!grid_detail::coarse(grid, extent.reach)) return 0;
      }
    }
  }
  return grid_detail::coarse(grid, extent.reach) ? grid : 0;
}

/// Returns whether the proof's conditions hold for two instances. Their poses are rigid and of stored
/// coordinates; grid_a, grid_b: grid_of() their meshes.
TANDEM_HD inline bool lie_on_grid(const Pose& a, const TreeExtent& tree_a, double grid_a, const Pose& b,
                                  const TreeExtent& tree_b, double grid_b, const RelativePose& b_in_a) {
  namespace g = grid_detail;
  double grid = g::smaller(grid_a, grid_b), farthest = 0;
  if (grid < g::kFinest) return false;
  for (int k = 0; k < 3; ++k) {
    const double t_a = a.translation[k], t_b = b.translation[k];
    grid = g::smaller(grid, g::smaller(g::unit_of(t_a), g::unit_of(t_b)));
    if (grid < g::kFinest) return false;
    farthest = g::larger(farthest, g::larger(std::fabs(t_a), std::fabs(t_b)));
  }
  if (!(farthest <= 0x1p52 * grid && g::coarse(grid, tree_a.reach))) return false;
  if (!g::permutes_axes(a.rotation) || !g::permutes_axes(b.rotation)) return false;
  double largest[3];
  for (int k = 0; k < 3; ++k) {
    double of_b = std::fabs(static_cast<double>(b_in_a.translation[k]));
    for (int j = 0; j < 3; ++j)
      of_b += std::fabs(static_cast<double>(b_in_a.rotation[k][j])) * tree_b.reach[j];
    largest[k] = g::larger(tree_a.reach[k], of_b);
  }
  return g::coarse(grid, largest);
}

namespace frame {

template <typename Value>
TANDEM_HD inline auto is_nonzero(const Value& x) {
  const Value zero{};
  return less(x, zero) | less(zero, x);
}

template <typename Value>
TANDEM_HD inline auto is_nonzero(const Value (&x)[3]) {
  return is_nonzero(x[0]) | is_nonzero(x[1]) | is_nonzero(x[2]);
}

/// A triangle seen along the first axis along which it is not flat, counterclockwise. Condition: it is not
/// flat. Triangles in one plane are all seen along the same axis.
template <typename Value>
struct PlanarTriangle {
  Value x[3], y[3];

  TANDEM_HD PlanarTriangle(const Point<Value> (&t)[3], const Value (&normal)[3]) {
    const auto first = is_nonzero(normal[0]), second = is_nonzero(normal[1]);
    const auto pick = [&](const Value& along_0, const Value& along_1, const Value& along_2) {
      return select(first, along_0, select(second, along_1, along_2));
    };
    const auto clockwise = less(pick(normal[0], normal[1], normal[2]), Value{});
    const Point<Value> q = select_point(clockwise, t[2], t[1]), r = select_point(clockwise, t[1], t[2]);
    const Point<Value>* const corner[3] = {&t[0], &q, &r};
    for (int i = 0; i < 3; ++i) {
      const Value(&p)[3] = corner[i]->x;
      x[i] = pick(p[1], p[2], p[0]);
      y[i] = pick(p[2], p[0], p[1]);
    }
  }
};

/// Returns whether an edge of s has all of t strictly outside.
template <typename Value>
TANDEM_HD inline auto edge_separates(const PlanarTriangle<Value>& s, const PlanarTriangle<Value>& t) {
  const auto beyond_edge = [&](int i) {
    const int j = (i + 1) % 3;
    const Value ux = s.x[j] - s.x[i], uy = s.y[j] - s.y[i];
    const auto area = [&](int corner) { return ux * (t.y[corner] - s.y[i]) - uy * (t.x[corner] - s.x[i]); };
    return less(larger(larger(area(0), area(1)), area(2)), Value{});
  };
  return beyond_edge(0) | beyond_edge(1) | beyond_edge(2);
}

/// decide() where the proof at the top of this file holds; what stays undecided has a flat triangle. The
/// method is that of detail::CompleteTest in triangle_test.h. The normal of a flat triangle is 0, so that all
/// sides of it are ties; with two triangles that are not flat all are ties only where both lie in one plane.
template <typename Value>
TANDEM_HD inline auto decide_on_grid(const Point<Value> (&a)[3], const Point<Value> (&b)[3]) {
  using PlaneOf = Plane<Value, false>;
  const PlaneOf plane_a(a[0], a[1], a[2], 0), plane_b(b[0], b[1], b[2], 0);
  const auto sides_of_b = sides_of(plane_a, b), sides_of_a = sides_of(plane_b, a);
  const auto possible = !(sides_of_b.strictly_one() | sides_of_a.strictly_one());
  const auto crossing = possible & !(sides_of_b.all_ties() | sides_of_a.all_ties());
  const auto in_plane = possible & !crossing & is_nonzero(plane_a.normal) & is_nonzero(plane_b.normal);

  const auto along = intervals<false>(a, b, sides_of_a.without_ties(), sides_of_b.without_ties(), 0);
  const Value zero{};
  Verdicts<decltype(less(zero, zero))> verdicts;
  verdicts.contact = crossing & !(less(along.lower.value, zero) | less(zero, along.upper.value));
  if (any(in_plane)) {
    const PlanarTriangle<Value> seen_a(a, plane_a.normal), seen_b(b, plane_b.normal);
    verdicts.contact =
        verdicts.contact | (in_plane & !(edge_separates(seen_a, seen_b) | edge_separates(seen_b, seen_a)));
  }
  verdicts.undecided = possible & !(crossing | in_plane);
  return verdicts;
}

}  // namespace frame
}  // namespace tandem
