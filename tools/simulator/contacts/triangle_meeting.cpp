#include "triangle_meeting.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace tandem::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Where the corners of a triangle lie beside the other's plane.
struct Heights {
  double height[3];
  int sign[3];
  int zeros = 0, positive = 0;

  Heights(const WorldTriangle& triangle, const WorldTriangle& plane, double tolerance) {
    for (int k = 0; k < 3; ++k) {
      height[k] = plane.normal.dot(triangle.corner[k] - plane.corner[0]);
      sign[k] = height[k] > tolerance ? 1 : height[k] < -tolerance ? -1 : 0;
      zeros += sign[k] == 0;
      positive += sign[k] > 0;
    }
  }
  bool beside() const { return zeros == 0 && (positive == 0 || positive == 3); }
};

// The part of a triangle that lies in the other's plane, along the line that both planes have in common.
struct Stretch {
  double at[2];  // ascending
  Vector3d point[2];
  TriangleFeature feature[2];
  int points = 0;

  void add(const Vector3d& x, double along, const TriangleFeature& f) {
    int i = points++;
    if (i == 1 && along < at[0]) {
      at[1] = at[0], point[1] = point[0], feature[1] = feature[0];
      i = 0;
    }
    at[i] = along, point[i] = x, feature[i] = f;
  }
};

double crossing_at(const Heights& heights, int first, int second) {
  return heights.height[first] / (heights.height[first] - heights.height[second]);
}

Stretch stretch(const WorldTriangle& triangle, const Heights& heights, const Vector3d& line,
                const Vector3d& origin, bool of_b) {
  Stretch out;
  for (std::uint8_t k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (heights.sign[k] == 0) {
      const Vector3d& x = triangle.corner[k];
      out.add(x, line.dot(x - origin), {of_b, true, k});
    } else if (heights.sign[k] * heights.sign[next] < 0) {
      const Vector3d x =
          triangle.corner[k] + crossing_at(heights, k, next) * (triangle.corner[next] - triangle.corner[k]);
      out.add(x, line.dot(x - origin), {of_b, false, k});
    }
  }
  if (out.points == 1) out.at[1] = out.at[0], out.point[1] = out.point[0], out.feature[1] = out.feature[0];
  return out;
}

// Edges of `own` that go through the other triangle, whose part of the line is `other`.
void add_piercings(const Heights& heights, const Stretch& own, const Stretch& other, double tolerance,
                   Meeting& meeting) {
  for (int i = 0; i < own.points; ++i) {
    const TriangleFeature& f = own.feature[i];
    if (f.is_corner || own.at[i] < other.at[0] - tolerance || own.at[i] > other.at[1] + tolerance) continue;
    meeting.piercing[meeting.piercings++] = {
        f.of_b, f.number, crossing_at(heights, f.number, (f.number + 1) % 3), heights.sign[f.number] < 0};
  }
}

// Cuts a convex polygon by the half-plane left of p -> q.
int cut(const std::array<Vector2d, 7>& polygon, int count, const Vector2d& p, const Vector2d& q,
        std::array<Vector2d, 7>& out) {
  const Vector2d along = q - p;
  const auto side = [&](const Vector2d& x) { return along.x() * (x - p).y() - along.y() * (x - p).x(); };
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const Vector2d &x = polygon[i], &y = polygon[(i + 1) % count];
    const double at_x = side(x), at_y = side(y);
    if (at_x >= 0 && kept < 7) out[kept++] = x;
    if (at_x * at_y < 0 && kept < 7) out[kept++] = x + at_x / (at_x - at_y) * (y - x);
  }
  return kept;
}

// What two triangles in one plane have in common.
void meet_in_plane(const WorldTriangle& a, const WorldTriangle& b, double tolerance, Meeting& meeting) {
  meeting.degenerate = true;
  meeting.kind = Meeting::Kind::point;
  const Vector3d u = (a.corner[1] - a.corner[0]).normalized(), v = a.normal.cross(u);
  const auto flat = [&](const Vector3d& x) {
    return Vector2d(u.dot(x - a.corner[0]), v.dot(x - a.corner[0]));
  };
  std::array<Vector2d, 7> polygon = {flat(b.corner[0]), flat(b.corner[1]), flat(b.corner[2])}, next;
  int count = 3;
  const bool turned = a.normal.dot((a.corner[1] - a.corner[0]).cross(a.corner[2] - a.corner[0])) < 0;
  for (int k = 0; k < 3 && count > 0; ++k) {
    const int from = turned ? (3 - k) % 3 : k, to = turned ? 2 - k : (k + 1) % 3;
    count = cut(polygon, count, flat(a.corner[from]), flat(a.corner[to]), next);
    polygon = next;
  }
  double twice = 0;
  for (int i = 0; i < count; ++i) {
    const Vector2d &x = polygon[i], &y = polygon[(i + 1) % count];
    twice += x.x() * y.y() - x.y() * y.x();
  }
  meeting.area = std::fabs(twice) / 2;
  const double reach = (a.corner[1] - a.corner[0]).norm() + (a.corner[2] - a.corner[0]).norm();
  meeting.end[0] = meeting.end[1] = b.corner[0];
  if (count > 0) meeting.end[0] = meeting.end[1] = a.corner[0] + polygon[0].x() * u + polygon[0].y() * v;
  if (count < 3 || meeting.area <= tolerance * reach) {
    // An edge or a corner in common: no area, and the surfaces' other triangles tell more.
    return;
  }
  meeting.kind = Meeting::Kind::polygon;
  meeting.facing = a.normal.dot(b.normal) < 0;
  meeting.corners = static_cast<std::uint8_t>(std::min(count, 6));
  for (int i = 0; i < meeting.corners; ++i) {
    meeting.corner[i] = a.corner[0] + polygon[i].x() * u + polygon[i].y() * v;
  }
}

}  // namespace

void meet(const WorldTriangle& a, const WorldTriangle& b, double tolerance, Meeting& meeting) {
  meeting.kind = Meeting::Kind::none;
  meeting.degenerate = meeting.facing = false;
  meeting.corners = meeting.piercings = 0;
  meeting.feature[0] = meeting.feature[1] = {};
  meeting.weight = 1;
  if (a.normal.isZero(0) || b.normal.isZero(0)) return;  // flat: neighbours have its sides
  const Heights of_a(a, b, tolerance), of_b(b, a, tolerance);
  if (of_a.beside() || of_b.beside()) return;
  if (of_a.zeros == 3 || of_b.zeros == 3) return meet_in_plane(a, b, tolerance, meeting);
  Vector3d line = a.normal.cross(b.normal);
  const double sine = line.norm();
  if (sine == 0) return;
  line /= sine;
  meeting.degenerate = of_a.zeros + of_b.zeros > 0;
  const Stretch in_a = stretch(a, of_a, line, a.corner[0], false);
  const Stretch in_b = stretch(b, of_b, line, a.corner[0], true);
  const bool begins_in_a = in_a.at[0] >= in_b.at[0], ends_in_a = in_a.at[1] <= in_b.at[1];
  const double begin = begins_in_a ? in_a.at[0] : in_b.at[0], end = ends_in_a ? in_a.at[1] : in_b.at[1];
  if (end < begin - tolerance) return;
  meeting.kind = end <= begin + tolerance ? Meeting::Kind::point : Meeting::Kind::segment;
  meeting.end[0] = begins_in_a ? in_a.point[0] : in_b.point[0];
  meeting.end[1] = ends_in_a ? in_a.point[1] : in_b.point[1];
  meeting.feature[0] = begins_in_a ? in_a.feature[0] : in_b.feature[0];
  meeting.feature[1] = ends_in_a ? in_a.feature[1] : in_b.feature[1];
  meeting.weight = (of_a.zeros == 2 ? 0.5 : 1) * (of_b.zeros == 2 ? 0.5 : 1);
  add_piercings(of_a, in_a, in_b, tolerance, meeting);
  add_piercings(of_b, in_b, in_a, tolerance, meeting);
}

}  // namespace tandem::simulation
