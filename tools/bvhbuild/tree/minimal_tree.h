#pragma once
#include <span>

#include "bounds.h"
#include "topology.h"

namespace tandem::build {

/// The tree with the fewest imaginary nodes, by greedy surface-area splits among the legal ones, blocks in
/// depth-first order. `bounds`: of each triangle, normalized_bounds(). Source: surface-area heuristic by full
/// sweeps (Wald 2007); legal splits as in the project's design.
Topology build_minimal_tree(std::span<const Bounds> bounds);

}  // namespace tandem::build
