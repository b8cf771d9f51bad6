#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tandem/build/build_options.h"
#include "tandem/formats/block.h"
#include "tandem/formats/oriented_block.h"

namespace tandem::build {

/// The blocks of one level of detail, as they will lie in the file, and the order in which its triangles must
/// lie: triangle t of the file is triangle order[t] of the input.
struct Tree {
  std::vector<Block> blocks;
  std::vector<std::uint32_t> order;
  std::uint32_t leaf_block_count = 0;
  std::uint32_t depth = 0;
};

using StoredPoints = std::vector<std::array<float, 3>>;

/// The triangles that a tree is built over: vertex indices into float32 points, relative to the asset's
/// origin. Where they move, the tree is made for the mean over the points and all poses.
struct Geometry {
  std::span<const std::array<float, 3>> points;
  std::span<const std::array<std::uint32_t, 3>> triangles;
  std::span<const StoredPoints> poses{};  ///< where the points are in other samples of an animation

  /// The triangles in one sample, 0 being that of `points`. Condition: number <= poses.size().
  Geometry sample(std::size_t number) const {
    return {number == 0 ? points : std::span<const std::array<float, 3>>(poses[number - 1]), triangles};
  }
};

/// The bounds of the corners of all triangles; empty where there is none.
struct CornerBounds {
  std::array<float, 3> lower, upper;

  double diagonal() const;
};

CornerBounds corner_bounds(const Geometry& geometry);

/// Estimates which shares of the time of a build of a million triangles are done after each of its steps.
struct BuildShares {
  double split, optimised, emitted, topology;
};

constexpr BuildShares build_shares(Effort effort) {
  if (effort == Effort::fast) return {0.45, 0.45, 0.52, 0.8};
  return effort == Effort::standard ? BuildShares{0.25, 0.45, 0.5, 0.87}
                                    : BuildShares{0.01, 0.98, 0.98, 0.995};
}

/// Builds the pure 4-ary tree of all triangles, blocks in depth-first order, and optimises it.
/// The result depends on the triangles, `imaginary` and `effort` alone, not on the number of threads
/// (and on watch.stop, if somebody sets it). Condition: at least one and fewer
/// than 2^32 - 1 triangles; indices in range; coordinates at most kMaxCoordinate in magnitude.
Tree build_tree(const Geometry& geometry, Imaginary imaginary = Imaginary::minimal,
                Effort effort = Effort::standard);
Tree build_tree(const Geometry& geometry, Imaginary imaginary, Effort effort, OptimisationWatch& watch);

/// Returns the tree with its boxes made anew, around the triangles where the geometry's points have them.
Tree refitted(const Geometry& geometry, const Tree& tree);

/// The oriented blocks of a tree, in the order in which they lie in the file: for each block a frame that
/// fits the triangles below it, searched for as long as `effort` says, and in that frame the boxes of its
/// nodes. The result does not depend on the number of threads. Condition: fewer than kMostOrientedTriangles.
std::vector<OrientedBlock> orient_blocks(const Geometry& geometry, const Tree& tree, Effort effort);

}  // namespace tandem::build
