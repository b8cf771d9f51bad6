#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/tangential_relaxation.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <unordered_map>

#include "shapes.h"

namespace tandem::makeassets {
namespace {

struct Bounds {
  Point lower, upper;
};

using Corner = std::array<std::uint32_t, 3>;
using Tetrahedron = std::array<Corner, 4>;

// Freudenthal's division: one tetrahedron for each order in which a walk from corner 000 to corner 111 can
// take the three axes. The division is the same on both sides of every face, hence no cracks and a manifold.
constexpr std::array<std::array<int, 3>, 6> kAxisOrders = {
    {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};

class Marcher {
 public:
  Marcher(const std::function<double(const Point&)>& distance, const Bounds& bounds, double cell)
      : lower_(bounds.lower), cell_(cell) {
    for (int k = 0; k < 3; ++k)
      size_[k] = static_cast<std::uint32_t>(std::ceil((bounds.upper[k] - bounds.lower[k]) / cell)) + 1;
    value_.resize(std::size_t{size_[0]} * size_[1] * size_[2]);
    for_each_corner(size_, [&](const Corner& c) { value_[index(c)] = distance(position(c)); });
  }

  Mesh march() {
    for_each_corner({size_[0] - 1, size_[1] - 1, size_[2] - 1}, [&](const Corner& c) {
      if (is_crossed(c)) march_cube(c);
    });
    return std::move(mesh_);
  }

 private:
  template <class Visit>
  static void for_each_corner(const Corner& end, Visit visit) {
    for (std::uint32_t z = 0; z < end[2]; ++z)
      for (std::uint32_t y = 0; y < end[1]; ++y)
        for (std::uint32_t x = 0; x < end[0]; ++x) visit(Corner{x, y, z});
  }

  std::size_t index(const Corner& c) const { return (std::size_t{c[2]} * size_[1] + c[1]) * size_[0] + c[0]; }
  double value(const Corner& c) const { return value_[index(c)]; }
  Point position(const Corner& c) const {
    return {lower_[0] + cell_ * c[0], lower_[1] + cell_ * c[1], lower_[2] + cell_ * c[2]};
  }

  bool is_crossed(const Corner& c) const {
    const bool inside = value(c) < 0;
    for (std::uint32_t i = 1; i < 8; ++i)
      if ((value({c[0] + (i & 1), c[1] + (i >> 1 & 1), c[2] + (i >> 2)}) < 0) != inside) return true;
    return false;
  }

  void march_cube(const Corner& first) {
    for (const auto& order : kAxisOrders) {
      Tetrahedron tetrahedron{first, first, first, first};
      for (int step = 1; step <= 3; ++step) {
        tetrahedron[step] = tetrahedron[step - 1];
        ++tetrahedron[step][order[step - 1]];
      }
      march_tetrahedron(tetrahedron);
    }
  }

  void march_tetrahedron(Tetrahedron& t) {
    const auto outside =
        std::stable_partition(t.begin(), t.end(), [&](const Corner& c) { return value(c) < 0; });
    const Point outwards = position(t[3]) - position(t[0]);
    switch (outside - t.begin()) {
      case 1:
        emit(crossing(t[0], t[1]), crossing(t[0], t[2]), crossing(t[0], t[3]), outwards);
        break;
      case 2: {
        const auto v02 = crossing(t[0], t[2]), v13 = crossing(t[1], t[3]);
        emit(v02, crossing(t[0], t[3]), v13, outwards);
        emit(v02, v13, crossing(t[1], t[2]), outwards);
        break;
      }
      case 3:
        emit(crossing(t[0], t[3]), crossing(t[1], t[3]), crossing(t[2], t[3]), outwards);
        break;
    }
  }

  std::uint32_t crossing(const Corner& inside, const Corner& outside) {
    const Corner& from = std::min(inside, outside);
    const Corner& to = std::max(inside, outside);
    const std::uint64_t direction = (to[0] != from[0]) | (to[1] != from[1]) << 1 | (to[2] != from[2]) << 2;
    const auto next = static_cast<std::uint32_t>(mesh_.points.size());
    const auto [entry, is_new] = vertex_.try_emplace(index(from) * 8 + direction, next);
    if (is_new) {
      // The point is kept away from the corners, where neighbouring crossings would coincide and make flat
      // triangles.
      const double at = std::clamp(value(from) / (value(from) - value(to)), 0.05, 0.95);
      mesh_.points.push_back(position(from) + at * (position(to) - position(from)));
    }
    return entry->second;
  }

  // Any edge from an inside to an outside corner crosses the plane of the triangle outwards.
  void emit(std::uint32_t a, std::uint32_t b, std::uint32_t c, const Point& outwards) {
    const auto& p = mesh_.points;
    if (dot(cross(p[b] - p[a], p[c] - p[a]), outwards) < 0) std::swap(b, c);
    mesh_.triangles.push_back({a, b, c});
  }

  Point lower_;
  double cell_;
  Corner size_{};
  std::vector<double> value_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertex_;
  Mesh mesh_;
};

// The zero surface of `distance` (negative inside) by marching tetrahedra over cubes of side `cell`. The
// result is a closed 2-manifold, oriented outwards, provided that the surface stays inside `bounds`.
Mesh polygonise(const std::function<double(const Point&)>& distance, const Bounds& bounds, double cell) {
  return Marcher(distance, bounds, cell).march();
}

// The hull of two spheres; `squeeze` < 1 flattens it along the unit vector `across`.
struct RoundCone {
  Point from;
  double from_radius;
  Point to;
  double to_radius;
  Point across{0, 1, 0};
  double squeeze = 1;
};
struct Ellipsoid {
  Point centre, radii;
};

// First-order distance, exact in sign.
double distance(const Ellipsoid& e, const Point& p) {
  const Point q = p - e.centre;
  const Point scaled = {q[0] / e.radii[0], q[1] / e.radii[1], q[2] / e.radii[2]};
  const Point gradient = {scaled[0] / e.radii[0], scaled[1] / e.radii[1], scaled[2] / e.radii[2]};
  const double steepness = length(gradient);
  if (steepness == 0) return -std::min({e.radii[0], e.radii[1], e.radii[2]});
  return length(scaled) * (length(scaled) - 1) / steepness;
}

// The distance to a cone of spheres along an axis. A point belongs to the sphere whose centre it meets when
// it is moved to the axis along the normal of the cone, which leans by (r0 - r1) / |axis| from the
// perpendicular.
double distance(const RoundCone& c, const Point& p) {
  const double stretch = 1 / c.squeeze - 1;
  const auto unsqueeze = [&](const Point& v) { return v + (stretch * dot(v, c.across)) * c.across; };
  const Point axis = unsqueeze(c.to - c.from);
  const Point q = unsqueeze(p - c.from);
  const double axis_length = length(axis);
  const double along = dot(q, axis) / axis_length;
  const double off = std::sqrt(std::max(0.0, dot(q, q) - along * along));
  const double lean = (c.from_radius - c.to_radius) / axis_length;
  const double foot = along - off * lean / std::sqrt(1 - lean * lean);
  const double at = std::clamp(foot / axis_length, 0.0, 1.0);
  return length(q - at * axis) - (c.from_radius + at * (c.to_radius - c.from_radius));
}

// Quadratic smooth minimum (Quilez): a fillet where the two distances differ by less than `blend`.
double smooth_min(double a, double b, double blend) {
  const double overlap = std::max(blend - std::abs(a - b), 0.0) / blend;
  return std::min(a, b) - overlap * overlap * blend / 4;
}

// A solid cow as a smooth union of simple parts, given by a function that is negative inside. The body is
// about 1 m long, faces +x and stands on the plane z = 0. Only + - * / and sqrt are used: no result depends
// on a maths library.
class CowShape {
 public:
  CowShape() {
    add_trunk();
    add_neck_and_head();
    for (const double side : {-1.0, 1.0}) add_ear_and_horn(side);
    // A slow walk: all four legs can be told apart from the side and from the front.
    add_fore_leg(1, -0.06);
    add_fore_leg(-1, 0.07);
    add_hind_leg(1, -0.08);
    add_hind_leg(-1, 0.08);
    add_udder();
    add_tail();
  }

  double operator()(const Point& p) const {
    double d = 1e9;
    for (const auto& [shape, blend] : ellipsoids_) d = smooth_min(d, distance(shape, p), blend);
    for (const auto& [shape, blend] : cones_) d = smooth_min(d, distance(shape, p), blend);
    for (const RoundCone& nostril : nostrils_) d = std::max(d, -distance(nostril, p));
    return std::max(d, -p[2]);  // the hooves are cut flat by the ground
  }

  Bounds bounds() const { return {{-0.66, -0.32, -0.02}, {0.96, 0.32, 1.06}}; }

 private:
  // `blend` is the width, in metres, of the fillet between a part and all the parts before it.
  struct BlendedCone {
    RoundCone shape;
    double blend;
  };
  struct BlendedEllipsoid {
    Ellipsoid shape;
    double blend;
  };

  void add_trunk() {
    add(Ellipsoid{{-0.05, 0, 0.560}, {0.42, 0.190, 0.245}}, 0.08);            // barrel
    add(Ellipsoid{{-0.06, 0, 0.460}, {0.29, 0.180, 0.170}}, 0.08);            // belly
    add(Ellipsoid{{0.26, 0, 0.585}, {0.16, 0.155, 0.225}}, 0.08);             // shoulders
    add(Ellipsoid{{-0.34, 0, 0.630}, {0.155, 0.155, 0.165}}, 0.08);           // rump
    add(Ellipsoid{{0.36, 0, 0.450}, {0.085, 0.070, 0.105}}, 0.08);            // brisket
    add(RoundCone{{-0.42, 0, 0.755}, 0.045, {0.26, 0, 0.770}, 0.045}, 0.07);  // back
    for (const double side : {-1.0, 1.0}) {
      add(RoundCone{{-0.245, side * 0.105, 0.745}, 0.042, {-0.42, side * 0.07, 0.730}, 0.040},
          0.09);  // hip to pin bone
    }
  }

  void add_neck_and_head() {
    add(RoundCone{{0.27, 0, 0.63}, 0.165, {0.56, 0, 0.765}, 0.090, {0, 1, 0}, 0.72}, 0.07);
    add(RoundCone{{0.38, 0, 0.46}, 0.030, {0.56, 0, 0.650}, 0.020}, 0.06);                      // dewlap
    add(RoundCone{{0.600, 0, 0.785}, 0.088, {0.770, 0, 0.610}, 0.060, {0, 1, 0}, 0.95}, 0.05);  // skull
    add(RoundCone{{0.600, 0, 0.720}, 0.060, {0.755, 0, 0.585}, 0.045}, 0.03);                   // jaw
    add(RoundCone{{0.795, -0.032, 0.585}, 0.056, {0.795, 0.032, 0.585}, 0.056}, 0.03);          // muzzle
    for (const double side : {-1.0, 1.0}) {
      add(RoundCone{{0.620, side * 0.040, 0.700}, 0.050, {0.700, side * 0.030, 0.635}, 0.040},
          0.04);  // cheek
      add(RoundCone{{0.625, side * 0.062, 0.825}, 0.020, {0.675, side * 0.062, 0.795}, 0.018}, 0.02);  // brow
      add(RoundCone{{0.655, side * 0.076, 0.775}, 0.019, {0.662, side * 0.076, 0.769}, 0.019}, 0.006);  // eye
      nostrils_.push_back({{0.850, side * 0.036, 0.607}, 0.018, {0.838, side * 0.050, 0.615}, 0.012});
    }
  }

  void add_ear_and_horn(double side) {
    const Point leaf_normal = {0.8, 0, 0.6};
    add(RoundCone{{0.565, side * 0.075, 0.815}, 0.022, {0.550, side * 0.155, 0.800}, 0.050, leaf_normal, 0.4},
        0.015);
    add(RoundCone{{0.550, side * 0.155, 0.800}, 0.050, {0.545, side * 0.240, 0.765}, 0.012, leaf_normal, 0.4},
        0.005);
    add(RoundCone{{0.575, side * 0.040, 0.860}, 0.030, {0.580, side * 0.115, 0.885}, 0.025}, 0.015);
    add(RoundCone{{0.580, side * 0.115, 0.885}, 0.025, {0.605, side * 0.170, 0.920}, 0.018}, 0.010);
    add(RoundCone{{0.605, side * 0.170, 0.920}, 0.018, {0.635, side * 0.175, 0.980}, 0.007}, 0.005);
  }

  void add_fore_leg(double side, double stride) {
    const double y = side * 0.105;
    const Point elbow = {0.255, y, 0.400}, knee = {0.265 + 0.6 * stride, y, 0.225};
    const Point fetlock = {0.255 + stride, y, 0.085}, hoof = {0.275 + stride, y, 0.015};
    add(RoundCone{{0.265, y, 0.560}, 0.095, elbow, 0.064}, 0.05);
    add(RoundCone{elbow, 0.062, knee, 0.038}, 0.03);
    add(RoundCone{knee, 0.036, fetlock, 0.027}, 0.02);
    add(RoundCone{fetlock, 0.029, hoof, 0.043}, 0.01);
  }

  void add_hind_leg(double side, double stride) {
    const double y = side * 0.11;
    const Point stifle = {-0.325, y, 0.430}, hock = {-0.405 + 0.6 * stride, y, 0.270};
    const Point fetlock = {-0.375 + stride, y, 0.085}, hoof = {-0.355 + stride, y, 0.015};
    add(RoundCone{{-0.355, 0.85 * y, 0.610}, 0.125, stifle, 0.085}, 0.05);
    add(RoundCone{stifle, 0.085, hock, 0.043}, 0.03);
    add(RoundCone{hock, 0.041, fetlock, 0.027}, 0.02);
    add(RoundCone{fetlock, 0.029, hoof, 0.043}, 0.01);
  }

  void add_udder() {
    add(RoundCone{{-0.255, 0, 0.35}, 0.095, {-0.185, 0, 0.34}, 0.080}, 0.03);
    for (const double x : {-0.265, -0.195})
      for (const double y : {-0.045, 0.045})
        add(RoundCone{{x, y, 0.275}, 0.022, {x, 1.1 * y, 0.220}, 0.014}, 0.01);
  }

  void add_tail() {
    const Point root = {-0.475, 0, 0.765}, bend = {-0.530, 0, 0.700}, end = {-0.540, 0.01, 0.400};
    add(RoundCone{{-0.40, 0, 0.765}, 0.040, root, 0.028}, 0.03);
    add(RoundCone{root, 0.028, bend, 0.020}, 0.01);
    add(RoundCone{bend, 0.020, end, 0.014}, 0.01);
    add(RoundCone{end, 0.016, {-0.540, 0.01, 0.330}, 0.034}, 0.01);  // tuft
    add(RoundCone{{-0.540, 0.01, 0.330}, 0.034, {-0.535, 0.01, 0.250}, 0.012}, 0.01);
  }

  void add(const Ellipsoid& shape, double blend) { ellipsoids_.push_back({shape, blend}); }
  void add(const RoundCone& shape, double blend) { cones_.push_back({shape, blend}); }

  std::vector<BlendedEllipsoid> ellipsoids_;
  std::vector<BlendedCone> cones_;
  std::vector<RoundCone> nostrils_;  // taken out of the union
};

namespace simplification = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;

// Half the radius of the thinnest part (a horn's tip): finer than any feature, coarse enough to build in
// seconds.
constexpr double kCell = 0.006;

SurfaceMesh to_surface_mesh(const Mesh& mesh) {
  SurfaceMesh surface;
  for (const auto& [x, y, z] : mesh.points) surface.add_vertex({x, y, z});
  for (const auto& [a, b, c] : mesh.triangles)
    surface.add_face(SurfaceMesh::Vertex_index(a), SurfaceMesh::Vertex_index(b),
                     SurfaceMesh::Vertex_index(c));
  return surface;
}

Mesh to_mesh(SurfaceMesh& surface) {
  surface.collect_garbage();
  Mesh mesh;
  for (const auto v : surface.vertices()) {
    const auto& p = surface.point(v);
    mesh.points.push_back({p.x(), p.y(), p.z()});
  }
  for (const auto f : surface.faces()) {
    const auto h = surface.halfedge(f);
    mesh.triangles.push_back({surface.source(h), surface.target(h), surface.target(surface.next(h))});
  }
  return mesh;
}

// Marching tetrahedra leave slivers; equal triangles give the reduction below sound quadrics to start from.
void remesh(SurfaceMesh& surface) {
  CGAL::Polygon_mesh_processing::isotropic_remeshing(faces(surface), kCell, surface,
                                                     CGAL::parameters::number_of_iterations(2));
}

// Plane quadrics give most triangles to horns, head and hooves, where the surface bends most. The filter
// refuses a collapse that would fold the surface over.
void reduce(SurfaceMesh& surface, std::size_t triangles) {
  using Policies = simplification::GarlandHeckbert_plane_policies<SurfaceMesh, Kernel>;
  Policies policies(surface);
  // A closed mesh has 3 edges for 2 triangles, and a collapse takes 3 edges; the predicate stops *below* its
  // number.
  const simplification::Count_stop_predicate<SurfaceMesh> stop(triangles / 2 * 3 + 1);
  simplification::edge_collapse(surface, stop,
                                CGAL::parameters::get_cost(policies.get_cost())
                                    .get_placement(policies.get_placement())
                                    .filter(simplification::Bounded_normal_change_filter<>()));
}

}  // namespace

Mesh cow_mesh(std::size_t triangles) {
  const CowShape cow;
  SurfaceMesh surface = to_surface_mesh(polygonise(cow, cow.bounds(), kCell));
  remesh(surface);
  reduce(surface, triangles);
  return to_mesh(surface);
}

}  // namespace tandem::makeassets
