#pragma once
#include "tandem/formats/block.h"
#include "tree.h"

namespace tandem::build {

/// Writes a leaf block for the triangles order[first .. first + count); in the file they will be numbers
/// first, first + 1, ...
void emit_leaf_block(Block& block, const Geometry& geometry, const std::uint32_t* order, std::uint32_t first,
                     std::uint32_t count);

/// Writes node `node` of an internal block whose child block is complete.
void emit_internal_node(std::vector<Block>& blocks, std::uint32_t block, int node, std::uint32_t child);

/// Fills in depth and leaf_block_count from the blocks. Condition: children come after their parents.
void measure(Tree& tree);

/// Whether a group of n triangles at this depth must be split evenly from here on, so that the tree ends
/// above kMaxDepth. Even splits at least halve a group, give or take the few positions to the nearest legal
/// one, at each level.
bool must_split_evenly(std::uint32_t depth, std::uint32_t n);

}  // namespace tandem::build
