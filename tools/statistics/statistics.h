#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tandem/formats/view.h"
#include "tandem/kernels/pose.h"

namespace tandem {

/// Figures of a tree before it is queried. docs/json.md has their meanings.
struct TreeStatistics {
  std::uint64_t triangles = 0;
  std::uint64_t nodes = 0;  ///< of all kinds
  std::uint64_t leaf_nodes = 0, internal_nodes = 0, imaginary_nodes = 0;
  std::uint64_t imaginary_minimum = 0;  ///< the fewest that a pure tree over this many triangles can have
  double imaginary_fraction = 0;        ///< imaginary_nodes / nodes
  std::uint64_t leaf_blocks = 0, internal_blocks = 0, partial_leaf_blocks = 0;
  std::uint32_t depth = 0;  ///< blocks from the root block to the deepest leaf block, both counted
  double leaf_fill = 0;     ///< leaves / (4 * leaf_blocks)
  double sah_cost = 0;      ///< 1 + sum of the surfaces of internal nodes / surface of the bounds: expected
                            ///< blocks that a random ray visits
  std::vector<std::uint64_t> leaf_blocks_at_depth;  ///< index d: leaf blocks at depth d + 1
  std::uint64_t blocks_with_fill[5] = {};           ///< index n: blocks with n nodes that are not imaginary
};

/// Counts everything in one pass over the blocks. Condition: a checked asset's level and its bounds.
TreeStatistics measure_tree(const LevelView& level, const float* lower, const float* upper);

/// The mean work of a tandem query of a tree against itself, over poses close to first contact.
struct ExpectedWork {
  double block_pairs = 0;   ///< units of 4 x 4 box tests
  double candidates = 0;    ///< leaf pairs whose boxes overlap
  std::uint32_t poses = 0;  ///< 0: no figures; a mesh overlaps itself so much that sampling was given up, or
                            ///< its coordinates are too large for float32 box tests
  /// The work for oriented blocks, as a GPU walks them; none where there are none or sampling was given up.
  struct Oriented {
    double block_pairs = 0, candidates = 0;
  };
  std::optional<Oriented> oriented;
};

/// Samples the first validation poses of seed 1 (near_contact.h). The same mesh always gets the same poses.
ExpectedWork sample_expected_work(const AssetView& asset, std::uint32_t poses = 64);

/// Returns the mean block pairs of a tree at the identity against itself in each of these poses of its file
/// coordinates; nothing where they take more than some 20 million, or are too far away for float32 box tests.
/// Condition: at least one pose.
std::optional<double> mean_block_pairs(const AssetView& asset, std::span<const Pose> poses);

/// Counts what the topology of a level says.
struct SurfaceCounts {
  std::uint64_t vertices = 0, components = 0, closed_components = 0;
  std::uint64_t turned_triangles = 0;
  std::uint64_t boundary_edges = 0;
  std::uint64_t sides_at_edges_of_many = 0;  ///< sides of triangles at edges of more than two
};

/// Counts in one pass over the triangles; nothing where the level has no topology.
std::optional<SurfaceCounts> count_surface(const LevelView& level);

}  // namespace tandem
