#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "tandem/formats/topology.h"

namespace tandem::build {

/// The edges of a mesh and the sides that each of them has. Side 3 t + k is side k of triangle t.
class SurfaceEdges {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  explicit SurfaceEdges(std::span<const TriangleTopology> triangles);

  std::uint32_t count() const { return static_cast<std::uint32_t>(first_.size() - 1); }

  /// The edge of a side, or kNone where its ends are one vertex.
  std::uint32_t edge_of(std::uint32_t side) const { return edge_[side]; }

  /// The sides of an edge, ascending.
  std::span<const std::uint32_t> sides_of(std::uint32_t edge) const {
    return std::span(sides_).subspan(first_[edge], first_[edge + 1] - first_[edge]);
  }

 private:
  std::vector<std::uint32_t> edge_, first_, sides_;
};

/// Whether a side runs from its lower to its upper vertex, once its triangle is turned where it is marked.
inline bool runs_up(std::span<const TriangleTopology> triangles, std::uint32_t side) {
  const TriangleTopology& triangle = triangles[side / 3];
  return (triangle.vertex[side % 3] < triangle.vertex[(side + 1) % 3]) != is_turned(triangle.flags);
}

}  // namespace tandem::build
