#pragma once
#include "command.h"

namespace tandem::bench {

/// Registers `bvhbench compare`: scenes through Tandem and other libraries, side by side. Where it is chosen,
/// `run` is what to do.
CLI::App* add_compare(CLI::App& app, Run& run);

}  // namespace tandem::bench
