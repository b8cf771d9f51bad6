#pragma once
#include "command.h"

namespace tandem::bench {

/// Registers `bvhbench query`: the contacts of a scene, timed. Where it is chosen, `run` is what to do.
CLI::App* add_query(CLI::App& app, Run& run);

}  // namespace tandem::bench
