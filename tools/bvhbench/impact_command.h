#pragma once
#include "command.h"

namespace tandem::bench {

/// Registers `bvhbench impact`: when the moving instances of a scene meet, timed. Where it is chosen, `run`
/// is what to do.
CLI::App* add_impact(CLI::App& app, Run& run);

}  // namespace tandem::bench
