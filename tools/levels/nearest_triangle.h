#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kernels/geometry/nearest_features.h"
#include "tandem/formats/file.h"
#include "tandem/formats/view.h"

/// Distances of a point from triangles in float64.
///
/// Coordinates of levels are float32: differences of corners, and of points of triangles, are 0 or have
/// magnitudes of 2^-251 to 2^129 (points are rounded to float64), so that products of four of them neither
/// overflow nor vanish where they matter.
namespace tandem::levels {

using Point = distance::Point<double>;
using distance::cross;
using distance::dot;
using distance::minus;
using distance::plus;
using distance::scaled;

/// Corner k as float64, which is exact.
inline Point corner_of(const Triangle& triangle, int k) {
  const float(&p)[3] = triangle.corner[k].position;
  return {{p[0], p[1], p[2]}};
}

inline double square_distance(const Point& p, const Point& q) {
  const Point apart = minus(p, q);
  return dot(apart, apart);
}

/// p + t (q - p), each operation rounded.
inline Point between(const Point& p, const Point& q, double t) {
  return plus(p, scaled(t, minus(q, p)));
}

/// The square of p's distance from the segment from s in direction `along`, and where it is.
inline double nearest_on_edge(const Point& p, const Point& s, const Point& along, Point& nearest) {
  const double length = dot(along, along);
  const double t = length > 0 ? std::clamp(dot(minus(p, s), along) / length, 0.0, 1.0) : 0.0;
  nearest = plus(s, scaled(t, along));
  return square_distance(p, nearest);
}

/// The square of p's distance from the triangle as computed: of a point of the triangle that is the nearest
/// one up to rounding. Where the square of the sine at corner 0 is below 2^-30 the edges are asked as well.
///
/// The nearest point of a triangle to a point of its plane that is outside lies on an edge that the point is
/// beyond: it is p less a sum of positive multiples of the outward normals of the edges that it is on; were p
/// beyond neither of two, with c the cosine of their normals, the multiples x, y had x + c y <= 0 and y + c x
/// <= 0, so x <= c^2 x and x = y = 0.
inline double square_distance(const Point& p, const Triangle& triangle, Point& nearest) {
  const Point a = corner_of(triangle, 0), b = corner_of(triangle, 1), c = corner_of(triangle, 2);
  const Point u = minus(b, a), v = minus(c, a), r = minus(p, a);
  const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), ru = dot(r, u), rv = dot(r, v);
  const double area = uu * vv - uv * uv;
  const bool flat = !(area > 0x1p-30 * (uu * vv));
  double s = vv * ru - uv * rv, t = uu * rv - uv * ru;
  double least = INFINITY;
  if (s >= 0 && t >= 0 && s + t <= area && area > 0) {
    s = std::min(s / area, 1.0);
    t = std::min(t / area, 1 - s);
    nearest = plus(a, plus(scaled(s, u), scaled(t, v)));
    least = square_distance(p, nearest);
    if (!flat) return least;
  }
  const auto offer = [&](const Point& from, const Point& along) {
    Point at;
    const double square = nearest_on_edge(p, from, along, at);
    if (!(square < least)) return;
    least = square;
    nearest = at;
  };
  if (flat || t < 0) offer(a, u);
  if (flat || s < 0) offer(a, v);
  if (flat || s + t > area) offer(b, minus(c, b));
  return least;
}

inline double square_distance(const Point& p, const Triangle& triangle) {
  Point nearest;
  return square_distance(p, triangle, nearest);
}

struct NearestTriangle {
  double square;  ///< of the distance, as computed
  std::uint32_t triangle;
  bool certain = true;      ///< there is no nearer one, or this one is near enough
  std::uint32_t looks = 0;  ///< blocks that were looked into
};

/// Says when a search for the nearest triangle may end early.
struct NearEnough {
  double square = 0;  ///< with any triangle whose square distance is at most this
  /// After so many blocks, with the nearest of the triangles seen so far. Ordinary surfaces take some 20
  /// blocks; all boxes of a fan hold the points near its middle.
  std::uint32_t most_looks = 1024;
};

/// The triangle of the level that is nearest to p, up to rounding. The search begins with the triangle
/// `hint`.
NearestTriangle nearest_triangle(const LevelView& level, const Point& p, std::uint32_t hint,
                                 const NearEnough& enough = {});

/// A number that p's distance from the level's surface is surely not below; near it where nothing is amiss
/// with float64. `hint`: a triangle that is near.
double proved_distance(const LevelView& level, const Point& p, std::uint32_t hint);

}  // namespace tandem::levels
