#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tandem/build/build_options.h"
#include "tandem/formats/block.h"

namespace tandem::build {

/// The blocks of one level of detail, as they will lie in the file, and the order in which its triangles must
/// lie: triangle t of the file is triangle order[t] of the input.
struct Tree {
  std::vector<Block> blocks;
  std::vector<std::uint32_t> order;
  std::uint32_t leaf_block_count = 0;
  std::uint32_t depth = 0;
};

/// The triangles that a tree is built over: vertex indices into float32 points, relative to the asset's
/// origin.
struct Geometry {
  std::span<const std::array<float, 3>> points;
  std::span<const std::array<std::uint32_t, 3>> triangles;
};

/// Builds the pure 4-ary tree of all triangles, blocks in depth-first order, and optimises it.
/// The result depends on the triangles, `imaginary` and `effort` alone, not on the number of threads
/// (and on watch.stop, if somebody sets it). Condition: at least one and fewer
/// than 2^32 - 1 triangles; indices in range; coordinates at most kMaxCoordinate in magnitude.
Tree build_tree(const Geometry& geometry, Imaginary imaginary = Imaginary::minimal,
                Effort effort = Effort::standard);
Tree build_tree(const Geometry& geometry, Imaginary imaginary, Effort effort, OptimisationWatch& watch);

}  // namespace tandem::build
