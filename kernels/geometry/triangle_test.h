#pragma once
#include <cstdint>
#include <cstring>

#include "kernels/geometry/orientation.h"

/// This test decides whether two triangles meet, on CPU and GPU. Triangles are closed: touching counts. A
/// flat triangle is the hull of its corners, a segment or a point. The corners are float64 points, and the
/// answer is that of exact arithmetic on them, for all finite points; host code must be compiled with
/// -ffp-contract=off.
///
/// A cascade: decide_float64 decides what its error bound allows, decide_exact the rest. In a query the
/// float32 stage of frame_test.h comes before them and leaves them little.
namespace tandem {

/// The corners of two triangles.
struct TrianglePair {
  double a[3][3], b[3][3];
};

enum class Verdict : std::uint8_t { apart, contact, undecided };

/// The outcome of the cascade, and whether it took the last stage.
struct Decision {
  Verdict verdict;
  bool exactly;
};

namespace detail {

/// The corners of a triangle in an order of choice.
struct Corners {
  const double* p;
  const double* q;
  const double* r;
};

TANDEM_HD inline bool strictly_on_one_side(const int* side) {
  return side[0] != 0 && side[0] == side[1] && side[0] == side[2];
}

TANDEM_HD inline bool all_zero(const int* side) {
  return side[0] == 0 && side[1] == 0 && side[2] == 0;
}

/// The corner whose two edges each meet the plane in exactly one point, which between them span the part of
/// the triangle that lies in the plane: it is on one side and the others are not, or it alone is in the plane
/// and the others are on one side. One such corner exists unless all sides are zero or strictly the same.
TANDEM_HD inline int lone_corner(const int* side) {
  for (int i = 0; i < 2; ++i) {
    const int p = side[i], q = side[(i + 1) % 3], r = side[(i + 2) % 3];
    if (p != 0 ? p * q <= 0 && p * r <= 0 : q * r > 0) return i;
  }
  return 2;
}

/// The corners with the lone one first, as they go round, or the other way round if that is asked.
TANDEM_HD inline Corners lone_first(const double (*t)[3], int lone, bool reversed) {
  const double* next = t[(lone + 1) % 3];
  const double* last = t[(lone + 2) % 3];
  return {t[lone], reversed ? last : next, reversed ? next : last};
}

/// Returns whether the lone corner, or, if it is in the plane, the far side of the others, is on the negative
/// side.
TANDEM_HD inline bool lone_is_below(const int* side, int lone) {
  return side[lone] != 0 ? side[lone] < 0 : side[(lone + 1) % 3] > 0;
}

/// Brings two triangles that each meet the other's plane, neither flat nor coplanar, into the order in which
///
///   they meet  <=>  volume(pa, pb, qa, qb) >= 0  and  volume(pa, pb, ra, rb) <= 0.
///
/// Proof (after Guigue and Devillers 2003, with all ties). Order the corners so that each p is lone, q and r
/// are on the negative side of the other's plane or in it, and p is on the positive side or in it; an edge pq
/// or pr never lies in the plane. Let Na and Nb be the normals by the order of corners, L the line of both
/// planes, with direction D = Nb x Na. a meets L in the interval between i (on pa qa) and j (on pa ra), b
/// between k (on pb qb) and l (on pb rb). Fa, the part of Nb within a's plane, is normal to L and points to
/// pa's side; pa -> qa -> ra turns about Na, so from i to j is Fa x Na ~ Nb x Na = D. For b all is the same
/// with a and b exchanged, so from k to l is -D. The intervals [i, j] and [l, k] along D meet iff i <= k and
/// l <= j. Now k - i = tD, and qa - pa = xD - yFa, qb - pb = x'D - y'Fb with y, y' > 0, as neither edge lies
/// in the other's plane. pb - pa is k - i plus multiples of these two, so volume(pa, pb, qa, qb) = det(tD,
/// -yFa, -y'Fb) = t y y' det(D, Fa, Fb), and Fa x Fb is a positive multiple of Nb x Na = D (for unit normals,
/// Fa x Fb = (1 - (Na.Nb)^2) Nb x Na). So its sign is that of t: i <= k iff it is >= 0. In the same way l - j
/// has the sign of volume(pa, pb, ra, rb).
TANDEM_HD inline void order_corners(const double (*a)[3], const double (*b)[3], const int* side_of_a,
                                    const int* side_of_b, Corners& oa, Corners& ob) {
  const int lone_a = lone_corner(side_of_a), lone_b = lone_corner(side_of_b);
  oa = lone_first(a, lone_a, lone_is_below(side_of_b, lone_b));
  ob = lone_first(b, lone_b, lone_is_below(side_of_a, lone_a));
}

/// Least and greatest of numbers that are not NaN. (std::fmin is a call where NaN matters.)
TANDEM_HD inline double least(double x, double y, double z) {
  const double smaller = y < x ? y : x;
  return z < smaller ? z : smaller;
}

TANDEM_HD inline double greatest(double x, double y, double z) {
  const double larger = x < y ? y : x;
  return larger < z ? z : larger;
}

/// Returns whether the bounding boxes are apart; comparisons only, so exact.
TANDEM_HD inline bool boxes_apart(const double (*a)[3], const double (*b)[3]) {
  bool apart = false;
  for (int k = 0; k < 3; ++k) {
    apart = apart || greatest(a[0][k], a[1][k], a[2][k]) < least(b[0][k], b[1][k], b[2][k]) ||
            greatest(b[0][k], b[1][k], b[2][k]) < least(a[0][k], a[1][k], a[2][k]);
  }
  return apart;
}

/// The stage with an error bound. Only certain signs count, so neither triangle can be flat, nor both in one
/// plane, where this goes on to the line that both planes share.
template <class Real>
TANDEM_HD inline Verdict decide_bounded(const TrianglePair& t) {
  int side_of_b[3], side_of_a[3];
  const Plane<Real> plane_a(t.a[0], t.a[1], t.a[2]);
  for (int i = 0; i < 3; ++i) side_of_b[i] = plane_a.side(t.b[i]);
  if (strictly_on_one_side(side_of_b)) return Verdict::apart;
  const Plane<Real> plane_b(t.b[0], t.b[1], t.b[2]);
  for (int i = 0; i < 3; ++i) side_of_a[i] = plane_b.side(t.a[i]);
  if (strictly_on_one_side(side_of_a)) return Verdict::apart;

  bool certain = true;
  for (int i = 0; i < 3; ++i) certain = certain && side_of_a[i] != 0 && side_of_b[i] != 0;
  if (!certain) return Verdict::undecided;
  Corners a, b;
  order_corners(t.a, t.b, side_of_a, side_of_b, a, b);
  const int lower = Plane<Real>(a.p, b.p, a.q).side(b.q);
  if (lower < 0) return Verdict::apart;
  const int upper = Plane<Real>(a.p, b.p, a.r).side(b.r);
  if (upper > 0) return Verdict::apart;
  return lower != 0 && upper != 0 ? Verdict::contact : Verdict::undecided;
}

TANDEM_HD inline bool lexicographically_less(const double* p, const double* q) {
  for (int k = 0; k < 3; ++k) {
    if (p[k] != q[k]) return p[k] < q[k];
  }
  return false;
}

/// A flat triangle's end points p <= q: along a line, lexicographic order is the order of the points.
struct Extent {
  const double* p;
  const double* q;
};

TANDEM_HD inline Extent extent(const double (*t)[3]) {
  Extent out = {t[0], t[0]};
  for (int i = 1; i < 3; ++i) {
    if (lexicographically_less(t[i], out.p)) out.p = t[i];
    if (lexicographically_less(out.q, t[i])) out.q = t[i];
  }
  return out;
}

/// The complete test, degenerate cases included, given a source of signs.
template <class Signs>
struct CompleteTest {
  /// Returns whether a segment meets a triangle that is not flat, given that its ends are not both in the
  /// triangle's plane and not strictly on one side: it meets the plane in one point x, and volume(p, q, c, d)
  /// is the orientation of (x, c, d) within the plane times a nonzero factor that all edges share.
  TANDEM_HD static bool crosses(const Extent& s, const double (*t)[3]) {
    int least = 0, greatest = 0;
    for (int i = 0; i < 3; ++i) {
      const int turn = Signs::volume(s.p, s.q, t[i], t[(i + 1) % 3]);
      if (turn < least) least = turn;
      if (turn > greatest) greatest = turn;
    }
    return least * greatest == 0;
  }

  /// Returns whether an edge of x separates the triangles strictly, seen along axis k; orientation_x is x's
  /// own, 0 if x is flat, when both sides of an edge are outside.
  TANDEM_HD static bool edge_separates(const double (*x)[3], const double (*y)[3], int k, int orientation_x) {
    for (int i = 0; i < 3; ++i) {
      const double* p = x[i];
      const double* q = x[(i + 1) % 3];
      const int side = Signs::area(p, q, y[0], k);
      if (side != 0 && side != orientation_x && Signs::area(p, q, y[1], k) == side &&
          Signs::area(p, q, y[2], k) == side) {
        return true;
      }
    }
    return false;
  }

  /// Returns whether a, flat or not, meets b, which is not flat and lies in the same plane, along axis k, in
  /// which b is not flat either: then the projection is one to one. The points of b less the points of a are
  /// a polygon with an interior, each side of it parallel to an edge of a or b; the origin is outside iff it
  /// is strictly beyond a side, that is, iff an edge of a or b separates the two.
  TANDEM_HD static bool meet_in_plane(const double (*a)[3], const double (*b)[3], int k, int orientation_b) {
    const int orientation_a = Signs::area(a[0], a[1], a[2], k);
    return !edge_separates(b, a, k, orientation_b) && !edge_separates(a, b, k, orientation_a);
  }

  /// Returns whether two segments or points meet whose bounding boxes do. Four points that span a volume are
  /// on two skew lines. In one plane but not on one line, some triple has an area along some axis, and seen
  /// along it segments meet iff each has the ends of the other on both sides or on it. On one line, a gap
  /// between them would part the boxes along every axis along which the line moves.
  TANDEM_HD static bool segments_meet(const Extent& s, const Extent& t) {
    if (Signs::volume(s.p, s.q, t.p, t.q) != 0) return false;
    for (int k = 0; k < 3; ++k) {
      const int tp = Signs::area(s.p, s.q, t.p, k), tq = Signs::area(s.p, s.q, t.q, k);
      const int sp = Signs::area(t.p, t.q, s.p, k), sq = Signs::area(t.p, t.q, s.q, k);
      if (tp != 0 || tq != 0 || sp != 0 || sq != 0) return tp * tq <= 0 && sp * sq <= 0;
    }
    return true;
  }

  /// An axis along which the triangle is not flat, and its orientation along it; 3 if it is flat.
  TANDEM_HD static int projection_axis(const double (*t)[3], int& orientation) {
    for (int k = 0; k < 3; ++k) {
      orientation = Signs::area(t[0], t[1], t[2], k);
      if (orientation != 0) return k;
    }
    return 3;
  }

  TANDEM_HD static void sides(const double (*plane)[3], const double (*t)[3], int* side) {
    for (int i = 0; i < 3; ++i) side[i] = Signs::volume(plane[0], plane[1], plane[2], t[i]);
  }

  /// Given that a's corners have no volume with b: b is flat, or all six corners are in its plane.
  TANDEM_HD static bool meet_flat_or_in_plane(const double (*a)[3], const double (*b)[3]) {
    int orientation;
    const int axis_b = projection_axis(b, orientation);
    if (axis_b < 3) return meet_in_plane(a, b, axis_b, orientation);
    int side_of_b[3];
    sides(a, b, side_of_b);
    if (strictly_on_one_side(side_of_b)) return false;
    if (!all_zero(side_of_b)) return crosses(extent(b), a);
    const int axis_a = projection_axis(a, orientation);
    if (axis_a < 3) return meet_in_plane(b, a, axis_a, orientation);
    return segments_meet(extent(a), extent(b));
  }

  TANDEM_HD static bool meet(const double (*a)[3], const double (*b)[3]) {
    if (boxes_apart(a, b)) return false;
    int side_of_a[3], side_of_b[3];
    sides(b, a, side_of_a);
    if (strictly_on_one_side(side_of_a)) return false;
    if (all_zero(side_of_a)) return meet_flat_or_in_plane(a, b);
    sides(a, b, side_of_b);
    if (strictly_on_one_side(side_of_b)) return false;
    if (all_zero(side_of_b)) return crosses(extent(a), b);  // in one plane all of a would be: a is flat
    Corners oa, ob;
    order_corners(a, b, side_of_a, side_of_b, oa, ob);
    return Signs::volume(oa.p, ob.p, oa.q, ob.q) >= 0 && Signs::volume(oa.p, ob.p, oa.r, ob.r) <= 0;
  }
};

/// The largest power of two that is not above x. Condition: x is positive and normal.
TANDEM_HD inline double power_of_two_below(double x) {
  std::uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  bits &= 0x7FF0000000000000u;
  memcpy(&x, &bits, sizeof x);
  return x;
}

/// Returns whether all corners lie on a grid so coarse that float64 computes every volume and area of them
/// without rounding: coordinates are multiples of G / 2, G a power of two, and differ by less than 2^15 G. A
/// difference is then exact, a product of two is below 2^32 (G / 2)^2, one of three below 2^48 (G / 2)^3, and
/// a sum of six of these a multiple of (G / 2)^3 below 2^51 of it. x is a multiple of G / 2 where adding 1.5
/// * 2^52 G and taking it away changes nothing: from 2^52 G on every float64 number is one; below, the sum is
/// above 2^51 G, where again every float64 number is one, and x differs from the sum by another.
TANDEM_HD inline bool on_coarse_grid(const TrianglePair& t) {
  double extent = 0;
  for (int k = 0; k < 3; ++k) {
    const double lower_a = least(t.a[0][k], t.a[1][k], t.a[2][k]),
                 lower_b = least(t.b[0][k], t.b[1][k], t.b[2][k]);
    const double upper_a = greatest(t.a[0][k], t.a[1][k], t.a[2][k]),
                 upper_b = greatest(t.b[0][k], t.b[1][k], t.b[2][k]);
    extent = greatest(extent, upper_a - lower_b, upper_b - lower_a);
    extent = greatest(extent, upper_a - lower_a, upper_b - lower_b);
  }
  if (!(extent >= 0x1p-300 && extent <= 0x1p300)) return false;  // G^3 and its multiples are normal numbers
  const double shift = 1.5 * 0x1p52 * 0x1p-14 * power_of_two_below(extent);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      if (minus(plus(t.a[i][k], shift), shift) != t.a[i][k]) return false;
      if (minus(plus(t.b[i][k], shift), shift) != t.b[i][k]) return false;
    }
  }
  return true;
}

/// Returns whether a corner of a and one of b are the same point: then the triangles meet, flat or not.
TANDEM_HD inline bool share_corner(const TrianglePair& t) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (t.a[i][0] == t.b[j][0] && t.a[i][1] == t.b[j][1] && t.a[i][2] == t.b[j][2]) return true;
    }
  }
  return false;
}

}  // namespace detail

/// The first of these stages: float64 with an error bound. Without any error where corners lie on a coarse
/// grid, as in a stack of boxes; and corners in common, as of two copies of a mesh in one place, are
/// contacts. Right whenever it decides.
TANDEM_HD inline Verdict decide_float64(const TrianglePair& t) {
  if (detail::share_corner(t)) return Verdict::contact;
  if (detail::boxes_apart(t.a, t.b)) return Verdict::apart;
  if (!detail::on_coarse_grid(t)) return detail::decide_bounded<double>(t);
  return detail::CompleteTest<detail::ComputedSigns<double>>::meet(t.a, t.b) ? Verdict::contact
                                                                             : Verdict::apart;
}

/// The last stage: always right, never undecided.
TANDEM_HD inline Verdict decide_exact(const TrianglePair& t) {
  return detail::CompleteTest<detail::ExactSigns>::meet(t.a, t.b) ? Verdict::contact : Verdict::apart;
}

/// float32 throughout, signs taken as they come out, ties included: may err where rounding does, and may
/// differ between CPU and GPU there.
TANDEM_HD inline Verdict decide_fast(const TrianglePair& t) {
  return detail::CompleteTest<detail::ComputedSigns<float>>::meet(t.a, t.b) ? Verdict::contact
                                                                            : Verdict::apart;
}

/// Always right: float64, and what that leaves exactly.
inline Decision decide(const TrianglePair& t) {
  const Verdict verdict = decide_float64(t);
  if (verdict != Verdict::undecided) return {verdict, false};
  return {decide_exact(t), true};
}

}  // namespace tandem
