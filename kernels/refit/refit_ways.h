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

/// The surfaces of all boxes of leaves, and of all inner boxes: sums of halves of halves.
struct RefitSurfaces {
  double of_leaves = 0, of_inner = 0;
};

/// Moves all corners to the positions of their sources, three numbers each, and makes every box the one that
/// enclose() makes. Where `positions` is null, leaves stay as they are. All ways write the same bytes.
using Refit = RefitSurfaces (*)(const RefitTree& tree, const float* positions);

/// The named way, or null where this machine or this build lacks it.
Refit refit_way(BlockPairVariant variant);

}  // namespace tandem
