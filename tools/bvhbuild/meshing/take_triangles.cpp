#include "take_triangles.h"

#include "usable_face.h"

namespace tandem::build {

TriangleMesh take_triangles(std::span<const Point> points, std::span<const TriangleIndices> triangles,
                            std::span<const std::uint32_t> face, CleanReport& report) {
  report.faces = triangles.size();
  report.vertices = points.size();
  report.vertices_unreferenced = count_unreferenced(
      points.size(), {triangles.empty() ? nullptr : triangles[0].data(), 3 * triangles.size()});
  TriangleMesh out;
  out.triangles.reserve(triangles.size());
  out.face.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!is_usable(points, triangles[i], report)) continue;
    out.triangles.push_back(triangles[i]);
    out.face.push_back(face.empty() ? static_cast<std::uint32_t>(i) : face[i]);
  }
  out.points.assign(points.begin(), points.end());
  return out;
}

}  // namespace tandem::build
