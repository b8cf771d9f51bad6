#pragma once
#include <cstdint>

#include "kernels/geometry/triangle_test.h"
#include "tandem/kernels/detail/vector3.h"

namespace tandem::manifold {

/// A posed triangle.
struct WorldTriangle {
  Vector3 corner[3];
  Vector3 normal;  ///< unit, outward; 0 of a flat triangle

  /// Returns whether corners go round clockwise, as seen from outside.
  TANDEM_HD bool is_turned() const {
    return dot(normal, cross(corner[1] - corner[0], corner[2] - corner[0])) < 0;
  }
};

/// The part of a triangle that a point lies on: edge k joins corners k and k + 1.
struct TriangleFeature {
  std::uint8_t of_b;       ///< of triangle b, in the inside of a; else the other way round
  std::uint8_t is_corner;  ///< corner k, else edge k
  std::uint8_t number;     ///< k
};

enum class MeetingKind : std::uint8_t { none, point, segment, polygon };

/// The most corners that two triangles of one plane have in common.
inline constexpr int kMostCorners = 6;

/// The segment or polygon that two triangles have in common.
struct Meeting {
  MeetingKind kind = MeetingKind::none;
  bool degenerate = false;  ///< a corner lies in the other's plane, or so near that rounding might decide
  Vector3 end[2];           ///< of a segment, run along as normal_a x normal_b points; of a point, twice
  TriangleFeature feature[2] = {};

  /// How many of two moves of b, there and back by less than anything that there is, part the triangles. Each
  /// takes half of the segment's weight.
  std::uint8_t parted = 0;

  // These describe a polygon: the triangles lie in one plane.
  int corners = 0;
  Vector3 corner[kMostCorners];
  double area = 0;
  bool facing = false;  ///< normals are opposed: the surfaces touch. Else one lies on the other
};

namespace meeting {

/// The heights of a triangle's corners beside the other's plane.
struct Heights {
  double height[3];
  int sign[3];
  int near = 0;  ///< bit k: corner k lies so near to the plane that rounding may decide its sign, which is 0

  TANDEM_HD Heights(const WorldTriangle& triangle, const WorldTriangle& plane, double tolerance) {
    for (int k = 0; k < 3; ++k) {
      height[k] = dot(plane.normal, triangle.corner[k] - plane.corner[0]);
      sign[k] = height[k] > tolerance ? 1 : height[k] < -tolerance ? -1 : 0;
      near |= sign[k] == 0 ? 1 << k : 0;
    }
  }
  TANDEM_HD bool beside() const { return sign[0] != 0 && sign[0] == sign[1] && sign[0] == sign[2]; }
  TANDEM_HD bool in_plane() const { return sign[0] == 0 && sign[1] == 0 && sign[2] == 0; }
  TANDEM_HD bool any_in_plane() const { return sign[0] * sign[1] * sign[2] == 0; }
};

/// A point of a triangle's boundary.
struct BoundaryPoint {
  Vector3 x;
  TriangleFeature feature;
};

/// Returns where an edge goes through the plane. Condition: the signs of its ends differ.
TANDEM_HD inline BoundaryPoint crossing(const WorldTriangle& triangle, const Heights& heights, int k,
                                        bool of_b) {
  const int next = k == 2 ? 0 : k + 1;
  const Vector3& x = triangle.corner[k];
  const double part = heights.height[k] / (heights.height[k] - heights.height[next]);
  const auto side = static_cast<std::uint8_t>(of_b ? 1 : 0);
  return {x + part * (triangle.corner[next] - x), {side, 0, static_cast<std::uint8_t>(k)}};
}

/// The part of a triangle that lies in the other's plane, along the line that both planes have in common.
struct Stretch {
  double at[2];  // ascending
  BoundaryPoint point[2];
};

/// Condition: no corner lies in the plane, and they lie on both sides.
TANDEM_HD inline Stretch stretch(const WorldTriangle& triangle, const Heights& heights, const Vector3& line,
                                 const Vector3& origin, bool of_b) {
  Stretch out;
  int points = 0;
  for (int k = 0; k < 3; ++k) {
    if (heights.sign[k] == heights.sign[k == 2 ? 0 : k + 1]) continue;
    const BoundaryPoint point = crossing(triangle, heights, k, of_b);
    const double along = dot(line, point.x - origin);
    if (points++ == 0) {
      out.at[0] = along, out.point[0] = point;
    } else if (along < out.at[0]) {
      out.at[1] = out.at[0], out.point[1] = out.point[0];
      out.at[0] = along, out.point[0] = point;
    } else {
      out.at[1] = along, out.point[1] = point;
    }
  }
  return out;
}

/// Cuts a convex polygon by the half-plane left of p -> q.
TANDEM_HD inline int cut(const Vector2* polygon, int count, const Vector2& p, const Vector2& q,
                         Vector2* out) {
  const Vector2 along = q - p;
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const Vector2 &x = polygon[i], &y = polygon[i + 1 == count ? 0 : i + 1];
    const double at_x = cross(along, x - p), at_y = cross(along, y - p);
    if (at_x >= 0 && kept <= kMostCorners) out[kept++] = x;
    if (at_x * at_y < 0 && kept <= kMostCorners) out[kept++] = x + (at_x / (at_x - at_y)) * (y - x);
  }
  return kept;
}

/// Finds what two triangles in one plane have in common.
TANDEM_HD inline void meet_in_plane(const WorldTriangle& a, const WorldTriangle& b, double tolerance,
                                    Meeting& out) {
  out.degenerate = true;
  out.kind = MeetingKind::point;
  const Vector3 u = normalized(a.corner[1] - a.corner[0]), v = cross(a.normal, u);
  const auto flat = [&](const Vector3& x) {
    return Vector2{dot(u, x - a.corner[0]), dot(v, x - a.corner[0])};
  };
  Vector2 polygon[kMostCorners + 1] = {flat(b.corner[0]), flat(b.corner[1]), flat(b.corner[2])};
  Vector2 next[kMostCorners + 1];
  int count = 3;
  const bool turned = a.is_turned();
  for (int k = 0; k < 3 && count > 0; ++k) {
    const int from = turned ? (3 - k) % 3 : k, to = turned ? 2 - k : (k + 1) % 3;
    count = cut(polygon, count, flat(a.corner[from]), flat(a.corner[to]), next);
    for (int i = 0; i < count; ++i) polygon[i] = next[i];
  }
  double twice = 0;
  for (int i = 0; i < count; ++i) twice += cross(polygon[i], polygon[i + 1 == count ? 0 : i + 1]);
  out.area = std::fabs(twice) / 2;
  const double reach = norm(a.corner[1] - a.corner[0]) + norm(a.corner[2] - a.corner[0]);
  out.end[0] = out.end[1] = b.corner[0];
  if (count > 0) out.end[0] = out.end[1] = a.corner[0] + polygon[0].x * u + polygon[0].y * v;
  // An edge or a corner in common: no area, and the surfaces' other triangles tell more.
  if (count < 3 || out.area <= tolerance * reach) return;
  out.kind = MeetingKind::polygon;
  out.facing = dot(a.normal, b.normal) < 0;
  out.corners = count < kMostCorners ? count : kMostCorners;
  for (int i = 0; i < out.corners; ++i) out.corner[i] = a.corner[0] + polygon[i].x * u + polygon[i].y * v;
}

/// The corners of two triangles, as exact arithmetic takes them.
TANDEM_HD inline TrianglePair corners_of(const WorldTriangle& a, const WorldTriangle& b) {
  TrianglePair out;
  for (int k = 0; k < 3; ++k) {
    const Vector3 &x = a.corner[k], &y = b.corner[k];
    out.a[k][0] = x.x, out.a[k][1] = x.y, out.a[k][2] = x.z;
    out.b[k][0] = y.x, out.b[k][1] = y.y, out.b[k][2] = y.z;
  }
  return out;
}

/// Exact signs of what two triangles span.
class ExactVolumes {
 public:
  TANDEM_HD explicit ExactVolumes(const TrianglePair& t) : on_grid_(detail::on_coarse_grid(t)) {}

  /// volume() of a triangle and a point, rounded, with the exact sign. plane: of the triangle.
  TANDEM_HD double rounded(const detail::Plane<double>& plane, const double (*t)[3], const double* s) const {
    double bound;
    return on_grid_ ? plane.volume(s, bound) : detail::rounded_volume(t[0], t[1], t[2], s);
  }
  TANDEM_HD int sign(const double* p, const double* q, const double* r, const double* s) const {
    double bound;
    const double volume = detail::Plane<double>(p, q, r).volume(s, bound);
    const int sign = detail::certain_sign(volume, on_grid_ ? 0 : bound);
    if (sign != 0 || on_grid_) return sign;
    return detail::ExactSigns::volume_without_bound({p, q}, {p, r}, {p, s});
  }

  /// The sign of det(w, u, v) for an arbitrary w. On a coarse grid, float64 computes it without rounding: its
  /// whole numbers are below 2^17, so that products are below 2^(17 + 33) of the grid's unit.
  TANDEM_HD int sign_along_any(const detail::Between& u, const detail::Between& v) const {
    constexpr double kOrigin[3] = {0, 0, 0}, kAny[3] = {92431, 120577, 71263};
    double sum = 0, bound = 0;
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const double ui = u.to[i] - u.from[i], uj = u.to[j] - u.from[j], vi = v.to[i] - v.from[i],
                   vj = v.to[j] - v.from[j];
      sum += kAny[k] * (ui * vj - uj * vi);
      bound += kAny[k] * (std::fabs(ui * vj) + std::fabs(uj * vi));
    }
    const int sign = detail::certain_sign(sum, on_grid_ ? 0 : 0x1p-48 * bound + 0x1p-900);
    if (sign != 0 || on_grid_) return sign;
    return detail::ExactSigns::volume_without_bound({kOrigin, kAny}, u, v);
  }

 private:
  bool on_grid_;
};

/// Gives corners near the plane heights that are right even there, and all corners the signs that they have
/// where the plane's triangle is looked at as its corners go round.
TANDEM_HD inline void settle(Heights& heights, const double (*triangle)[3], const double (*plane)[3],
                             const WorldTriangle& of_plane, const ExactVolumes& volumes) {
  const Vector3 across =
      cross(of_plane.corner[1] - of_plane.corner[0], of_plane.corner[2] - of_plane.corner[0]);
  const double by_area = 1 / dot(of_plane.normal, across);
  const detail::Plane<double> minors(plane[0], plane[1], plane[2]);
  TANDEM_ROLLED
  for (int k = 0; k < 3; ++k) {
    if ((heights.near >> k & 1) != 0) {
      const double volume = volumes.rounded(minors, plane, triangle[k]);
      heights.height[k] = by_area * volume;
      heights.sign[k] = detail::computed_sign(volume);
    } else if (by_area < 0) {
      heights.sign[k] = -heights.sign[k];
    }
  }
}

/// A triangle that meets a plane: p is its lone corner, and q and r follow, or the other way round, as
/// detail::order_corners() has them.
struct OrderedCorners {
  int p, q, r;

  TANDEM_HD OrderedCorners(const int* side, bool reversed) : p(detail::lone_corner(side)) {
    q = (p + (reversed ? 2 : 1)) % 3, r = (p + (reversed ? 1 : 2)) % 3;
  }
};

TANDEM_HD inline bool is_below(const int* side) {
  return detail::lone_is_below(side, detail::lone_corner(side));
}

/// Two triangles of which b is moved in an arbitrary direction by less than anything that there is: forwards
/// where way is 1, and backwards where it is -1. Then no corner lies in the other's plane, and no edges meet
/// or are in one plane where these signs matter.
class MovedPair {
 public:
  TANDEM_HD MovedPair(const TrianglePair& t, const ExactVolumes& volumes, int way)
      : t_(t), volumes_(volumes), way_(way) {}

  TANDEM_HD bool meet(const int* side_of_a, const int* side_of_b) const {
    const auto turn_of = [&](const double(&x)[3][3]) { return sign_along({x[0], x[1]}, {x[0], x[2]}); };
    const int turn_of_a = turn_of(t_.a), turn_of_b = turn_of(t_.b);
    int of_a[3], of_b[3];
    for (int k = 0; k < 3; ++k) {
      of_a[k] = side_of_a[k] != 0 ? side_of_a[k] : -turn_of_b;
      of_b[k] = side_of_b[k] != 0 ? side_of_b[k] : turn_of_a;
    }
    if (detail::strictly_on_one_side(of_a) || detail::strictly_on_one_side(of_b)) return false;
    const OrderedCorners a(of_a, is_below(of_b)), b(of_b, is_below(of_a));
    return order(a.p, b.p, a.q, b.q) > 0 && order(a.p, b.p, a.r, b.r) < 0;
  }

 private:
  TANDEM_HD int sign_along(const detail::Between& u, const detail::Between& v) const {
    return way_ * volumes_.sign_along_any(u, v);
  }
  /// The sign of volume(pa, pb, qa, qb). Its derivative by the way is det(way, qa - pa, qb - pb).
  TANDEM_HD int order(int pa, int pb, int qa, int qb) const {
    const int sign = volumes_.sign(t_.a[pa], t_.b[pb], t_.a[qa], t_.b[qb]);
    return sign != 0 ? sign : sign_along({t_.a[pa], t_.a[qa]}, {t_.b[pb], t_.b[qb]});
  }

  const TrianglePair& t_;
  const ExactVolumes& volumes_;
  int way_;
};

/// Returns the point in the other's plane on the edge from corner p to another one.
TANDEM_HD inline BoundaryPoint point_in_plane(const WorldTriangle& triangle, const Heights& heights, int p,
                                              int to, bool of_b) {
  const auto side = static_cast<std::uint8_t>(of_b ? 1 : 0);
  const int corner = heights.sign[p] == 0 ? p : to;
  if (heights.sign[corner] == 0)
    return {triangle.corner[corner], {side, 1, static_cast<std::uint8_t>(corner)}};
  return crossing(triangle, heights, (p + 1) % 3 == to ? p : to, of_b);
}

/// Finds what triangles have in common of which a corner lies near the other's plane. Signs are exact, so the
/// two triangles of an edge agree whether it goes through a third one, and curves close.
TANDEM_OUT_OF_LINE TANDEM_HD inline void meet_exactly(const WorldTriangle& a, const WorldTriangle& b,
                                                      double tolerance, Heights& of_a, Heights& of_b,
                                                      Meeting& out) {
  const TrianglePair t = corners_of(a, b);
  const ExactVolumes volumes(t);
  settle(of_a, t.a, t.b, b, volumes);
  settle(of_b, t.b, t.a, a, volumes);
  if (of_a.beside() || of_b.beside()) return;
  out.degenerate = true;
  if (of_a.in_plane() || of_b.in_plane()) return meet_in_plane(a, b, tolerance, out);
  const bool a_below = is_below(of_a.sign), b_below = is_below(of_b.sign);
  const OrderedCorners in_a(of_a.sign, b_below), in_b(of_b.sign, a_below);
  // Along D, see the proof of order_corners(), the triangles reach from i (on pq of a) to j (on pr), and from
  // l (on pr of b) to k (on pq). In the same way as there, volume(pa, pb, qa, rb) >= 0 if and only if i <= l.
  const auto order = [&](int to_a, int to_b) {
    return volumes.sign(t.a[in_a.p], t.b[in_b.p], t.a[to_a], t.b[to_b]);
  };
  if (order(in_a.q, in_b.q) < 0 || order(in_a.r, in_b.r) > 0) return;
  const bool begins_in_b = order(in_a.q, in_b.r) >= 0, ends_in_a = order(in_a.r, in_b.q) >= 0;
  const BoundaryPoint begin = begins_in_b ? point_in_plane(b, of_b, in_b.p, in_b.r, true)
                                          : point_in_plane(a, of_a, in_a.p, in_a.q, false);
  const BoundaryPoint end = ends_in_a ? point_in_plane(a, of_a, in_a.p, in_a.r, false)
                                      : point_in_plane(b, of_b, in_b.p, in_b.q, true);
  // D is normal_b x normal_a, if both are turned towards the other's p.
  const int first = (a_below != b_below) == (a.is_turned() != b.is_turned()) ? 1 : 0;
  out.end[first] = begin.x, out.end[1 - first] = end.x;
  out.feature[first] = begin.feature, out.feature[1 - first] = end.feature;
  out.kind = norm(end.x - begin.x) <= tolerance ? MeetingKind::point : MeetingKind::segment;
  if (out.kind == MeetingKind::point || !(of_a.any_in_plane() || of_b.any_in_plane())) return;
  const auto parts = [&](int way) { return !MovedPair(t, volumes, way).meet(of_a.sign, of_b.sign); };
  out.parted = static_cast<std::uint8_t>(parts(-1) + parts(1));
}

}  // namespace meeting

/// Fills `out`. tolerance: signs of points no further from a plane are found exactly.
TANDEM_HD inline void meet(const WorldTriangle& a, const WorldTriangle& b, double tolerance, Meeting& out) {
  using meeting::Heights, meeting::Stretch;
  out.kind = MeetingKind::none;
  out.degenerate = out.facing = false;
  out.corners = 0;
  out.feature[0] = out.feature[1] = {};
  out.parted = 0;
  const auto is_flat = [](const Vector3& n) { return n.x == 0 && n.y == 0 && n.z == 0; };
  if (is_flat(a.normal) || is_flat(b.normal)) return;  // neighbours have its sides
  Heights of_a(a, b, tolerance), of_b(b, a, tolerance);
  if (of_a.beside() || of_b.beside()) return;
  if ((of_a.near | of_b.near) != 0) return meeting::meet_exactly(a, b, tolerance, of_a, of_b, out);
  Vector3 line = cross(a.normal, b.normal);
  const double sine = norm(line);
  if (sine == 0) return;
  line = (1 / sine) * line;
  const Stretch in_a = meeting::stretch(a, of_a, line, a.corner[0], false);
  const Stretch in_b = meeting::stretch(b, of_b, line, a.corner[0], true);
  const bool begins_in_a = in_a.at[0] >= in_b.at[0], ends_in_a = in_a.at[1] <= in_b.at[1];
  const double begin = begins_in_a ? in_a.at[0] : in_b.at[0], end = ends_in_a ? in_a.at[1] : in_b.at[1];
  if (!(end >= begin - tolerance)) return;
  out.kind = end <= begin + tolerance ? MeetingKind::point : MeetingKind::segment;
  const meeting::BoundaryPoint &first = begins_in_a ? in_a.point[0] : in_b.point[0],
                               &last = ends_in_a ? in_a.point[1] : in_b.point[1];
  out.end[0] = first.x, out.end[1] = last.x;
  out.feature[0] = first.feature, out.feature[1] = last.feature;
}

}  // namespace tandem::manifold
