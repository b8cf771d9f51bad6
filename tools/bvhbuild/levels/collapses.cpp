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

#include "bvhbuild/meshing/index_table.h"
#include "bvhbuild/tree/surface_topology.h"
#include "kernels/common/union_find.h"
#include "levels/nearest_triangle.h"

namespace tandem::build {
namespace {

namespace simplification = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Quadrics = simplification::GarlandHeckbert_plane_policies<Mesh, Kernel>;

// A vertex has at most so many triangles: each collapse looks anew at all edges around the vertices beside
// it, with all triangles around their ends, which is cubic in this number.
constexpr std::uint32_t kMostAround = 64;

// Takes stored coordinates to a box of edge 1 to 2 around zero and back. Only the centre can round.
class Frame {
 public:
  explicit Frame(const Geometry& geometry) : bounds_(corner_bounds(geometry)) {
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      centre_[k] = static_cast<float>((double{bounds_.lower[k]} + bounds_.upper[k]) / 2);
      longest = std::max(longest, double{bounds_.upper[k]} - bounds_.lower[k]);
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
      // Clamped first: what is beyond float32 may not be cast.
      result[k] =
          static_cast<float>(std::clamp(along, double{bounds_.lower[k]}, double{bounds_.upper[k]})) + 0.0f;
    }
    return result;
  }

 private:
  CornerBounds bounds_;
  std::array<double, 3> centre_ = {};
  int exponent_ = 0;
};

// The place to which an edge shrinks: the point with the least sum of squared distances from the planes of
// the triangles that it stands for, and a fixed end where there is one.
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

// Keeps the surface near: points of the finest level each know a triangle that is at most so far away, and a
// collapse that would leave one of them without is refused, as is one that moves a vertex farther from the
// finest level. Between these points nothing is promised.
class Guard {
 public:
  // face: of each triangle, kNoVertex where it takes no part.
  Guard(const OpenedMesh& opened, std::span<const std::uint32_t> face, const LevelView& finest,
        double distance)
      : finest_(finest),
        square_(distance * distance),
        positions_(opened.points),
        near_(opened.points.size()),
        first_(opened.triangles.size(), kNone) {
    std::vector<bool> sampled(opened.points.size(), false);
    double area = 0;
    for (std::size_t t = 0; t < opened.triangles.size(); ++t) area += doubled_area(opened, t);
    const double share = area / static_cast<double>(opened.triangles.size());
    for (std::uint32_t t = 0; t < opened.triangles.size(); ++t) {
      if (face[t] == kNoVertex) continue;
      for (const std::uint32_t corner : opened.triangles[t]) {
        near_[corner] = opened.was[t];
        if (!sampled[corner]) add(point_of(corner), face[t]);
        sampled[corner] = true;
      }
      if (share > 0) spread(opened, t, face[t], share);
    }
  }

  // Returns where a vertex is now.
  const std::array<float, 3>& position(std::uint32_t vertex) const { return positions_[vertex]; }

  // Returns whether the collapse leaves everything near. If so, keep() may follow.
  bool allows(const Mesh& mesh, std::uint32_t v0, std::uint32_t v1, const std::array<float, 3>& point) {
    point_ = point;
    collect_star(mesh, v0, v1);
    if (left_.size() > kMostAround) return false;
    places_.clear();
    for (const std::uint32_t face : star_) {
      for (std::uint32_t sample = first_[face]; sample != kNone; sample = next_[sample]) {
        double least = std::numeric_limits<double>::infinity();
        std::uint32_t place = 0;
        for (const auto& [left, triangle] : left_) {
          const double square = levels::square_distance(samples_[sample], triangle);
          if (square < least) {
            least = square;
            place = left;
          }
        }
        if (!(least <= square_)) return false;
        places_.push_back({sample, place});
      }
    }
    const levels::Point moved = {{point[0], point[1], point[2]}};
    near_of_moved_ = near_[v0];
    if (!is_near(moved, near_of_moved_)) return false;
    return std::all_of(left_.begin(), left_.end(), [&](const auto& left) { return lies_near(left.second); });
  }

  // The collapse that was allowed last happens, and `kept` stands for both ends.
  void keep(std::uint32_t kept) {
    positions_[kept] = point_;
    near_[kept] = near_of_moved_;
    for (const std::uint32_t face : star_) first_[face] = kNone;
    for (const auto& [sample, face] : places_) {
      next_[sample] = first_[face];
      first_[face] = sample;
    }
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  // Weights of the second and third corner.
  static constexpr double kPlaces[][2] = {{0.5, 0},     {0.25, 0},   {0.75, 0},
                                          {0.25, 0.25}, {0.5, 0.25}, {0.25, 0.5}};
  static constexpr double kMostSamples = 64;  // of a triangle, beside its corners

  levels::Point point_of(std::uint32_t vertex) const {
    const auto& p = positions_[vertex];
    return {{p[0], p[1], p[2]}};
  }

  double doubled_area(const OpenedMesh& opened, std::size_t t) const {
    const auto& [a, b, c] = opened.triangles[t];
    const levels::Point p = point_of(a);
    const levels::Point normal = levels::cross(levels::minus(point_of(b), p), levels::minus(point_of(c), p));
    return std::sqrt(levels::dot(normal, normal));
  }

  void add(const levels::Point& point, std::uint32_t face) {
    next_.push_back(first_[face]);
    first_[face] = static_cast<std::uint32_t>(samples_.size());
    samples_.push_back(point);
  }

  // Points in large triangles: one for each mean area, on a grid of barycentric coordinates.
  void spread(const OpenedMesh& opened, std::uint32_t t, std::uint32_t face, double share) {
    const double wanted = std::min(doubled_area(opened, t) / share, kMostSamples);
    const int rows = static_cast<int>(std::sqrt(2 * wanted));
    const auto& [a, b, c] = opened.triangles[t];
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; i + j < rows; ++j) {
        const double u = (i + 1.0 / 3) / rows, v = (j + 1.0 / 3) / rows;
        const levels::Point along = levels::plus(levels::scaled(u, levels::minus(point_of(b), point_of(a))),
                                                 levels::scaled(v, levels::minus(point_of(c), point_of(a))));
        add(levels::plus(point_of(a), along), face);
      }
    }
  }

  // Returns whether points of a triangle around the moved vertex are near the finest level.
  bool lies_near(const Triangle& triangle) const {
    const levels::Point a = levels::corner_of(triangle, 0), b = levels::corner_of(triangle, 1),
                        c = levels::corner_of(triangle, 2);
    const auto mix = [&](double u, double v) {
      return levels::plus(
          a, levels::plus(levels::scaled(u, levels::minus(b, a)), levels::scaled(v, levels::minus(c, a))));
    };
    std::uint32_t hint = near_of_moved_;
    return std::all_of(std::begin(kPlaces), std::end(kPlaces),
                       [&](const auto& place) { return is_near(mix(place[0], place[1]), hint); });
  }

  // Returns whether a point is near the finest level. `hint`: a triangle that may be, and after that one that
  // is.
  bool is_near(const levels::Point& point, std::uint32_t& hint) const {
    if (levels::square_distance(point, finest_.triangles[hint]) <= square_) return true;
    const levels::NearestTriangle nearest = levels::nearest_triangle(finest_, point, hint, {square_});
    hint = nearest.triangle;
    return nearest.square <= square_;
  }

  // The triangles around both ends, and how those that are left will be.
  void collect_star(const Mesh& mesh, std::uint32_t v0, std::uint32_t v1) {
    star_.clear();
    left_.clear();
    for (const std::uint32_t end : {v0, v1}) {
      const std::uint32_t other = end == v0 ? v1 : v0;
      for (const auto h : CGAL::halfedges_around_target(Mesh::Vertex_index(end), mesh)) {
        if (mesh.is_border(h)) continue;
        const std::uint32_t face = mesh.face(h), p = mesh.source(h), q = mesh.target(mesh.next(h));
        const bool vanishes = p == other || q == other;
        if (!vanishes || end == v0) star_.push_back(face);
        if (vanishes) continue;
        Triangle triangle = {};
        const std::array<float, 3>* corners[] = {&point_, &positions_[q], &positions_[p]};
        for (int k = 0; k < 3; ++k) std::copy_n(corners[k]->data(), 3, triangle.corner[k].position);
        left_.push_back({face, triangle});
      }
    }
  }

  LevelView finest_;
  double square_;
  std::vector<std::array<float, 3>> positions_;
  std::vector<std::uint32_t> near_;  // of each vertex: a triangle of the finest level
  std::vector<levels::Point> samples_;
  std::vector<std::uint32_t> next_, first_;  // samples of a triangle: a list
  // These are of the collapse that is being looked at:
  std::array<float, 3> point_ = {};
  std::uint32_t near_of_moved_ = 0;
  std::vector<std::uint32_t> star_;
  std::vector<std::pair<std::uint32_t, Triangle>> left_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> places_;
};

// Refuses a collapse that turns a triangle by a right angle or more, or that the guard refuses.
struct Filter {
  const Frame* frame;
  const std::vector<bool>* fixed;
  Guard* guard;

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
    std::array<float, 3> point = frame->back(*placement);
    const std::uint32_t v0 = profile.v0(), v1 = profile.v1();
    for (const std::uint32_t end : {v0, v1}) {
      if ((*fixed)[end]) point = guard->position(end);
    }
    return guard->allows(profile.surface_mesh(), v0, v1, point) ? placement : boost::none;
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
  const Frame* frame;
  std::vector<bool>* fixed;
  std::vector<Collapse>* collapses;
  Guard* guard;
  std::uint32_t triangles;
  std::uint32_t ends[2] = {};
  std::array<float, 3> point = {};

  template <class Profile>
  void OnCollapsing(const Profile& profile, const boost::optional<Point>& placement) {
    ends[0] = profile.v0();
    ends[1] = profile.v1();
    point = frame->back(*placement);
    for (const std::uint32_t end : ends) {
      if ((*fixed)[end]) point = guard->position(end);
    }
    triangles -= static_cast<std::uint32_t>(profile.left_face_exists()) +
                 static_cast<std::uint32_t>(profile.right_face_exists());
  }

  template <class Profile>
  void OnCollapsed(const Profile&, Mesh::Vertex_index vertex) {
    const std::uint32_t kept = vertex, gone = ends[kept == ends[0] ? 1 : 0];
    guard->keep(kept);
    (*fixed)[kept] = (*fixed)[kept] || (*fixed)[gone];
    collapses->push_back({gone, kept, point, triangles});
  }
};

// The mesh in the frame, and of each triangle its face there.
std::pair<Mesh, std::vector<std::uint32_t>> surface_mesh(const OpenedMesh& opened, const Frame& frame,
                                                         std::vector<bool>& fixed) {
  std::pair<Mesh, std::vector<std::uint32_t>> result;
  auto& [mesh, faces] = result;
  mesh.reserve(static_cast<Mesh::size_type>(opened.points.size()),
               static_cast<Mesh::size_type>(opened.triangles.size() * 3 / 2),
               static_cast<Mesh::size_type>(opened.triangles.size()));
  faces.reserve(opened.triangles.size());
  for (const auto& point : opened.points) mesh.add_vertex(frame.into(point));
  using Vertex = Mesh::Vertex_index;
  for (const auto& [a, b, c] : opened.triangles) {
    // Two cut edges between the same vertices are one to Surface_mesh, which may refuse the triangle: then it
    // stays as it is.
    const Mesh::Face_index face = mesh.add_face(Vertex(a), Vertex(b), Vertex(c));
    const bool refused = face == Mesh::null_face();
    if (refused) fixed[a] = fixed[b] = fixed[c] = true;
    faces.push_back(refused ? kNoVertex : std::uint32_t{face});
  }
  return result;
}

bool is_segment(const TriangleTopology& triangle) {
  const std::uint32_t(&v)[3] = triangle.vertex;
  return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
}

// Returns whether the corners go round as 0, 1, 2 do, once a turned triangle is turned, 1 or -1: the same
// number for triangles with the same corners means the same winding.
std::int32_t winding(const TriangleTopology& triangle) {
  const std::uint32_t(&v)[3] = triangle.vertex;
  const bool ascends = (v[0] < v[1]) + (v[1] < v[2]) + (v[2] < v[0]) == 2;
  return ascends != is_turned(triangle.flags) ? 1 : -1;
}

// The numbers of the triangles that are kept, ascending: of those with the same corners the first; and how
// often each is there, less those that are wound the other way, as seen from the first.
std::vector<std::uint32_t> different_triangles(std::span<const TriangleTopology> triangles,
                                               std::vector<std::int32_t>& copies) {
  const auto corners = [&](std::uint32_t t) {
    std::array<std::uint32_t, 3> sorted = {triangles[t].vertex[0], triangles[t].vertex[1],
                                           triangles[t].vertex[2]};
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  };
  std::vector<std::uint32_t> kept;
  kept.reserve(triangles.size());
  IndexTable table(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (is_segment(triangles[t])) continue;
    const auto mine = corners(t);
    const auto same = [&](std::uint32_t other) { return corners(other) == mine; };
    const std::uint32_t first = table.find_or_insert(hash_words(mine[0], mine[1], mine[2]), t, same);
    if (first == t) {
      kept.push_back(t);
      copies.push_back(1);
    } else {
      const auto place = std::lower_bound(kept.begin(), kept.end(), first) - kept.begin();
      copies[static_cast<std::size_t>(place)] += winding(triangles[first]) * winding(triangles[t]);
    }
  }
  return kept;
}

// The triangles as they are wound once the turned ones are turned.
std::vector<TriangleTopology> wound(std::span<const TriangleTopology> triangles,
                                    std::span<const std::uint32_t> kept) {
  std::vector<TriangleTopology> result;
  result.reserve(kept.size());
  for (const std::uint32_t t : kept) {
    result.push_back(triangles[t]);
    TriangleTopology& triangle = result.back();
    if (is_turned(triangle.flags)) std::swap(triangle.vertex[1], triangle.vertex[2]);
    triangle.flags = 0;
  }
  return result;
}

// Joins the corners that stay one vertex and marks the vertices along the cuts. A fan of more than
// kMostAround triangles is cut into several.
void join_corners(std::span<const TriangleTopology> triangles, UnionFind& corners,
                  std::vector<bool>& on_cut) {
  const auto next = [](std::uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; };
  const auto vertex = [&](std::uint32_t corner) { return triangles[corner / 3].vertex[corner % 3]; };
  const SurfaceEdges edges(triangles);
  std::vector<std::uint32_t> around(3 * triangles.size(), 1);  // the first of joined corners: how many
  const auto together = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t first = corners.find(a), second = corners.find(b);
    return around[first] + (first == second ? 0 : around[second]);
  };
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t all = together(a, b);
    corners.join(a, b);
    around[corners.find(a)] = all;
  };
  for (std::uint32_t e = 0; e < edges.count(); ++e) {
    const auto sides = edges.sides_of(e);
    if (sides.size() == 1) continue;
    const std::uint32_t s = sides[0], t = sides[1];
    if (sides.size() == 2 && runs_up(triangles, s) != runs_up(triangles, t) &&
        std::max(together(s, next(t)), together(next(s), t)) <= kMostAround) {
      join(s, next(t));
      join(next(s), t);
    } else {
      on_cut[vertex(s)] = on_cut[vertex(next(s))] = true;
    }
  }
}

}  // namespace

std::vector<Collapse> collapse_edges(const OpenedMesh& opened, const LevelView& finest, double distance) {
  std::vector<Collapse> collapses;
  std::vector<bool> fixed = opened.fixed;
  const Frame frame({opened.points, opened.triangles});
  auto [mesh, face] = surface_mesh(opened, frame, fixed);
  const Quadrics quadrics(mesh);
  Guard guard(opened, face, finest, distance);
  Recorder recorder;
  recorder.guard = &guard;
  recorder.frame = &frame;
  recorder.fixed = &fixed;
  recorder.collapses = &collapses;
  recorder.triangles = static_cast<std::uint32_t>(opened.triangles.size());
  simplification::edge_collapse(mesh, Never{},
                                CGAL::parameters::get_cost(quadrics.get_cost())
                                    .get_placement(Placement{&quadrics, &fixed})
                                    .filter(Filter{&frame, &fixed, &guard})
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
  const auto add = [&](const TriangleIndices& corners, std::uint32_t was) {
    level.triangles.push_back(corners);
    level.was.push_back(was);
  };
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
    const std::int32_t copies = mesh.copies.empty() ? 1 : mesh.copies[t];
    const TriangleIndices turned = {corners[0], corners[2], corners[1]};
    if (copies == 0) add(turned, mesh.was[t]);
    for (std::int32_t i = 0; i < std::max(std::abs(copies), 1); ++i)
      add(copies < 0 ? turned : corners, mesh.was[t]);
  }
  return level;
}

OpenedMesh cut_open(const Geometry& geometry, const Tree& tree, const SurfaceTopology& topology) {
  OpenedMesh mesh;
  mesh.was = different_triangles(topology.triangles, mesh.copies);
  const bool once =
      std::all_of(mesh.copies.begin(), mesh.copies.end(), [](std::int32_t n) { return n == 1; });
  if (once || !topology.closed) mesh.copies = {};
  const std::vector<TriangleTopology> triangles = wound(topology.triangles, mesh.was);
  UnionFind corners(3 * triangles.size());
  std::vector<bool> on_cut(topology.vertex_count, false);
  join_corners(triangles, corners, on_cut);

  // Points are numbered by their lowest corners. A vertex with several is where surfaces touch.
  std::vector<std::uint32_t> number(3 * triangles.size()), vertex_of_point;
  std::vector<bool> seen(topology.vertex_count, false);
  mesh.triangles.resize(triangles.size());
  for (std::uint32_t corner = 0; corner < number.size(); ++corner) {
    const std::uint32_t first = corners.find(corner);
    if (first == corner) {
      const std::uint32_t vertex = triangles[corner / 3].vertex[corner % 3];
      if (seen[vertex]) on_cut[vertex] = true;
      seen[vertex] = true;
      number[corner] = static_cast<std::uint32_t>(vertex_of_point.size());
      vertex_of_point.push_back(vertex);
    }
    mesh.triangles[corner / 3][corner % 3] = number[first];
  }
  mesh.fixed_vertices = static_cast<std::uint64_t>(std::count(on_cut.begin(), on_cut.end(), true));

  std::vector<std::array<float, 3>> position(topology.vertex_count);
  for (const std::uint32_t t : mesh.was) {
    const auto& source = geometry.triangles[tree.order[t]];
    for (std::size_t k = 0; k < 3; ++k)
      position[topology.triangles[t].vertex[k]] = geometry.points[source[k]];
  }
  for (const std::uint32_t vertex : vertex_of_point) {
    mesh.points.push_back(position[vertex]);
    mesh.fixed.push_back(on_cut[vertex]);
  }
  return mesh;
}

}  // namespace tandem::build
