#include "collapses.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Edge_collapse_visitor_base.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

namespace tandem::build {
namespace {

namespace simplification = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Quadrics = simplification::GarlandHeckbert_plane_policies<Mesh, Kernel>;

// Takes stored coordinates to a box of edge 1 to 2 around zero and back. Only the centre can round.
class Frame {
 public:
  explicit Frame(std::span<const std::array<float, 3>> points) {
    for (const auto& point : points) {
      for (std::size_t k = 0; k < 3; ++k) {
        lower_[k] = std::min(lower_[k], point[k]);
        upper_[k] = std::max(upper_[k], point[k]);
      }
    }
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      centre_[k] = static_cast<float>((double{lower_[k]} + upper_[k]) / 2);
      longest = std::max(longest, double{upper_[k]} - lower_[k]);
    }
    if (longest > 0) exponent_ = std::ilogb(longest);
  }

  Point into(const std::array<float, 3>& point) const {
    const auto along = [&](std::size_t k) { return std::ldexp(point[k] - centre_[k], -exponent_); };
    return {along(0), along(1), along(2)};
  }

  // The nearest point of the bounds.
  std::array<float, 3> back(const Point& point) const {
    std::array<float, 3> result;
    for (std::size_t k = 0; k < 3; ++k) {
      const double along = std::ldexp(point[static_cast<int>(k)], exponent_) + centre_[k];
      result[k] = std::clamp(static_cast<float>(along), lower_[k], upper_[k]) + 0.0f;
    }
    return result;
  }

  double length_back(double length) const { return std::ldexp(length, exponent_); }

 private:
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  std::array<float, 3> lower_ = {kInfinity, kInfinity, kInfinity};
  std::array<float, 3> upper_ = {-kInfinity, -kInfinity, -kInfinity};
  std::array<double, 3> centre_ = {};
  int exponent_ = 0;
};

// Where an edge shrinks to: the point with the least sum of squared distances from the planes of the
// triangles that it stands for, and a fixed end where there is one.
struct Placement {
  const Quadrics* quadrics;
  const std::vector<bool>* fixed;

  template <class Profile>
  boost::optional<Point> operator()(const Profile& profile) const {
    const bool first = (*fixed)[profile.v0()], second = (*fixed)[profile.v1()];
    if (first && second) return boost::none;
    if (first || second) return first ? profile.p0() : profile.p1();
    return quadrics->get_placement()(profile);
  }
};

// Refuses a collapse that turns a triangle by a right angle or more.
struct NoTurnedTriangle {
  template <class Profile>
  boost::optional<Point> operator()(const Profile& profile, boost::optional<Point> placement) const {
    if (!placement) return placement;
    const auto beside = static_cast<std::ptrdiff_t>(profile.left_face_exists()) + profile.right_face_exists();
    const auto& triangles = profile.triangles();  // first those beside the edge; the second corner moves
    for (auto t = triangles.begin() + beside; t != triangles.end(); ++t) {
      const Mesh& mesh = profile.surface_mesh();
      const Point &p = mesh.point(t->v0), &q = mesh.point(t->v1), &r = mesh.point(t->v2);
      const Vector before = CGAL::cross_product(p - q, r - q);
      const Vector now = CGAL::cross_product(p - *placement, r - *placement);
      if (!(before * now > 0) && before != CGAL::NULL_VECTOR) return boost::none;
    }
    return placement;
  }
};

struct Never {
  template <class Profile>
  bool operator()(double, const Profile&, std::size_t, std::size_t) const {
    return false;
  }
};

// Writes down what happens.
struct Recorder : simplification::Edge_collapse_visitor_base<Mesh> {
  const OpenedMesh* mesh;
  const Frame* frame;
  std::vector<bool>* fixed;
  std::vector<Collapse>* collapses;
  std::uint32_t triangles;
  double cost = 0;
  std::uint32_t ends[2] = {};
  std::array<float, 3> point = {};

  template <class Profile>
  void OnSelected(const Profile&, boost::optional<double> least, std::size_t, std::size_t) {
    if (least) cost = std::max(cost, *least);
  }

  template <class Profile>
  void OnCollapsing(const Profile& profile, const boost::optional<Point>& placement) {
    ends[0] = profile.v0();
    ends[1] = profile.v1();
    point = frame->back(*placement);
    for (const std::uint32_t end : ends) {
      if ((*fixed)[end]) point = mesh->points[end];
    }
    triangles -= static_cast<std::uint32_t>(profile.left_face_exists()) +
                 static_cast<std::uint32_t>(profile.right_face_exists());
  }

  template <class Profile>
  void OnCollapsed(const Profile&, Mesh::Vertex_index vertex) {
    const std::uint32_t kept = vertex, gone = ends[kept == ends[0] ? 1 : 0];
    (*fixed)[kept] = (*fixed)[kept] || (*fixed)[gone];
    collapses->push_back(
        {gone, kept, point, triangles, static_cast<float>(frame->length_back(std::sqrt(cost)))});
  }
};

Mesh surface_mesh(const OpenedMesh& opened, const Frame& frame, std::vector<bool>& fixed) {
  Mesh mesh;
  mesh.reserve(static_cast<Mesh::size_type>(opened.points.size()),
               static_cast<Mesh::size_type>(opened.triangles.size() * 3 / 2),
               static_cast<Mesh::size_type>(opened.triangles.size()));
  for (const auto& point : opened.points) mesh.add_vertex(frame.into(point));
  using Vertex = Mesh::Vertex_index;
  for (const auto& [a, b, c] : opened.triangles) {
    // Two cut edges between the same vertices are one to Surface_mesh, which may refuse the triangle: then it
    // stays as it is.
    if (mesh.add_face(Vertex(a), Vertex(b), Vertex(c)) == Mesh::null_face())
      fixed[a] = fixed[b] = fixed[c] = true;
  }
  return mesh;
}

}  // namespace

std::vector<Collapse> collapse_edges(const OpenedMesh& opened) {
  std::vector<Collapse> collapses;
  std::vector<bool> fixed = opened.fixed;
  const Frame frame(opened.points);
  Mesh mesh = surface_mesh(opened, frame, fixed);
  const Quadrics quadrics(mesh);
  Recorder recorder;
  recorder.mesh = &opened;
  recorder.frame = &frame;
  recorder.fixed = &fixed;
  recorder.collapses = &collapses;
  recorder.triangles = static_cast<std::uint32_t>(opened.triangles.size());
  simplification::edge_collapse(mesh, Never{},
                                CGAL::parameters::get_cost(quadrics.get_cost())
                                    .get_placement(Placement{&quadrics, &fixed})
                                    .filter(NoTurnedTriangle{})
                                    .visitor(recorder));
  return collapses;
}

LevelMesh after(const OpenedMesh& mesh, std::span<const Collapse> collapses) {
  std::vector<std::array<float, 3>> position = mesh.points;
  std::vector<std::uint32_t> now(mesh.points.size());
  std::iota(now.begin(), now.end(), 0u);
  for (const Collapse& collapse : collapses) {
    now[collapse.gone] = collapse.kept;
    position[collapse.kept] = collapse.point;
  }
  const auto find = [&](std::uint32_t point) {
    while (now[point] != point) point = now[point] = now[now[point]];
    return point;
  };
  LevelMesh level;
  std::vector<std::uint32_t> number(mesh.points.size(), kNoVertex);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    TriangleIndices corners = {find(a), find(b), find(c)};
    const auto& [p, q, r] = std::tie(position[corners[0]], position[corners[1]], position[corners[2]]);
    if (p == q || q == r || r == p) continue;  // it is an edge of others now
    for (std::uint32_t& corner : corners) {
      if (number[corner] == kNoVertex) {
        number[corner] = static_cast<std::uint32_t>(level.points.size());
        level.points.push_back(position[corner]);
      }
      corner = number[corner];
    }
    level.triangles.push_back(corners);
    level.was.push_back(mesh.was[t]);
  }
  return level;
}

}  // namespace tandem::build
