#include "surface_counts.h"

#include "tandem/formats/topology.h"

namespace tandem {

std::optional<SurfaceCounts> count_surface(const LevelView& level) {
  if (level.topology == nullptr) return std::nullopt;
  SurfaceCounts counts;
  counts.vertices = level.vertex_count;
  counts.components = level.component_count;
  for (std::uint32_t c = 0; c < level.component_count; ++c)
    counts.closed_components += is_closed(level.components[c]);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    const std::uint32_t flags = level.topology[t].flags;
    counts.turned_triangles += is_turned(flags);
    for (int k = 0; k < 3; ++k) {
      counts.boundary_edges += is_boundary(flags, k);
      counts.sides_at_edges_of_many += has_many_triangles(flags, k);
    }
  }
  return counts;
}

}  // namespace tandem
