#pragma once
#include <span>

#include "bounds.h"
#include "topology.h"

namespace tandem::build {

/// A tree between the minimal and the free one: that of build_minimal_tree(), in which small subtrees are
/// replaced by free ones where these save most for an imaginary node more, until `share` of all nodes would
/// be imaginary, or nothing more is to be saved so. `bounds`: of each triangle, normalized_bounds().
Topology build_mixed_tree(std::span<const Bounds> bounds, double share);

}  // namespace tandem::build
