#include "triangle_mesh.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tandem/formats/box.h"

namespace tandem::build {
namespace {

bool drop(std::uint64_t& count) {
  ++count;
  return false;
}

}  // namespace

bool is_usable(std::span<const Point> points, std::span<const std::uint32_t> corners, CleanReport& report) {
  for (const std::uint32_t corner : corners)
    if (corner >= points.size()) return drop(report.faces_index_out_of_range);
  if (corners.size() < 3) return drop(report.faces_too_few_corners);
  bool finite = true;
  bool small = true;
  for (const std::uint32_t corner : corners)
    for (const double x : points[corner]) {
      finite &= std::isfinite(x);
      small &= std::abs(x) <= double{kMaxCoordinate};
    }
  if (!finite) return drop(report.faces_not_finite);
  return small || drop(report.faces_too_large);
}

std::uint64_t count_unreferenced(std::size_t points, std::span<const std::uint32_t> corners) {
  std::vector<bool> referenced(points, false);
  for (const std::uint32_t corner : corners)
    if (corner < points) referenced[corner] = true;
  return static_cast<std::uint64_t>(std::count(referenced.begin(), referenced.end(), false));
}

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
