#pragma once
#include "topology.h"
#include "tree.h"

namespace tandem::build {

/// Gives a tree boxes and an order in memory: blocks depth-first, triangles as its leaves come.
Tree emit(const Geometry& geometry, const Topology& topology);

}  // namespace tandem::build
