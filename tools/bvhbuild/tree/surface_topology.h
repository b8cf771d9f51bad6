#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "tandem/formats/topology.h"
#include "tree.h"

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

/// runs_up() of a side of these triangles.
inline bool runs_up(std::span<const TriangleTopology> triangles, std::uint32_t side) {
  return tandem::runs_up(triangles[side / 3], side % 3);
}

/// The topology of a level, as it lies in the file: how its triangles hang together.
struct SurfaceTopology {
  std::vector<TriangleTopology> triangles;   ///< in leaf order
  std::vector<SurfaceComponent> components;  ///< by first triangle
  std::uint32_t vertex_count = 0;
  std::vector<std::uint32_t> point;  ///< of each vertex: the first point of the geometry where it lies
  bool closed = false;               ///< all components are
};

/// Welds corners at the same position, in all poses if there are any, counts the sides of edges, and orients:
/// windings are made to agree across edges of two sides, the larger part of what these join keeping its own;
/// closed components that are inside out are turned, unless they are cavities (a vertex of theirs lies within
/// other closed components). A component that touches others wherever it was looked for such a vertex is
/// none. Nothing is moved: what is turned is marked. The result does not depend on the number of threads.
/// Condition: fewer than kMostTopologyTriangles.
SurfaceTopology make_topology(const Geometry& geometry, const Tree& tree);

}  // namespace tandem::build
