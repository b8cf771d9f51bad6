#include "emit.h"

#include <algorithm>
#include <bit>

#include "tandem/formats/box.h"

namespace tandem::build {

namespace {

Box box_of_triangle(const Geometry& geometry, std::uint32_t triangle) {
  const auto& corners = geometry.triangles[triangle];
  Position lo, hi;
  for (int k = 0; k < 3; ++k) {
    const float a = geometry.points[corners[0]][k], b = geometry.points[corners[1]][k],
                c = geometry.points[corners[2]][k];
    lo[k] = std::min({a, b, c});
    hi[k] = std::max({a, b, c});
  }
  return enclose(lo, hi);
}

}  // namespace

void emit_leaf_block(Block& block, const Geometry& geometry, const std::uint32_t* order, std::uint32_t first,
                     std::uint32_t count) {
  for (std::uint32_t i = 0; i < kNodesPerBlock; ++i) {
    if (i < count) {
      set_node(block, static_cast<int>(i), box_of_triangle(geometry, order[first + i]), first + i,
               NodeKind::leaf);
    } else {
      set_imaginary(block, static_cast<int>(i));
    }
  }
}

void emit_internal_node(std::vector<Block>& blocks, std::uint32_t block, int node, std::uint32_t child) {
  set_node(blocks[block], node, enclose(blocks[child]), child, NodeKind::internal);
}

void measure(Tree& tree) {
  std::vector<std::uint8_t> depth(tree.blocks.size(), 1);
  tree.leaf_block_count = 0;
  tree.depth = 1;
  for (std::size_t b = 0; b < tree.blocks.size(); ++b) {
    const Block& block = tree.blocks[b];
    tree.depth = std::max<std::uint32_t>(tree.depth, depth[b]);
    tree.leaf_block_count += block.is_leaf_block();
    for (int i = 0; i < kNodesPerBlock && block.kind[i] == NodeKind::internal; ++i) {
      depth[block.index[i]] = static_cast<std::uint8_t>(depth[b] + 1);
    }
  }
}

bool must_split_evenly(std::uint32_t depth, std::uint32_t n) {
  constexpr std::uint32_t kReserve = 4;
  return depth + static_cast<std::uint32_t>(std::bit_width(n)) + kReserve >= kMaxDepth;
}

}  // namespace tandem::build
