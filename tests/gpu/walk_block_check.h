#pragma once
#include <cstdint>
#include <span>

#include "gpu_query_data.h"

namespace tandem::test {

/// Walk blocks as make_walk_blocks() left them, in CPU memory, all of a query from number 0 on.
struct WalkTree {
  std::uint32_t first, root;
  std::span<const gpu::WalkBlock> blocks;
  std::span<const std::uint32_t> file_blocks;
};

/// Expects one walk block for each block of the tree, numbers that follow each other, boxes that hold their
/// vertices and are no larger than they must be, and frames that fit no worse than the axes of the mesh.
/// Finds what is below a node by the tree alone. Condition: a checked tree in CPU memory.
void expect_walk_blocks(const LevelView& tree, const WalkTree& walk);

}  // namespace tandem::test
