#include "surface_edges.h"

#include <algorithm>

#include "parallel/parallel.h"

namespace tandem::build {
namespace {

struct Side {
  std::uint32_t lower, upper, side;

  bool operator<(const Side& other) const {
    if (lower != other.lower) return lower < other.lower;
    return upper != other.upper ? upper < other.upper : side < other.side;
  }
};

}  // namespace

SurfaceEdges::SurfaceEdges(std::span<const TriangleTopology> triangles) : edge_(3 * triangles.size(), kNone) {
  std::vector<Side> sides;
  sides.reserve(edge_.size());
  for (std::uint32_t side = 0; side < edge_.size(); ++side) {
    const auto& vertex = triangles[side / 3].vertex;
    const std::uint32_t u = vertex[side % 3], v = vertex[(side + 1) % 3];
    if (u != v) sides.push_back({std::min(u, v), std::max(u, v), side});
  }
  parallel::sort(sides.begin(), sides.end(), 1 << 15);
  sides_.reserve(sides.size());
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (i == 0 || sides[i].lower != sides[i - 1].lower || sides[i].upper != sides[i - 1].upper)
      first_.push_back(static_cast<std::uint32_t>(i));
    edge_[sides[i].side] = static_cast<std::uint32_t>(first_.size() - 1);
    sides_.push_back(sides[i].side);
  }
  first_.push_back(static_cast<std::uint32_t>(sides.size()));
}

}  // namespace tandem::build
