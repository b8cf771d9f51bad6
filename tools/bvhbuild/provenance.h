#pragma once
#include <string>

#include "pipeline.h"

namespace tandem::build {

/// The provenance section of a file: input, its hash, options that shape the tree, tool, what cleaning met.
/// Nothing that varies from run to run or with the number of threads, so that the same input gives the same
/// bytes. Keys in docs/json.md.
std::string provenance_json(const Options& options, const Outcome& outcome);

}  // namespace tandem::build
