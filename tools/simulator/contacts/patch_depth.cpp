#include "patch_depth.h"

#include <algorithm>
#include <cmath>

#include "convex_hull.h"

namespace tandem::simulation {
namespace {

using Eigen::Vector2d;

// Triangles that the normal grazes at less than this sine are walls, which have no height.
constexpr double kWall = 0.01;

// The rectangle around a triangle, `more` larger on all sides.
struct Rectangle {
  Vector2d lower, upper;

  Rectangle(const Vector2d& p, const Vector2d& q, const Vector2d& r, double more)
      : lower(p.cwiseMin(q).cwiseMin(r).array() - more), upper(p.cwiseMax(q).cwiseMax(r).array() + more) {}
  bool contains(const Vector2d& x) const {
    return x.x() >= lower.x() && x.x() <= upper.x() && x.y() >= lower.y() && x.y() <= upper.y();
  }
};

// Moves `x` to the nearest point of a counter-clockwise triangle, and says how far.
double nearest_point(const Vector2d* corner, Vector2d& x) {
  const Vector2d from = x;
  double least = INFINITY;
  bool outside = false;
  for (int k = 0; k < 3; ++k) {
    const Vector2d side = corner[(k + 1) % 3] - corner[k], to = from - corner[k];
    if (side.x() * to.y() - side.y() * to.x() >= 0) continue;
    outside = true;
    const Vector2d at =
        corner[k] + std::clamp(side.dot(to) / std::max(side.squaredNorm(), 1e-300), 0.0, 1.0) * side;
    const double distance = (at - from).norm();
    if (distance < least) least = distance, x = at;
  }
  return outside ? least : 0;
}

// Takes over a height at this distance from the line if it is nearer than what is known, or as near and
// further out: of a the highest counts, of b the lowest.
void take(int side, double height, double beside, Sounding& s) {
  double& known = s.surface[side];
  const bool further = side == 0 ? height > known : height < known;
  if (beside > s.beside[side] || (beside == s.beside[side] && !further)) return;
  known = height;
  s.beside[side] = beside;
}

}  // namespace

void PatchDepth::sound_cut_triangle(int side, const WorldTriangle& triangle) {
  const double cosine = triangle.normal.dot(frame_.n);
  if (side == 0 ? cosine < kWall : cosine > -kWall) return;  // faces the other way
  Vector2d corner[3];
  for (int k = 0; k < 3; ++k) corner[k] = frame_.flat(triangle.corner[k]);
  if (twice_area(corner[0], corner[1], corner[2]) < 0) std::swap(corner[1], corner[2]);
  const Vector2d slope = -Vector2d(frame_.u.dot(triangle.normal), frame_.v.dot(triangle.normal)) / cosine;
  const double level = triangle.normal.dot(triangle.corner[0] - frame_.origin) / cosine;
  double reach = 0;
  for (const Sounding& s : soundings) reach = std::max(reach, s.beside[side]);
  const Rectangle around(corner[0], corner[1], corner[2], reach);
  for (Sounding& s : soundings) {
    if (!around.contains(s.line)) continue;
    Vector2d at = s.line;
    const double beside = nearest_point(corner, at);
    take(side, level + slope.dot(at), beside, s);
  }
}

void PatchDepth::sound_enclosed(const PatchRegion& region, int side) {
  const auto vertices = region.side[side]->enclosed();
  flat_.resize(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!region.in_group(vertices[i].curve)) continue;
    flat_[i] = {frame_.flat(vertices[i].position), frame_.height(vertices[i].position)};
  }
  for (const BodySide::EnclosedTriangle& t : region.side[side]->enclosed_triangles()) {
    if (!region.in_group(t.curve)) continue;
    const FlatVertex &p = flat_[t.corner[0]], &q = flat_[t.corner[1]], &r = flat_[t.corner[2]];
    const double area = twice_area(p.x, q.x, r.x);
    if (area == 0 || (area > 0) == ((side == 1) != t.turned)) continue;  // faces the other way
    const Rectangle around(p.x, q.x, r.x, 0);
    for (Sounding& s : soundings) {
      if (!around.contains(s.line)) continue;
      const double of_p = twice_area(q.x, r.x, s.line) / area, of_q = twice_area(r.x, p.x, s.line) / area,
                   of_r = 1 - of_p - of_q;
      if (of_p < -1e-12 || of_q < -1e-12 || of_r < -1e-12) continue;
      take(side, of_p * p.height + of_q * q.height + of_r * r.height, 0, s);
    }
  }
}

void PatchDepth::sound(const PatchRegion& region) {
  const auto accept = [&](std::uint32_t curve) { return region.in_group(curve); };
  region.for_each_cut_triangle(
      accept, [&](int side, const WorldTriangle& triangle) { sound_cut_triangle(side, triangle); });
  for (const int side : {0, 1}) sound_enclosed(region, side);
}

}  // namespace tandem::simulation
