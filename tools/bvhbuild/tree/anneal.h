#pragma once
#include <cstdint>

#include "exchange_search.h"
#include "region.h"
#include "tandem/build/effort.h"

namespace tandem::build {

/// Improves a region by simulated annealing: random exchanges between neighbours, which are also made where
/// they cost a little, less and less of it as time goes on. Ends with passes of the search. The region is
/// left as it was where that did not make it cheaper, or where it was stopped too early to. Source:
/// Kirkpatrick, Gelatt and Vecchi 1983.
void anneal(WorkingTree& tree, ExchangeSearch& search, const Region& region, std::uint32_t trials_per_child,
            OptimisationWatch& watch);

}  // namespace tandem::build
