#pragma once
#include "command.h"

namespace tandem::bench {

/// `bvhbench distance`: how near the bodies of a scene are.
CLI::App* add_distance(CLI::App& app, Run& run_later);

}  // namespace tandem::bench
