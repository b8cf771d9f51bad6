// Polygons of five corners or more. CGAL is known to this source alone; its headers stay here.
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
#include <span>
#include <tuple>
#include <vector>

#include "meshing.h"

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

/// Splits polygons of any shape by a constrained Delaunay triangulation of their projection along a
/// coordinate axis. Keep one and use it for many polygons: it reuses its memory. One thread at a time.
class PolygonCdt {
 public:
  /// Effect: on success appends the triangles to `out`, as indices into `corners`, oriented as the polygon
  /// goes.
  ///
  /// Result: false, with `out` as it was, when two edges cross in the projection, when corners or edges that
  /// are apart in space touch in it, when all corners lie on one line in it, when nothing is inside, or when
  /// more than 10,000 corners run along each other again and again, which would take quadratic time.
  ///
  /// The outline may touch itself and may walk an edge to and fro (a bridge to a hole): the inside is what it
  /// winds round an odd number of times. A simple polygon of n corners gives exactly n - 2 triangles. Where
  /// several corners meet in the projection, a triangle uses the one whose angle it lies in.
  ///
  /// corners: at least 3, finite, no two consecutive ones at the same place
  /// axis: 0, 1 or 2, the coordinate that the projection leaves out
  bool triangulate(std::span<const Point> polygon, int projection_axis, std::vector<TriangleIndices>& out) {
    begin(polygon, projection_axis);
    group_corners();
    if (!sort_corners() || !insert_corners() || !insert_outline()) return false;
    find_windings();
    name_corners();
    return emit(out);
  }

 private:
  /// Corners that coincide in the projection are one if the coordinate that was left out differs by rounding
  /// only, else two that must not be mixed up: a millionth of the polygon's extent tells them apart.
  void begin(std::span<const Point> polygon, int projection_axis) {
    cdt_.clear();
    corners_ = polygon;
    axis_ = projection_axis;
    points_.clear();
    double extent = 0;
    for (const Point& corner : corners_) {
      points_.emplace_back(corner[(axis_ + 1) % 3], corner[(axis_ + 2) % 3]);
      for (int k = 0; k < 3; ++k) extent = std::max(extent, std::abs(corner[k] - corners_[0][k]));
    }
    tolerance_ = 0x1p-20 * extent;
    looks_left_ = 1'000'000 + 64 * std::uint64_t{corners_.size()};
  }

  /// Fills `leader_` (of each corner, the first corner at the same place) and `order_` (the leaders). CGAL
  /// would take corners at one place, but looks at all edges there each time.
  void group_corners() {
    order_.resize(points_.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    leader_ = order_;
    const auto before = [&](std::size_t a, std::size_t b) {
      return std::make_tuple(points_[a].x(), points_[a].y(), a) <
             std::make_tuple(points_[b].x(), points_[b].y(), b);
    };
    std::sort(order_.begin(), order_.end(), before);
    for (std::size_t i = 1; i < order_.size(); ++i)
      if (points_[order_[i]] == points_[order_[i - 1]]) leader_[order_[i]] = leader_[order_[i - 1]];
    std::erase_if(order_, [&](std::size_t corner) { return leader_[corner] != corner; });
  }

  /// Puts the leaders along a space-filling curve, so that each insertion starts next to its place, and three
  /// that make a triangle first: while all are on one line, CGAL searches that line from its end each time.
  /// False when all are.
  bool sort_corners() {
    using SortTraits = CGAL::Spatial_sort_traits_adapter_2<Kernel, PointMap>;
    CGAL::spatial_sort(order_.begin(), order_.end(),
                       SortTraits(CGAL::make_property_map(std::as_const(points_))));
    const auto aside = std::find_if(order_.begin(), order_.end(), [&](std::size_t corner) {
      return !CGAL::collinear(points_[order_[0]], points_[order_[1]], points_[corner]);
    });
    if (aside == order_.end()) return false;
    std::rotate(order_.begin() + 2, aside, aside + 1);
    return true;
  }

  bool insert_corners() {
    vertices_.assign(points_.size(), nullptr);
    Cdt::Face_handle hint = nullptr;
    for (const std::size_t corner : order_) {
      vertices_[corner] = cdt_.insert(points_[corner], hint);
      vertices_[corner]->info().corner = static_cast<std::uint32_t>(corner);
      hint = vertices_[corner]->face();
    }
    for (std::size_t corner = 0; corner < corners_.size(); ++corner) {
      if (std::abs(corners_[corner][axis_] - corners_[leader_[corner]][axis_]) > tolerance_) return false;
      vertices_[corner] = vertices_[leader_[corner]];
      ++vertices_[corner]->info().visits;
    }
    return true;
  }

  /// Far-apart edges first, so that they cut the triangulation into ever smaller parts: in the outline's
  /// order, an edge across many others would meet all of them again and again.
  bool insert_outline() {
    const std::size_t count = vertices_.size();
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

  /// CGAL looks for the edge among all those at the vertex it starts from, so start where the outline comes
  /// by less often.
  bool insert_edge(std::size_t corner) {
    Cdt::Vertex_handle from = vertices_[corner];
    Cdt::Vertex_handle to = vertices_[after(corner)];
    if (from == to) return false;
    if (from->info().visits > to->info().visits) std::swap(from, to);
    cdt_.insert_constraint(from, to);
    return pay_for(from, to);
  }

  /// All edges of a simple polygon look together at about 6 edges a corner. An outline that runs along itself
  /// again and again would take quadratic time; false when it has used up its share.
  bool pay_for(Cdt::Vertex_handle from, Cdt::Vertex_handle to) {
    while (from != to) {
      const std::uint64_t looks = cdt_.degree(from);
      if (looks > looks_left_) return false;
      looks_left_ -= looks;
      Cdt::Vertex_handle next;
      Cdt::Face_handle right;
      int edge = 0;
      cdt_.includes_edge(from, to, next, right, edge);
      from = next;
    }
    return true;
  }

  /// A constraint that passes through vertices is a chain of edges. False when one is off the line in space.
  bool count_walk(std::size_t corner) {
    Cdt::Vertex_handle from = vertices_[corner];
    Cdt::Vertex_handle to = vertices_[after(corner)];
    const bool backwards = from->info().visits > to->info().visits;
    if (backwards) std::swap(from, to);
    const VertexInfo start = from->info();
    while (from != to) {
      Cdt::Vertex_handle next;
      Cdt::Edge right;
      cdt_.includes_edge(from, to, next, right.first, right.second);
      if (next != to && !lies_on(next->info(), start, to->info())) return false;
      Cdt::Edge left = cdt_.mirror_edge(right);
      if (backwards) std::swap(left, right);
      ++left.first->info().walks[left.second];
      --right.first->info().walks[right.second];
      std::uint32_t& walker = left.first->info().walker[left.second];
      walker = walker == kNobody ? static_cast<std::uint32_t>(corner) : kSeveral;
      from = next;
    }
    return true;
  }

  std::size_t after(std::size_t corner) const { return corner + 1 < vertices_.size() ? corner + 1 : 0; }

  /// Returns whether a vertex lies on the edge. Condition: it does in the projection.
  bool lies_on(const VertexInfo& vertex, const VertexInfo& from, const VertexInfo& to) const {
    const Point& p = corners_[vertex.corner];
    const Point& a = corners_[from.corner];
    const Point& b = corners_[to.corner];
    const int u = (axis_ + 1) % 3;
    const int v = (axis_ + 2) % 3;
    const int along = std::abs(b[u] - a[u]) > std::abs(b[v] - a[v]) ? u : v;
    const double share = (p[along] - a[along]) / (b[along] - a[along]);
    return std::abs(a[axis_] + share * (b[axis_] - a[axis_]) - p[axis_]) <= tolerance_;
  }

  /// Stepping over an edge changes the winding number by how often the outline walks it; outside it is 0.
  void find_windings() {
    stack_.assign(1, cdt_.infinite_face());
    stack_.front()->info().seen = true;
    while (!stack_.empty()) {
      const Cdt::Face_handle face = stack_.back();
      stack_.pop_back();
      for (int edge = 0; edge < 3; ++edge) {
        const Cdt::Face_handle other = face->neighbor(edge);
        if (other->info().seen) continue;
        other->info().seen = true;
        other->info().winding = face->info().winding - face->info().walks[edge];
        stack_.push_back(other);
      }
    }
  }

  /// Corners that meet in the projection may be different vertices of the mesh, and differ by rounding: each
  /// triangle gets the one in whose angle it lies.
  void name_corners() {
    for (const std::size_t corner : order_)
      if (vertices_[corner]->info().visits > 1) name_corners_around(vertices_[corner]);
  }

  /// The outline's edges cut the faces around the vertex into angles; there is at least one such edge.
  void name_corners_around(Cdt::Vertex_handle vertex) {
    const auto right = [&](const Cdt::Face_handle& face) {
      return Cdt::Edge(face, Cdt::cw(face->index(vertex)));
    };
    const auto left = [&](const Cdt::Face_handle& face) {
      return Cdt::Edge(face, Cdt::ccw(face->index(vertex)));
    };
    Cdt::Face_circulator first = cdt_.incident_faces(vertex);
    while (!cdt_.is_constrained(right(first))) ++first;
    Cdt::Face_circulator begin = first;
    do {
      Cdt::Face_circulator last = begin;
      while (!cdt_.is_constrained(left(last))) ++last;
      const std::uint32_t corner = corner_between(vertex, right(begin), left(last));
      const Cdt::Face_circulator end = ++last;
      do begin->info().corners[begin->index(vertex)] = corner;
      while (++begin != end);
    } while (begin != first);
  }

  /// Returns the corner of the angle at `vertex` between two edges of the outline, each given with the face
  /// inside the angle. The outline leaves the corner along one and reaches it along the other; one that
  /// passes without a corner here, or an edge walked so more than once, does not tell.
  std::uint32_t corner_between(Cdt::Vertex_handle vertex, const Cdt::Edge& right,
                               const Cdt::Edge& left) const {
    const bool counter_clockwise = right.first->info().winding > 0;
    const Cdt::Edge leaving = counter_clockwise ? right : cdt_.mirror_edge(left);
    const Cdt::Edge arriving = counter_clockwise ? left : cdt_.mirror_edge(right);
    const std::uint32_t left_from = leaving.first->info().walker[leaving.second];
    if (left_from < kSeveral && vertices_[left_from] == vertex) return left_from;
    const std::uint32_t came_from = arriving.first->info().walker[arriving.second];
    if (came_from < kSeveral && vertices_[after(came_from)] == vertex)
      return static_cast<std::uint32_t>(after(came_from));
    return vertex->info().corner;
  }

  bool emit(std::vector<TriangleIndices>& out) const {
    const std::size_t before = out.size();
    const auto corner = [](const auto& face, int k) {
      const std::uint32_t named = face->info().corners[k];
      return named == kNobody ? face->vertex(k)->info().corner : named;
    };
    for (auto face = cdt_.finite_faces_begin(); face != cdt_.finite_faces_end(); ++face) {
      const std::int32_t winding = face->info().winding;
      if (winding % 2 == 0) continue;
      const int second = winding > 0 ? 1 : 2;
      out.push_back({corner(face, 0), corner(face, second), corner(face, 3 - second)});
    }
    return out.size() > before;
  }

  Cdt cdt_;
  std::span<const Point> corners_;
  int axis_ = 0;
  double tolerance_ = 0;  ///< see begin()
  std::vector<Kernel::Point_2> points_;
  std::vector<std::size_t> order_;
  std::vector<std::size_t> leader_;
  std::vector<Cdt::Vertex_handle> vertices_;  ///< of each corner
  std::vector<Cdt::Face_handle> stack_;
  std::uint64_t looks_left_ = 0;  ///< see pay_for()
};

}  // namespace

TriangleMesh triangulate(PolygonMesh& mesh, CleanReport& report) {
  PolygonCdt cdt;
  return triangulate(mesh, report,
                     [&](std::span<const Point> polygon, int axis, std::vector<TriangleIndices>& out) {
                       return cdt.triangulate(polygon, axis, out);
                     });
}

}  // namespace tandem::build
