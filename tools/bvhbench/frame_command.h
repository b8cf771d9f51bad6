#pragma once
#include "command.h"

namespace tandem::bench {

/// `bvhbench frame`: a state of a simulation as a scene file.
CLI::App* add_frame(CLI::App& app, Run& run_later);

}  // namespace tandem::bench
