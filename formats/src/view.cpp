#include "tandem/formats/view.h"

#include <algorithm>

namespace tandem {

LevelView AssetView::level(std::uint32_t i) const {
  LevelView view;
  const auto* base = reinterpret_cast<const unsigned char*>(header);
  for (const Section& section : sections) {
    if (section.level != first_level + i) continue;
    if (section.kind == SectionKind::blocks)
      view.blocks = reinterpret_cast<const Block*>(base + section.offset);
    if (section.kind == SectionKind::triangles)
      view.triangles = reinterpret_cast<const Triangle*>(base + section.offset);
    if (section.kind == SectionKind::oriented_blocks)
      view.oriented_blocks = reinterpret_cast<const OrientedBlock*>(base + section.offset);
    if (section.kind == SectionKind::topology)
      view.topology = reinterpret_cast<const TriangleTopology*>(base + section.offset);
    if (section.kind == SectionKind::components) {
      view.components = reinterpret_cast<const SurfaceComponent*>(base + section.offset);
      view.component_count = static_cast<std::uint32_t>(section.count);
    }
    if (section.kind == SectionKind::source_vertices)
      view.source_vertices = reinterpret_cast<const std::uint32_t*>(base + section.offset);
  }
  const Level& level = levels[i];
  view.block_count = level.block_count;
  view.triangle_count = level.triangle_count;
  view.leaf_block_count = level.leaf_block_count;
  view.depth = level.depth;
  view.vertex_count = level.vertex_count;
  view.closed = (level.flags & kClosedLevel) != 0;
  view.number = first_level + i;
  view.error_bound = level.error_bound;
  return view;
}

AssetView AssetView::levels_from(std::uint32_t first, std::uint32_t count) const {
  AssetView view = *this;
  view.levels = levels.subspan(first, std::min<std::size_t>(count, levels.size() - first));
  view.first_level = first_level + first;
  return view;
}

// Error bounds ascend.
std::uint32_t AssetView::coarsest_level(double tolerance) const {
  std::uint32_t coarsest = 0;
  while (coarsest + 1 < levels.size() && levels[coarsest + 1].error_bound <= tolerance) ++coarsest;
  return coarsest;
}

}  // namespace tandem
