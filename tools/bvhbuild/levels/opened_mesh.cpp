#include "opened_mesh.h"

#include <algorithm>

#include "bvhbuild/meshing/index_table.h"
#include "bvhbuild/tree/surface_topology.h"
#include "common/union_find.h"

namespace tandem::build {
namespace {

bool is_segment(const TriangleTopology& triangle) {
  const std::uint32_t(&v)[3] = triangle.vertex;
  return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
}

// Whether the corners go round as 0, 1, 2 do, once a turned triangle is turned, 1 or -1: the same number for
// triangles with the same corners means the same winding.
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

// Joins the corners that stay one vertex and marks the vertices along the cuts.
void join_corners(std::span<const TriangleTopology> triangles, UnionFind& corners,
                  std::vector<bool>& on_cut) {
  const auto next = [](std::uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; };
  const auto vertex = [&](std::uint32_t corner) { return triangles[corner / 3].vertex[corner % 3]; };
  const SurfaceEdges edges(triangles);
  for (std::uint32_t e = 0; e < edges.count(); ++e) {
    const auto sides = edges.sides_of(e);
    if (sides.size() == 1) continue;
    const std::uint32_t s = sides[0], t = sides[1];
    if (sides.size() == 2 && runs_up(triangles, s) != runs_up(triangles, t)) {
      corners.join(s, next(t));
      corners.join(next(s), t);
    } else {
      on_cut[vertex(s)] = on_cut[vertex(next(s))] = true;
    }
  }
}

}  // namespace

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
