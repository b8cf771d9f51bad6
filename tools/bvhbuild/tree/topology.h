#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "tandem/formats/block.h"

namespace tandem::build {

/// Which children a block has, before boxes and places in memory are known.
struct TopologyBlock {
  std::array<std::uint32_t, kNodesPerBlock> child{};  ///< triangles of the input, or blocks; `count` of them
  std::uint8_t count = 0;
  bool is_leaf_block = false;
};

/// A tree under construction. Block 0 is the root; children may come before or after their parents.
using Topology = std::vector<TopologyBlock>;

}  // namespace tandem::build
