#pragma once
#include "command.h"

namespace tandem::bench {

/// `bvhbench simulate`: bodies moved step by step, and what that took.
CLI::App* add_simulate(CLI::App& app, Run& run_later);

}  // namespace tandem::bench
