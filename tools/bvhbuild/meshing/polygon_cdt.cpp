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

constexpr std::uint32_t kNobody = 0xFFFFFFFFu;
constexpr std::uint32_t kSeveral = 0xFFFFFFFEu;

struct FaceInfo {
  std::array<std::int32_t, 3>
      walks{};  ///< of each edge: how often the outline has the face on its left less on its right
  std::array<std::uint32_t, 3> walker{
      kNobody, kNobody,
      kNobody};  ///< of each edge: from which corner the outline walks it with the face on its left
  std::array<std::uint32_t, 3> corners{
      kNobody, kNobody, kNobody};  ///< at each vertex: the corner whose angle holds the face, if several meet
  std::int32_t winding = 0;        ///< how often the outline goes round the face, counter-clockwise
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
  std::uint64_t looks_left = 0;  ///< see pay_for()

  void begin(std::span<const Point> polygon, int projection_axis);
  void group_corners();
  bool sort_corners();
  bool insert_corners();
  bool insert_outline();
  bool insert_edge(std::size_t corner);
  bool pay_for(Cdt::Vertex_handle from, Cdt::Vertex_handle to);
  bool count_walk(std::size_t corner);
  std::size_t after(std::size_t corner) const { return corner + 1 < vertices.size() ? corner + 1 : 0; }
  bool lies_on(const VertexInfo& vertex, const VertexInfo& from, const VertexInfo& to) const;
  void find_windings();
  void name_corners();
  void name_corners_around(Cdt::Vertex_handle vertex);
  std::uint32_t corner_between(Cdt::Vertex_handle vertex, const Cdt::Edge& right,
                               const Cdt::Edge& left) const;
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
  looks_left = 1'000'000 + 64 * std::uint64_t{corners.size()};
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

/// Puts the leaders along a space-filling curve, so that each insertion starts next to its place, and three
/// that make a triangle first: while all are on one line, CGAL searches that line from its end each time.
/// False when all are.
bool PolygonCdt::State::sort_corners() {
  using SortTraits = CGAL::Spatial_sort_traits_adapter_2<Kernel, PointMap>;
  CGAL::spatial_sort(order.begin(), order.end(), SortTraits(CGAL::make_property_map(std::as_const(points))));
  const auto aside = std::find_if(order.begin(), order.end(), [&](std::size_t corner) {
    return !CGAL::collinear(points[order[0]], points[order[1]], points[corner]);
  });
  if (aside == order.end()) return false;
  std::rotate(order.begin() + 2, aside, aside + 1);
  return true;
}

bool PolygonCdt::State::insert_corners() {
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
  return true;
}

/// Far-apart edges first, so that they cut the triangulation into ever smaller parts: in the outline's order,
/// an edge across many others would meet all of them again and again.
bool PolygonCdt::State::insert_outline() {
  const std::size_t count = vertices.size();
  std::size_t stride = count - count * 2 / 5;
  while (std::gcd(stride, count) != 1) ++stride;
  try {
    for (std::size_t k = 0, i = 0; k < count; ++k, i = (i + stride) % count)
      if (!insert_edge(i)) return false;
  } catch (const Cdt::Intersection_of_constraints_exception&) {
    return false;
  }
  for (std::size_t i = 0; i < count; ++i)
    if (!count_walk(i)) return false;
  return true;
}

/// CGAL looks for the edge among all those at the vertex it starts from, so start where the outline comes by
/// less often.
bool PolygonCdt::State::insert_edge(std::size_t corner) {
  Cdt::Vertex_handle from = vertices[corner];
  Cdt::Vertex_handle to = vertices[after(corner)];
  if (from == to) return false;
  if (from->info().visits > to->info().visits) std::swap(from, to);
  cdt.insert_constraint(from, to);
  return pay_for(from, to);
}

/// Of a simple polygon, all edges together look at about 6 edges a corner. An outline that runs along
/// itself again and again would take quadratic time; false when it has used up its share.
bool PolygonCdt::State::pay_for(Cdt::Vertex_handle from, Cdt::Vertex_handle to) {
  while (from != to) {
    const std::uint64_t looks = cdt.degree(from);
    if (looks > looks_left) return false;
    looks_left -= looks;
    Cdt::Vertex_handle next;
    Cdt::Face_handle right;
    int edge = 0;
    cdt.includes_edge(from, to, next, right, edge);
    from = next;
  }
  return true;
}

/// A constraint that passes through vertices is a chain of edges. False when one is off the line in space.
bool PolygonCdt::State::count_walk(std::size_t corner) {
  Cdt::Vertex_handle from = vertices[corner];
  Cdt::Vertex_handle to = vertices[after(corner)];
  const bool backwards = from->info().visits > to->info().visits;
  if (backwards) std::swap(from, to);
  const VertexInfo start = from->info();
  while (from != to) {
    Cdt::Vertex_handle next;
    Cdt::Edge right;
    cdt.includes_edge(from, to, next, right.first, right.second);
    if (next != to && !lies_on(next->info(), start, to->info())) return false;
    Cdt::Edge left = cdt.mirror_edge(right);
    if (backwards) std::swap(left, right);
    ++left.first->info().walks[left.second];
    --right.first->info().walks[right.second];
    std::uint32_t& walker = left.first->info().walker[left.second];
    walker = walker == kNobody ? static_cast<std::uint32_t>(corner) : kSeveral;
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

/// Corners that meet in the projection may be different vertices of the mesh, and differ by rounding: each
/// triangle gets the one in whose angle it lies.
void PolygonCdt::State::name_corners() {
  for (const std::size_t corner : order)
    if (vertices[corner]->info().visits > 1) name_corners_around(vertices[corner]);
}

/// The outline's edges cut the faces around the vertex into angles; there is at least one such edge.
void PolygonCdt::State::name_corners_around(Cdt::Vertex_handle vertex) {
  const auto right = [&](const Cdt::Face_handle& face) {
    return Cdt::Edge(face, Cdt::cw(face->index(vertex)));
  };
  const auto left = [&](const Cdt::Face_handle& face) {
    return Cdt::Edge(face, Cdt::ccw(face->index(vertex)));
  };
  Cdt::Face_circulator first = cdt.incident_faces(vertex);
  while (!cdt.is_constrained(right(first))) ++first;
  Cdt::Face_circulator begin = first;
  do {
    Cdt::Face_circulator last = begin;
    while (!cdt.is_constrained(left(last))) ++last;
    const std::uint32_t corner = corner_between(vertex, right(begin), left(last));
    const Cdt::Face_circulator end = ++last;
    do begin->info().corners[begin->index(vertex)] = corner;
    while (++begin != end);
  } while (begin != first);
}

/// Of the angle at `vertex` between two edges of the outline, each given with the face inside the angle. The
/// outline leaves the corner along one and reaches it along the other; one that passes without a corner here,
/// or an edge walked so more than once, does not tell.
std::uint32_t PolygonCdt::State::corner_between(Cdt::Vertex_handle vertex, const Cdt::Edge& right,
                                                const Cdt::Edge& left) const {
  const bool counter_clockwise = right.first->info().winding > 0;
  const Cdt::Edge leaving = counter_clockwise ? right : cdt.mirror_edge(left);
  const Cdt::Edge arriving = counter_clockwise ? left : cdt.mirror_edge(right);
  const std::uint32_t left_from = leaving.first->info().walker[leaving.second];
  if (left_from < kSeveral && vertices[left_from] == vertex) return left_from;
  const std::uint32_t came_from = arriving.first->info().walker[arriving.second];
  if (came_from < kSeveral && vertices[after(came_from)] == vertex)
    return static_cast<std::uint32_t>(after(came_from));
  return vertex->info().corner;
}

bool PolygonCdt::State::emit(std::vector<TriangleIndices>& out) const {
  const std::size_t before = out.size();
  const auto corner = [](const auto& face, int k) {
    const std::uint32_t named = face->info().corners[k];
    return named == kNobody ? face->vertex(k)->info().corner : named;
  };
  for (auto face = cdt.finite_faces_begin(); face != cdt.finite_faces_end(); ++face) {
    const std::int32_t winding = face->info().winding;
    if (winding % 2 == 0) continue;
    const int second = winding > 0 ? 1 : 2;
    out.push_back({corner(face, 0), corner(face, second), corner(face, 3 - second)});
  }
  return out.size() > before;
}

PolygonCdt::PolygonCdt() : state_(std::make_unique<State>()) {}
PolygonCdt::~PolygonCdt() = default;

bool PolygonCdt::triangulate(std::span<const Point> corners, int axis, std::vector<TriangleIndices>& out) {
  State& s = *state_;
  s.begin(corners, axis);
  s.group_corners();
  if (!s.sort_corners() || !s.insert_corners() || !s.insert_outline()) return false;
  s.find_windings();
  s.name_corners();
  return s.emit(out);
}

}  // namespace tandem::build
