#include "kernels/manifold/overlap_oracle.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <map>
#include <stdexcept>

namespace tandem::test {
namespace {

using manifold::Vector3;
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
namespace pmp = CGAL::Polygon_mesh_processing;

Surface surface_of(const OracleSolid& solid) {
  Surface out;
  std::vector<Surface::Vertex_index> vertices;
  for (const Vector3& p : solid.points) vertices.push_back(out.add_vertex(Kernel::Point_3(p.x, p.y, p.z)));
  for (const auto& [i, j, k] : solid.triangles) {
    if (out.add_face(vertices[i], vertices[j], vertices[k]) == Surface::null_face())
      throw std::runtime_error("a surface is no manifold");
  }
  return out;
}

/// Notes for each triangle of the overlap of which surface it is.
struct Origins : pmp::Corefinement::Default_visitor<Surface> {
  using Face = Surface::Face_index;
  const Surface* a;
  std::map<Face, bool>* is_of_a;

  void after_face_copy(Face, const Surface& from, Face face, const Surface&) {
    (*is_of_a)[face] = &from == a;
  }
};

}  // namespace

bool bounds_a_solid(const OracleSolid& solid) {
  const Surface surface = surface_of(solid);
  return CGAL::is_closed(surface) && !pmp::does_self_intersect(surface) &&
         pmp::does_bound_a_volume(surface) && pmp::is_outward_oriented(surface);
}

std::vector<OverlapPiece> overlap_of(const OracleSolid& a, const OracleSolid& b) {
  Surface of_a = surface_of(a), of_b = surface_of(b), overlap;
  std::map<Surface::Face_index, bool> is_of_a;
  Origins origins;
  origins.a = &of_a, origins.is_of_a = &is_of_a;
  if (!pmp::corefine_and_compute_intersection(of_a, of_b, overlap, CGAL::parameters::visitor(origins)))
    throw std::runtime_error("the overlap's surface is no manifold");
  auto piece_of = overlap.add_property_map<Surface::Face_index, std::size_t>("f:piece", 0).first;
  std::vector<OverlapPiece> out(pmp::connected_components(overlap, piece_of));
  for (const Surface::Face_index face : overlap.faces()) {
    OverlapPiece& piece = out[piece_of[face]];
    std::array<Vector3, 3> corner;
    std::size_t k = 0;
    for (const auto vertex : overlap.vertices_around_face(overlap.halfedge(face))) {
      const auto& p = overlap.point(vertex);
      corner[k++] = {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
    }
    const Vector3 area = 0.5 * cross(corner[1] - corner[0], corner[2] - corner[0]);
    piece.triangles.push_back(corner);
    piece.is_of_a.push_back(is_of_a.at(face));
    if (piece.is_of_a.back()) piece.area = piece.area + area;
    (piece.is_of_a.back() ? piece.whole_area_a : piece.whole_area_b) += norm(area);
    piece.volume += dot(area, corner[0]) / 3;
  }
  return out;
}

}  // namespace tandem::test
