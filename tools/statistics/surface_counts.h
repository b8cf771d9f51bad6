#pragma once
#include <cstdint>
#include <optional>

#include "tandem/formats/view.h"

namespace tandem {

/// What the topology of a level says.
struct SurfaceCounts {
  std::uint64_t vertices = 0, components = 0, closed_components = 0;
  std::uint64_t turned_triangles = 0;
  std::uint64_t boundary_edges = 0;
  std::uint64_t sides_at_edges_of_many = 0;  ///< sides of triangles at edges of more than two
};

/// Counts in one pass over the triangles; nothing where the level has no topology.
std::optional<SurfaceCounts> count_surface(const LevelView& level);

}  // namespace tandem
