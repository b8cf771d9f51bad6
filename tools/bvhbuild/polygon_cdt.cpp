#include "polygon_cdt.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_face_base_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/spatial_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace tandem::build {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

struct FaceInfo {
  std::array<std::int32_t, 3>
      walks{};  ///< of each edge: how often the outline has the face on its left less on its right
  std::int32_t winding = 0;  ///< how often the outline goes round the face, counter-clockwise
  bool seen = false;
};

struct VertexInfo {
  std::uint32_t corner = 0;  ///< the first one at this place
  std::uint32_t visits = 0;  ///< number of corners at this place
};

using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<VertexInfo, Kernel>;
using FaceBase =
    CGAL::Constrained_triangulation_face_base_2<Kernel,
                                                CGAL::Triangulation_face_base_with_info_2<FaceInfo, Kernel>>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Cdt =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;
using PointMap = CGAL::Pointer_property_map<Kernel::Point_2>::const_type;

}  // namespace

struct PolygonCdt::State {
  Cdt cdt;
  std::span<const Point> corners;
  int axis = 0;
  double tolerance = 0;  ///< see begin()
  std::vector<Kernel::Point_2> points;
  std::vector<std::size_t> order;
  std::vector<std::size_t> leader;
  std::vector<Cdt::Vertex_handle> vertices;  ///< of each corner
  std::vector<Cdt::Face_handle> stack;

  void begin(std::span<const Point> polygon, int projection_axis);
  void group_corners();
  bool insert_corners();
  bool insert_outline();
  bool insert_edge(Cdt::Vertex_handle from, Cdt::Vertex_handle to);
  bool count_walks(Cdt::Vertex_handle from, Cdt::Vertex_handle to);
  bool lies_on(const VertexInfo& vertex, const VertexInfo& from, const VertexInfo& to) const;
  void find_windings();
  bool emit(std::vector<TriangleIndices>& out) const;
};

/// What coincides in the projection is one thing if the coordinate that was left out differs by rounding
/// only, else two that must not be mixed up: a millionth of the polygon's extent tells them apart.
void PolygonCdt::State::begin(std::span<const Point> polygon, int projection_axis) {
  cdt.clear();
  corners = polygon;
  axis = projection_axis;
  points.clear();
  double extent = 0;
  for (const Point& corner : corners) {
    points.emplace_back(corner[(axis + 1) % 3], corner[(axis + 2) % 3]);
    for (int k = 0; k < 3; ++k) extent = std::max(extent, std::abs(corner[k] - corners[0][k]));
  }
  tolerance = 0x1p-20 * extent;
}

/// Fills `leader` (of each corner, the first corner at the same place) and `order` (the leaders). CGAL would
/// take corners at one place, but looks at all edges there each time.
void PolygonCdt::State::group_corners() {
  order.resize(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  leader = order;
  const auto before = [&](std::size_t a, std::size_t b) {
    return std::make_tuple(points[a].x(), points[a].y(), a) <
           std::make_tuple(points[b].x(), points[b].y(), b);
  };
  std::sort(order.begin(), order.end(), before);
  for (std::size_t i = 1; i < order.size(); ++i)
    if (points[order[i]] == points[order[i - 1]]) leader[order[i]] = leader[order[i - 1]];
  std::erase_if(order, [&](std::size_t corner) { return leader[corner] != corner; });
}

/// Along a space-filling curve, so that each insertion starts next to its place.
bool PolygonCdt::State::insert_corners() {
  using SortTraits = CGAL::Spatial_sort_traits_adapter_2<Kernel, PointMap>;
  CGAL::spatial_sort(order.begin(), order.end(), SortTraits(CGAL::make_property_map(std::as_const(points))));
  vertices.assign(points.size(), nullptr);
  Cdt::Face_handle hint = nullptr;
  for (const std::size_t corner : order) {
    vertices[corner] = cdt.insert(points[corner], hint);
    vertices[corner]->info().corner = static_cast<std::uint32_t>(corner);
    hint = vertices[corner]->face();
  }
  for (std::size_t corner = 0; corner < corners.size(); ++corner) {
    if (std::abs(corners[corner][axis] - corners[leader[corner]][axis]) > tolerance) return false;
    vertices[corner] = vertices[leader[corner]];
    ++vertices[corner]->info().visits;
  }
  return cdt.dimension() == 2;
}

/// Far-apart edges first, so that they cut the triangulation into ever smaller parts: in the outline's order,
/// an edge across many others would meet all of them again and again.
bool PolygonCdt::State::insert_outline() {
  const std::size_t count = vertices.size();
  std::size_t stride = count - count * 2 / 5;
  while (std::gcd(stride, count) != 1) ++stride;
  try {
    for (std::size_t k = 0, i = 0; k < count; ++k, i = (i + stride) % count)
      if (!insert_edge(vertices[i], vertices[(i + 1) % count])) return false;
  } catch (const Cdt::Intersection_of_constraints_exception&) {
    return false;
  }
  for (std::size_t i = 0; i < count; ++i)
    if (!count_walks(vertices[i], vertices[(i + 1) % count])) return false;
  return true;
}

/// CGAL looks for the edge among all those at the vertex it starts from, so start where the outline comes by
/// less often.
bool PolygonCdt::State::insert_edge(Cdt::Vertex_handle from, Cdt::Vertex_handle to) {
  if (from == to) return false;
  if (from->info().visits > to->info().visits) std::swap(from, to);
  cdt.insert_constraint(from, to);
  return true;
}

/// A constraint that passes through vertices is a chain of edges. False when one is off the line in space.
bool PolygonCdt::State::count_walks(Cdt::Vertex_handle from, Cdt::Vertex_handle to) {
  const bool backwards = from->info().visits > to->info().visits;
  if (backwards) std::swap(from, to);
  const VertexInfo start = from->info();
  while (from != to) {
    Cdt::Vertex_handle next;
    Cdt::Face_handle right;
    int edge = 0;
    cdt.includes_edge(from, to, next, right, edge);
    if (next != to && !lies_on(next->info(), start, to->info())) return false;
    right->info().walks[edge] += backwards ? 1 : -1;
    const Cdt::Edge left = cdt.mirror_edge({right, edge});
    left.first->info().walks[left.second] += backwards ? -1 : 1;
    from = next;
  }
  return true;
}

/// Of a vertex on the edge in the projection.
bool PolygonCdt::State::lies_on(const VertexInfo& vertex, const VertexInfo& from,
                                const VertexInfo& to) const {
  const Point& p = corners[vertex.corner];
  const Point& a = corners[from.corner];
  const Point& b = corners[to.corner];
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  const int along = std::abs(b[u] - a[u]) > std::abs(b[v] - a[v]) ? u : v;
  const double share = (p[along] - a[along]) / (b[along] - a[along]);
  return std::abs(a[axis] + share * (b[axis] - a[axis]) - p[axis]) <= tolerance;
}

/// Stepping over an edge changes the winding number by how often the outline walks it; outside it is 0.
void PolygonCdt::State::find_windings() {
  stack.assign(1, cdt.infinite_face());
  stack.front()->info().seen = true;
  while (!stack.empty()) {
    const Cdt::Face_handle face = stack.back();
    stack.pop_back();
    for (int edge = 0; edge < 3; ++edge) {
      const Cdt::Face_handle other = face->neighbor(edge);
      if (other->info().seen) continue;
      other->info().seen = true;
      other->info().winding = face->info().winding - face->info().walks[edge];
      stack.push_back(other);
    }
  }
}

bool PolygonCdt::State::emit(std::vector<TriangleIndices>& out) const {
  const std::size_t before = out.size();
  for (auto face = cdt.finite_faces_begin(); face != cdt.finite_faces_end(); ++face) {
    const std::int32_t winding = face->info().winding;
    if (winding % 2 == 0) continue;
    const int second = winding > 0 ? 1 : 2;
    out.push_back({face->vertex(0)->info().corner, face->vertex(second)->info().corner,
                   face->vertex(3 - second)->info().corner});
  }
  return out.size() > before;
}

PolygonCdt::PolygonCdt() : state_(std::make_unique<State>()) {}
PolygonCdt::~PolygonCdt() = default;

bool PolygonCdt::triangulate(std::span<const Point> corners, int axis, std::vector<TriangleIndices>& out) {
  State& s = *state_;
  s.begin(corners, axis);
  s.group_corners();
  if (!s.insert_corners() || !s.insert_outline()) return false;
  s.find_windings();
  return s.emit(out);
}

}  // namespace tandem::build
