#pragma once
#include "command.h"

namespace tandem::bench {

/// Registers `bvhbench scene KIND`: makes scene files. Where it is chosen, `run` is what to do.
CLI::App* add_scene(CLI::App& app, Run& run);

}  // namespace tandem::bench
