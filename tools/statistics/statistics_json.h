#pragma once
#include "common/json.h"
#include "statistics.h"

namespace tandem {

/// The statistics under the stable keys of docs/json.md.
Json to_json(const TreeStatistics& statistics);

}  // namespace tandem
