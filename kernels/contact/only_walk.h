#pragma once
#include "tandem/kernels/gpu_contact_query.h"

namespace tandem {

/// Says whether the query's calls in mode exact only walk the trees from now on, and count block pairs and
/// candidates: they find no contacts then. This measures what the walk takes of a query's time.
void only_walk(GpuContactQuery& query, bool only);

}  // namespace tandem
