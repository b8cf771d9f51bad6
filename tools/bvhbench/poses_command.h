#pragma once
#include "command.h"

namespace tandem::bench {

/// Registers `bvhbench poses`: measures trees by the work of queries near contact. Where it is chosen, `run`
/// is what to do.
CLI::App* add_poses(CLI::App& app, Run& run);

}  // namespace tandem::bench
