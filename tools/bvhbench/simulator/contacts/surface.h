#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tandem/formats/view.h"

namespace tandem::simulation {

/// How the triangles of a mesh hang together: corners at the same stored position share a vertex.
struct Surface {
  /// Two vertices that one triangle or more have in common, lower < upper.
  struct Edge {
    std::uint32_t lower, upper;
    std::uint32_t triangles;  ///< that have it
  };

  /// The triangles are those of the level, in its order.
  std::vector<std::array<float, 3>> position;         ///< of each vertex, stored coordinates
  std::vector<std::array<std::uint32_t, 3>> corner;   ///< vertices of each triangle
  std::vector<std::array<std::uint32_t, 3>> edge_of;  ///< edges of each triangle; k joins corners k, k + 1
  std::vector<Edge> edge;
  std::vector<std::uint32_t> fan_begin, fan;      ///< triangles around vertex v: fan[fan_begin[v]] to ...
  std::vector<std::uint32_t> spoke_begin, spoke;  ///< edges at vertex v, likewise
  std::vector<std::uint8_t> turned;               ///< of each triangle: its winding is against the rest's
  std::uint32_t components = 0;

  std::uint64_t boundary_edges = 0;  ///< of an odd number of triangles
  std::uint64_t contradicting_edges =
      0;                                ///< that triangles do not run along in both directions equally often
  std::uint64_t turned_components = 0;  ///< inside out as a whole
  std::uint64_t turned_triangles = 0;   ///< beside the rest of their component, so that windings agree
  bool orientable = true;               ///< windings agree, once what is marked as turned is
  bool closed = true;                   ///< every edge is run along equally often in both directions, then

  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(position.size()); }
  std::uint32_t triangle_count() const { return static_cast<std::uint32_t>(corner.size()); }
  std::span<const std::uint32_t> around(std::uint32_t vertex) const {
    return std::span(fan).subspan(fan_begin[vertex], fan_begin[vertex + 1] - fan_begin[vertex]);
  }
  std::span<const std::uint32_t> edges_at(std::uint32_t vertex) const {
    return std::span(spoke).subspan(spoke_begin[vertex], spoke_begin[vertex + 1] - spoke_begin[vertex]);
  }
};

/// The surface of a level with topology, from which come vertices and what is turned. Throws
/// std::runtime_error where the level has none.
Surface make_surface(const LevelView& level);

}  // namespace tandem::simulation
