#include "cow_mesh.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/tangential_relaxation.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include "cow_shape.h"
#include "polygonise.h"

namespace tandem::makeassets {
namespace {

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
