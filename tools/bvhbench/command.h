#pragma once
#include <CLI/CLI.hpp>
#include <functional>

#include "common/exit_code.h"
#include "common/option_helpers.h"

/// What the subcommands of bvhbench share.
namespace tandem::bench {

/// What a parsed command line asks for; main() runs it. Throws UsageError, FileError, OutputError.
using Run = std::function<ExitCode()>;

/// Refuses what is no cube of a whole number.
CLI::Validator cube_of_a_whole_number();

}  // namespace tandem::bench
