#pragma once
#include <span>

#include "bounds.h"
#include "tandem/build/effort.h"
#include "topology.h"

namespace tandem::build {

/// Exchanges children of blocks so that tandem queries visit fewer of them. The number of imaginary nodes
/// stays as it is; the sum of visit_cost() never grows. The result does not depend on the number of threads.
/// `bounds`: of each triangle, normalized_bounds(). Effort::fast changes nothing.
void optimise(Topology& topology, std::span<const Bounds> bounds, Effort effort, OptimisationWatch& watch);

}  // namespace tandem::build
