#pragma once
#include <vector>

#include "tandem/formats/oriented_block.h"
#include "tree.h"

namespace tandem::build {

/// The oriented blocks of a tree, in the order in which they lie in the file: for each block a frame that
/// fits the triangles below it, searched for as long as `effort` says, and in that frame the boxes of its
/// nodes. The result does not depend on the number of threads. Condition: fewer than kMostOrientedTriangles.
std::vector<OrientedBlock> orient_blocks(const Geometry& geometry, const Tree& tree, Effort effort);

}  // namespace tandem::build
