#include "polygons.h"

#include <map>
#include <utility>

namespace tandem::build {

std::int64_t twice_area(const GridPoint& a, const GridPoint& b, const GridPoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

std::int64_t twice_area(const GridPolygon& polygon) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const GridPoint& a = polygon[i];
    const GridPoint& b = polygon[(i + 1) % polygon.size()];
    sum += a.x * b.y - b.x * a.y;
  }
  return sum;
}

void add_face(PolygonMesh& mesh, std::initializer_list<std::uint32_t> corners) {
  mesh.corners.insert(mesh.corners.end(), corners);
  mesh.face_begin.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
}

PolygonMesh flat_face(const GridPolygon& polygon) {
  PolygonMesh mesh;
  for (const GridPoint& p : polygon) {
    mesh.corners.push_back(static_cast<std::uint32_t>(mesh.points.size()));
    mesh.points.push_back({static_cast<double>(p.x), static_cast<double>(p.y), 0});
  }
  mesh.face_begin.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
  return mesh;
}

bool tiles(const std::vector<TriangleIndices>& triangles, const GridPolygon& polygon) {
  const std::int64_t area = twice_area(polygon);
  std::int64_t sum = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const TriangleIndices& t : triangles) {
    const std::int64_t piece = twice_area(polygon[t[0]], polygon[t[1]], polygon[t[2]]);
    if (piece == 0 || (piece > 0) != (area > 0)) return false;
    sum += piece;
    for (int k = 0; k < 3; ++k) {
      if (++balance[{t[k], t[(k + 1) % 3]}] > 1) return false;
    }
  }
  for (std::uint32_t i = 0; i < polygon.size(); ++i) {
    const auto next = static_cast<std::uint32_t>((i + 1) % polygon.size());
    if (balance[{i, next}] != 1 || balance.contains({next, i})) return false;
    balance.erase({i, next});
  }
  for (const auto& [edge, count] : balance)
    if (!balance.contains({edge.second, edge.first})) return false;
  return sum == area;
}

}  // namespace tandem::build
