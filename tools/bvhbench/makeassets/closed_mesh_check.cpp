#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/shape_predicates.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>

#include "mesh.h"

namespace tandem::makeassets {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;

bool has_flat_triangle(const SurfaceMesh& surface) {
  const auto all = faces(surface);
  return std::any_of(all.begin(), all.end(),
                     [&](auto f) { return pmp::is_degenerate_triangle_face(f, surface); });
}

std::size_t component_count(SurfaceMesh& surface) {
  auto component = surface.add_property_map<SurfaceMesh::Face_index, std::size_t>("f:component").first;
  return pmp::connected_components(surface, component);
}

long euler_characteristic(const SurfaceMesh& surface) {
  return static_cast<long>(num_vertices(surface)) - static_cast<long>(num_edges(surface)) +
         static_cast<long>(num_faces(surface));
}

}  // namespace

std::string closed_mesh_defect(const Mesh& mesh, std::size_t triangles) {
  if (mesh.triangles.size() != triangles) {
    return "it has " + std::to_string(mesh.triangles.size()) + " triangles instead of " +
           std::to_string(triangles);
  }
  if (!pmp::is_polygon_soup_a_polygon_mesh(mesh.triangles)) return "it is not an oriented 2-manifold";
  std::vector<Kernel::Point_3> points;
  for (const auto& [x, y, z] : mesh.points) points.emplace_back(x, y, z);
  SurfaceMesh surface;
  pmp::polygon_soup_to_polygon_mesh(points, mesh.triangles, surface);
  if (!is_closed(surface)) return "it is not closed";
  if (component_count(surface) != 1) return "it is not in one piece";
  if (euler_characteristic(surface) != 2) return "its genus is not 0";
  if (has_flat_triangle(surface)) return "it has a flat triangle";
  if (pmp::does_self_intersect(surface)) return "it intersects itself";
  if (!pmp::is_outward_oriented(surface)) return "it is oriented inwards";
  return {};
}

}  // namespace tandem::makeassets
