#pragma once
#include <string>

#include "pipeline.h"

namespace tandem::build {

/// What bvhbuild prints on success: a few lines for people.
std::string text_report(const Options& options, const Outcome& outcome);

/// What bvhbuild --json prints, on success and on failure. Keys in docs/json.md.
std::string json_report(const Options& options, const Outcome& outcome);

}  // namespace tandem::build
