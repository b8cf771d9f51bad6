#include "mesh.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace tandem::makeassets {
namespace {

class Midpoints {
 public:
  explicit Midpoints(std::vector<Point>& points) : points_(points) {}

  std::uint32_t between(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t edge = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    const auto [entry, is_new] = index_.try_emplace(edge, static_cast<std::uint32_t>(points_.size()));
    if (is_new) {
      const Point p = points_[a], q = points_[b];
      points_.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
    }
    return entry->second;
  }

 private:
  std::vector<Point>& points_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
};

}  // namespace

Mesh midpoint_subdivision(const Mesh& mesh) {
  Mesh fine{mesh.points, {}};
  fine.triangles.reserve(4 * mesh.triangles.size());
  Midpoints midpoints(fine.points);
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = midpoints.between(a, b);
    const std::uint32_t bc = midpoints.between(b, c);
    const std::uint32_t ca = midpoints.between(c, a);
    fine.triangles.insert(fine.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return fine;
}

void snap_to_grid(Mesh& mesh, double per_metre) {
  for (Point& p : mesh.points)
    for (double& x : p) x = std::nearbyint(x * per_metre) / per_metre;
}

Mesh unit_cube() {
  Mesh cube;
  // Corner i lies on the upper side of axis k when bit k of i is set.
  for (unsigned i = 0; i < 8; ++i)
    cube.points.push_back({(i & 1) ? 0.5 : -0.5, (i & 2) ? 0.5 : -0.5, (i & 4) ? 0.5 : -0.5});
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kSides = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& [a, b, c, d] : kSides) cube.triangles.insert(cube.triangles.end(), {{a, b, c}, {a, c, d}});
  return cube;
}

}  // namespace tandem::makeassets
