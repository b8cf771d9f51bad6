#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "exact_predicates.h"
#include "meshing.h"

namespace tandem::build {
namespace {

using Corners = std::span<const std::uint32_t>;

/// Newell's normal, up to a positive factor. The factor, a power of two, keeps the products away from
/// underflow.
Point newell_normal(std::span<const Point> p) {
  double size = 0;
  for (const Point& q : p)
    for (int k = 0; k < 3; ++k) size = std::max(size, std::abs(q[k] - p[0][k]));
  const double scale = size > 0 ? std::scalbn(1.0, -std::max(std::ilogb(size), -1000)) : 1.0;
  const auto at = [&](std::size_t i, int k) { return (p[i][k] - p[0][k]) * scale; };
  Point normal{};
  for (std::size_t i = 0; i < p.size(); ++i) {
    const std::size_t j = i + 1 < p.size() ? i + 1 : 0;
    for (int k = 0; k < 3; ++k) {
      const int u = (k + 1) % 3;
      const int v = (k + 2) % 3;
      normal[k] += at(i, u) * at(j, v) - at(j, u) * at(i, v);
    }
  }
  return normal;
}

/// The axes worth projecting along, best first, then -1. An outline seen nearly edge-on (beyond about 75
/// degrees) says nothing.
std::array<int, 3> projection_axes(std::span<const Point> corners) {
  const Point normal = newell_normal(corners);
  const auto length = [&](int k) { return std::abs(normal[k]); };
  std::array<int, 3> axes{0, 1, 2};
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return length(a) > length(b); });
  const double least = length(axes[0]) / 4;
  for (int& axis : axes)
    if (length(axis) < least) axis = -1;
  return axes;
}

double squared_distance(const Point& a, const Point& b) {
  const double x = a[0] - b[0];
  const double y = a[1] - b[1];
  const double z = a[2] - b[2];
  return x * x + y * y + z * z;
}

/// Returns how well two triangles fit side by side: 2 both face the same way, 1 one of them is flat, 0 they
/// overlap or are flat.
int fit(int first, int second) {
  if (first == 0 && second == 0) return 0;
  return first * second + 1;
}

/// Returns whether to cut a quad from corner 0 to 2 (true) or from 1 to 3 (false); nothing when both
/// diagonals leave it. In a simple quad at least one diagonal lies inside, and the pieces on its two sides
/// then have the same orientation.
std::optional<bool> inner_diagonal(std::span<const Point> p, int axis) {
  std::array<Point2, 4> q;
  for (int i = 0; i < 4; ++i) q[i] = {p[i][(axis + 1) % 3], p[i][(axis + 2) % 3]};
  const int fit_02 = fit(orientation(q[0], q[1], q[2]), orientation(q[0], q[2], q[3]));
  const int fit_13 = fit(orientation(q[0], q[1], q[3]), orientation(q[1], q[2], q[3]));
  if (fit_02 == 0 && fit_13 == 0) return std::nullopt;
  if (fit_02 != fit_13) return fit_02 > fit_13;
  return squared_distance(p[0], p[2]) <= squared_distance(p[1], p[3]);
}

class Triangulator {
 public:
  Triangulator(const PolygonMesh& mesh, TriangleMesh& out, CleanReport& report, const SplitPolygon& split)
      : mesh_(mesh), out_(out), report_(report), split_polygon_(split) {}

  void add(std::uint32_t face) {
    const Corners corners =
        Corners(mesh_.corners)
            .subspan(mesh_.face_begin[face], mesh_.face_begin[face + 1] - mesh_.face_begin[face]);
    if (!is_usable(mesh_.points, corners, report_)) return;
    if (corners.size() == 3) return emit(face, {corners[0], corners[1], corners[2]});
    report_.faces_repeated_corner += repeats_a_corner(corners);
    gather(face, corners);
    if (points_.size() < 3) return emit(face, {corners[0], corners[0], corners[0]});
    split();
    for (const TriangleIndices& t : pieces_) emit(face, {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]});
  }

 private:
  /// Returns whether two vertices lie at the same place, in all poses too.
  bool same_place(std::uint32_t a, std::uint32_t b) const {
    return mesh_.points[a] == mesh_.points[b] &&
           std::all_of(mesh_.poses.begin(), mesh_.poses.end(),
                       [&](const std::vector<Point>& pose) { return pose[a] == pose[b]; });
  }

  bool repeats_a_corner(Corners corners) const {
    const auto same = [this](std::uint32_t a, std::uint32_t b) { return same_place(a, b); };
    return same(corners.front(), corners.back()) ||
           std::adjacent_find(corners.begin(), corners.end(), same) != corners.end();
  }

  void emit(std::uint32_t face, const TriangleIndices& triangle) {
    out_.triangles.push_back(triangle);
    out_.face.push_back(face);
  }

  /// The face's corners without those at the place of their predecessor, and without spikes, where the
  /// outline goes to a place and straight back: a spike has no area and becomes a degenerate triangle, so
  /// that it is counted. A face all in one place keeps one corner.
  void gather(std::uint32_t face, Corners corners) {
    points_.clear();
    vertices_.clear();
    for (const std::uint32_t corner : corners) add_corner(face, corner);
    std::size_t first = 0;
    while (points_.size() - first > 2) {
      if (same_place(vertices_.back(), vertices_[first])) {
        drop_corner();
      } else if (same_place(vertices_.end()[-2], vertices_[first])) {
        emit(face, {vertices_.end()[-2], vertices_.back(), vertices_[first]});
        drop_corner();
      } else if (same_place(vertices_.back(), vertices_[first + 1])) {
        emit(face, {vertices_.back(), vertices_[first], vertices_[first + 1]});
        ++first;
      } else {
        break;
      }
    }
    if (points_.size() - first == 2 && same_place(vertices_.back(), vertices_[first])) drop_corner();
    points_.erase(points_.begin(), points_.begin() + static_cast<std::ptrdiff_t>(first));
    vertices_.erase(vertices_.begin(), vertices_.begin() + static_cast<std::ptrdiff_t>(first));
  }

  void add_corner(std::uint32_t face, std::uint32_t corner) {
    if (!points_.empty() && same_place(vertices_.back(), corner)) return;
    if (points_.size() > 1 && same_place(vertices_.end()[-2], corner)) {
      emit(face, {vertices_.end()[-2], vertices_.back(), corner});
      return drop_corner();
    }
    points_.push_back(mesh_.points[corner]);
    vertices_.push_back(corner);
  }

  void drop_corner() {
    points_.pop_back();
    vertices_.pop_back();
  }

  void split() {
    pieces_.clear();
    if (points_.size() == 3) {
      pieces_.push_back({0, 1, 2});
      return;
    }
    if (on_a_line()) return fan();
    for (const int axis : projection_axes(points_))
      if (axis >= 0 && (points_.size() == 4 ? split_quad(axis) : split_polygon_(points_, axis, pieces_)))
        return;
    fan();
    ++report_.faces_not_simple;
  }

  bool split_quad(int axis) {
    const std::optional<bool> diagonal = inner_diagonal(points_, axis);
    if (!diagonal) return false;
    const std::uint32_t apex = *diagonal ? 0 : 3;
    pieces_.push_back({apex, *diagonal ? 1u : 0u, *diagonal ? 2u : 1u});
    pieces_.push_back({apex, *diagonal ? 2u : 1u, *diagonal ? 3u : 2u});
    return true;
  }

  /// The triangles of a face on one line are degenerate and counted as such.
  void fan() {
    for (std::uint32_t i = 2; i < points_.size(); ++i) pieces_.push_back({0, i - 1, i});
  }

  bool on_a_line() const {
    return std::all_of(points_.begin() + 2, points_.end(),
                       [&](const Point& p) { return collinear(points_[0], points_[1], p); });
  }

  const PolygonMesh& mesh_;
  TriangleMesh& out_;
  CleanReport& report_;
  const SplitPolygon& split_polygon_;
  std::vector<Point> points_;            ///< corners of the face at hand
  std::vector<std::uint32_t> vertices_;  ///< their indices
  std::vector<TriangleIndices> pieces_;  ///< of the face at hand, by corner
};

/// Each face of n corners makes at most n - 2 triangles, but for outlines that touch themselves.
std::size_t expected_triangles(const PolygonMesh& mesh) {
  return mesh.corners.size() - std::min(mesh.corners.size(), 2 * mesh.face_count());
}

}  // namespace

std::optional<std::size_t> first_face_beyond_quads(const PolygonMesh& mesh) {
  for (std::size_t face = 0; face < mesh.face_count(); ++face)
    if (mesh.face_begin[face + 1] - mesh.face_begin[face] > 4) return face;
  return std::nullopt;
}

TriangleMesh triangulate(PolygonMesh& mesh, CleanReport& report, const SplitPolygon& split) {
  report.faces = mesh.face_count();
  report.vertices = mesh.points.size();
  report.vertices_unreferenced = count_unreferenced(mesh.points.size(), mesh.corners);
  TriangleMesh out;
  out.triangles.reserve(expected_triangles(mesh));
  out.face.reserve(expected_triangles(mesh));
  Triangulator triangulator(mesh, out, report, split);
  for (std::uint32_t face = 0; face < mesh.face_count(); ++face) triangulator.add(face);
  out.points = std::move(mesh.points);
  out.poses = std::move(mesh.poses);
  mesh.poses = {};
  mesh.points = {};
  mesh.corners = {};
  mesh.face_begin = {0};
  return out;
}

}  // namespace tandem::build
