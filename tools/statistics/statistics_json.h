#pragma once
#include "common/json.h"
#include "statistics.h"

namespace tandem {

/// The statistics under the stable keys of docs/json.md.
Json to_json(const TreeStatistics& statistics);

/// Says what the samples are like that a tree was made for, by what provenance has of them. samples: JSON
/// from any file, which may be of any shape.
std::string samples_words(const Json& samples);

}  // namespace tandem
