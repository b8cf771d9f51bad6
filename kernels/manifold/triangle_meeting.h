#pragma once
#include <cstdint>

#include "tandem/kernels/detail/vector3.h"

namespace tandem::manifold {

/// A posed triangle.
struct WorldTriangle {
  Vector3 corner[3];
  Vector3 normal;  ///< unit, outward; 0 of a flat triangle
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
  bool degenerate = false;  ///< a corner lies in the other's plane
  Vector3 end[2];           ///< of a segment, run along as normal_a x normal_b points; of a point, twice
  TriangleFeature feature[2] = {};

  /// Says whether the segment is an edge of a, and of b. Then it counts half, and half again: neighbours that
  /// share the edge, or a body that only touches there, have the rest.
  bool along_edge[2] = {};

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
  int zeros = 0, positive = 0;

  TANDEM_HD Heights(const WorldTriangle& triangle, const WorldTriangle& plane, double tolerance) {
    for (int k = 0; k < 3; ++k) {
      height[k] = dot(plane.normal, triangle.corner[k] - plane.corner[0]);
      sign[k] = height[k] > tolerance ? 1 : height[k] < -tolerance ? -1 : 0;
      zeros += sign[k] == 0;
      positive += sign[k] > 0;
    }
  }
  TANDEM_HD bool beside() const { return zeros == 0 && (positive == 0 || positive == 3); }
};

/// The part of a triangle that lies in the other's plane, along the line that both planes have in common.
struct Stretch {
  double at[2];  // ascending
  Vector3 point[2];
  TriangleFeature feature[2];
  int points = 0;

  TANDEM_HD void add(const Vector3& x, double along, const TriangleFeature& f) {
    if (points == 2) return;
    if (points == 1 && along < at[0]) {
      at[1] = at[0], point[1] = point[0], feature[1] = feature[0];
      at[0] = along, point[0] = x, feature[0] = f;
    } else if (points == 1) {
      at[1] = along, point[1] = x, feature[1] = f;
    } else {
      at[0] = at[1] = along, point[0] = point[1] = x, feature[0] = feature[1] = f;
    }
    ++points;
  }
};

TANDEM_HD inline Stretch stretch(const WorldTriangle& triangle, const Heights& heights, const Vector3& line,
                                 const Vector3& origin, bool of_b) {
  Stretch out;
  const std::uint8_t side = of_b ? 1 : 0;
  for (int k = 0; k < 3; ++k) {
    const int next = k == 2 ? 0 : k + 1;
    const Vector3& x = triangle.corner[k];
    const auto number = static_cast<std::uint8_t>(k);
    if (heights.sign[k] == 0) {
      out.add(x, dot(line, x - origin), {side, 1, number});
    } else if (heights.sign[k] * heights.sign[next] < 0) {
      const double part = heights.height[k] / (heights.height[k] - heights.height[next]);
      const Vector3 y = x + part * (triangle.corner[next] - x);
      out.add(y, dot(line, y - origin), {side, 0, number});
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
  const bool turned = dot(a.normal, cross(a.corner[1] - a.corner[0], a.corner[2] - a.corner[0])) < 0;
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

}  // namespace meeting

/// Fills `out`. tolerance: lengths by which points may lie beside a plane and count as in it.
TANDEM_HD inline void meet(const WorldTriangle& a, const WorldTriangle& b, double tolerance, Meeting& out) {
  using meeting::Heights, meeting::Stretch;
  out.kind = MeetingKind::none;
  out.degenerate = out.facing = false;
  out.corners = 0;
  out.feature[0] = out.feature[1] = {};
  out.along_edge[0] = out.along_edge[1] = false;
  const auto is_flat = [](const Vector3& n) { return n.x == 0 && n.y == 0 && n.z == 0; };
  if (is_flat(a.normal) || is_flat(b.normal)) return;  // neighbours have its sides
  const Heights of_a(a, b, tolerance), of_b(b, a, tolerance);
  if (of_a.beside() || of_b.beside()) return;
  if (of_a.zeros == 3 || of_b.zeros == 3) return meeting::meet_in_plane(a, b, tolerance, out);
  Vector3 line = cross(a.normal, b.normal);
  const double sine = norm(line);
  if (sine == 0) return;
  line = (1 / sine) * line;
  out.degenerate = of_a.zeros + of_b.zeros > 0;
  const Stretch in_a = meeting::stretch(a, of_a, line, a.corner[0], false);
  const Stretch in_b = meeting::stretch(b, of_b, line, a.corner[0], true);
  const bool begins_in_a = in_a.at[0] >= in_b.at[0], ends_in_a = in_a.at[1] <= in_b.at[1];
  const double begin = begins_in_a ? in_a.at[0] : in_b.at[0], end = ends_in_a ? in_a.at[1] : in_b.at[1];
  if (!(end >= begin - tolerance)) return;
  out.kind = end <= begin + tolerance ? MeetingKind::point : MeetingKind::segment;
  out.end[0] = begins_in_a ? in_a.point[0] : in_b.point[0];
  out.end[1] = ends_in_a ? in_a.point[1] : in_b.point[1];
  out.feature[0] = begins_in_a ? in_a.feature[0] : in_b.feature[0];
  out.feature[1] = ends_in_a ? in_a.feature[1] : in_b.feature[1];
  out.along_edge[0] = of_a.zeros == 2, out.along_edge[1] = of_b.zeros == 2;
}

}  // namespace tandem::manifold
