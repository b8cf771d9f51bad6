#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tandem/formats/block.h"

namespace tandem::build {

/// Where imaginary nodes may be.
enum class Imaginary {
  minimal,  ///< the proven minimum, minimal_imaginary_nodes(); greedy surface-area splits among the legal
            ///< ones
  free,     ///< wherever the cheapest collapse of a free binary tree puts them
};

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

/// Builds the pure 4-ary tree of all triangles, blocks in depth-first order.
/// The result depends on the triangles and `imaginary` alone, not on the number of threads, of which oneTBB
/// gives what it may. Source: surface-area heuristic by full sweeps (Wald 2007); legal splits as in the
/// project's design; collapse by dynamic programming after Wald, Benthin and Boulos 2008. Condition: at least
/// one and fewer than 2^32 - 1 triangles; indices in range; coordinates at most kMaxCoordinate in magnitude.
Tree build_tree(const Geometry& geometry, Imaginary imaginary);

}  // namespace tandem::build
