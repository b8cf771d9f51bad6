#include "statistics.h"

#include "tandem/formats/box.h"
#include "tandem/formats/topology.h"

namespace tandem {
namespace {

double half_surface(double x, double y, double z) {
  return x * y + y * z + z * x;
}

double half_surface(const Box& box) {
  const float* h = box.half_extent;
  return 4 * half_surface(h[0], h[1], h[2]);
}

void count_block(const Block& block, TreeStatistics& statistics, double& surface) {
  int real = 0, leaves = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const NodeKind kind = block.kind[i];
    real += kind != NodeKind::imaginary;
    leaves += kind == NodeKind::leaf;
    if (kind == NodeKind::internal) surface += half_surface(box_of(block, i));
  }
  statistics.leaf_nodes += leaves;
  statistics.internal_nodes += real - leaves;
  statistics.imaginary_nodes += kNodesPerBlock - real;
  statistics.leaf_blocks += leaves == real;
  statistics.internal_blocks += leaves == 0;
  statistics.partial_leaf_blocks += leaves != 0 && leaves != real;
  ++statistics.blocks_with_fill[real];
}

}  // namespace

TreeStatistics measure_tree(const LevelView& level, const float* lower, const float* upper) {
  TreeStatistics statistics;
  statistics.triangles = level.triangle_count;
  statistics.nodes = std::uint64_t{kNodesPerBlock} * level.block_count;
  statistics.imaginary_minimum = minimal_imaginary_nodes(level.triangle_count);
  statistics.depth = level.depth;
  statistics.leaf_blocks_at_depth.resize(level.depth);
  std::vector<std::uint8_t> depth(level.block_count, 0);
  double surface = 0;
  for (std::uint32_t b = 0; b < level.block_count; ++b) {
    const Block& block = level.blocks[b];
    count_block(block, statistics, surface);
    if (block.is_leaf_block()) ++statistics.leaf_blocks_at_depth[depth[b]];
    for (int i = 0; i < kNodesPerBlock && block.kind[i] == NodeKind::internal; ++i) {
      depth[block.index[i]] = static_cast<std::uint8_t>(depth[b] + 1);
    }
  }
  statistics.imaginary_fraction =
      static_cast<double>(statistics.imaginary_nodes) / static_cast<double>(statistics.nodes);
  statistics.leaf_fill = static_cast<double>(statistics.leaf_nodes) /
                         static_cast<double>(kNodesPerBlock * statistics.leaf_blocks);
  const double root =
      half_surface(static_cast<double>(upper[0]) - lower[0], static_cast<double>(upper[1]) - lower[1],
                   static_cast<double>(upper[2]) - lower[2]);
  statistics.sah_cost = 1 + (root > 0 ? surface / root : 0);
  return statistics;
}

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
