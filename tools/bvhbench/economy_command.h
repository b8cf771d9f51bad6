#pragma once
#include "command.h"

namespace tandem::bench {

/// `bvhbench economy`: says which levels of detail are enough for a scene.
CLI::App* add_economy(CLI::App& app, Run& run_later);

}  // namespace tandem::bench
