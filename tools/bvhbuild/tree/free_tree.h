#pragma once
#include <span>

#include "bounds.h"
#include "topology.h"

namespace tandem::build {

/// The cheapest collapse of a free binary tree, with imaginary nodes wherever they fall, blocks in
/// depth-first order. `bounds`: of each triangle, normalized_bounds(). Source: surface-area heuristic (Wald
/// 2007), collapse by dynamic programming after Wald, Benthin and Boulos 2008.
Topology build_free_tree(std::span<const Bounds> bounds);

}  // namespace tandem::build
