#pragma once
#include <cstdint>

#include "kernels/common/lane_variant.h"
#include "tandem/formats/view.h"

namespace tandem {

/// The source vertices of the corners of a triangle.
struct CornerSources {
  std::uint32_t of[3];
};

/// The arrays of a tree that is refitted. Blocks lie depth first, with their indices and kinds.
struct RefitTree {
  Block* blocks;
  Triangle* triangles;
  const CornerSources* sources;
  std::uint32_t block_count;
};

/// Moves all corners to the positions of their sources, three numbers each, and makes every box the one that
/// enclose() makes. Where `positions` is null, leaves stay as they are. All ways write the same bytes.
/// Result: the sum of the surfaces of all inner boxes, an eighth of each. It is summed in the order of
/// sum_of().
using Refit = double (*)(const RefitTree& tree, const float* positions);

/// The sum of what was summed for nodes 0, 1, 2 and 3 of all blocks, from the last block to the first.
template <typename Four>
double sum_of(const Four& of_node) {
  return ((of_node[0] + of_node[1]) + of_node[2]) + of_node[3];
}

/// The named way, or null where this machine or this build lacks it.
Refit refit_way(BlockPairVariant variant);

}  // namespace tandem
