#pragma once
#include <cstdint>
#include <vector>

#include "working_tree.h"

namespace tandem::build {

/// A subtree that one thread improves by itself.
struct Region {
  std::uint32_t root = 0;
  std::uint32_t depth = 1;            ///< of the root; 1 for that of the tree
  std::vector<Child> children;        ///< what may change places: all below the root, blocks first
  std::vector<std::uint32_t> blocks;  ///< all of them, the root first
};

/// Cuts a tree into subtrees of at most `most_triangles` triangles, as large as may be, which depends on the
/// tree alone. The blocks above them, with the subtrees' roots as their children, are the last region.
std::vector<Region> cut_into_regions(const WorkingTree& tree, std::uint32_t most_triangles);

}  // namespace tandem::build
