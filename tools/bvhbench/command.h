#pragma once
#include <CLI/CLI.hpp>
#include <functional>

#include "bvhbench/scenes/scene_file.h"
#include "common/exit_code.h"
#include "common/option_helpers.h"

/// What the subcommands of bvhbench share.
namespace tandem::bench {

/// What a parsed command line asks for; main() runs it. Throws UsageError, FileError, OutputError.
using Run = std::function<ExitCode()>;

/// Throws what a status other than kOk of a query of a scene file calls for. `where`: the instance or pair
/// that is to blame.
[[noreturn]] void refuse(const std::string& scene, Status status, std::uint64_t where);

/// The scene file and its assets, as paths from here.
std::vector<std::string> files_of(const std::string& path, const LoadedScene& scene);

/// Of all instances together.
std::uint64_t triangles_of(const LoadedScene& scene);

/// Refuses what is no cube of a whole number.
CLI::Validator cube_of_a_whole_number();

}  // namespace tandem::bench
