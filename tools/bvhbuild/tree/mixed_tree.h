#pragma once
#include <span>

#include "bounds.h"
#include "topology.h"

namespace tandem::build {

/// A tree between the minimal and the free one: the free one, in which small subtrees are minimal, as many as
/// it takes for at most `share` of all nodes to be imaginary, or the minimal one, in which some subtrees are
/// free. Which ones: those where it saves most for an imaginary node. `bounds`: of each triangle,
/// normalized_bounds().
Topology build_mixed_tree(std::span<const Bounds> bounds, double share);

}  // namespace tandem::build
