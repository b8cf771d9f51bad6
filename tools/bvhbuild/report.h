#pragma once
#include "common/report.h"
#include "pipeline.h"

namespace tandem::build {

/// Makes what bvhbuild prints: its text, on success, is a few lines for people; its JSON, on success and on
/// failure, has the keys of docs/json.md.
Report report_of(const Options& options, const Outcome& outcome);

}  // namespace tandem::build
