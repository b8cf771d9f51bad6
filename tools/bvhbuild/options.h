#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bvhbuild/import/import.h"
#include "bvhbuild/levels/ladder.h"
#include "common/exit_code.h"
#include "tandem/build/build_options.h"

namespace tandem::build {

/// The command line of bvhbuild.
struct Options : BuildOptions {
  std::filesystem::path input, output;
  std::vector<LevelError> levels;  ///< the errors of levels beyond the finest
  bool animation = false;          ///< the tree is made for the file's animations
  std::uint32_t samples = 8;       ///< of the animations, the rest pose being one
  std::vector<std::string> poses;  ///< files of the same mesh that the tree is made for too
  ImportOptions import;
  bool strict = false;
  bool json = false;
  bool quiet = false;
};

/// Parses the command line. Nothing to run: prints help, the version or what is wrong, and sets `exit_code`.
std::optional<Options> parse_options(int argc, char** argv, ExitCode& exit_code);

/// Return the names that the command line has: "minimal", "free" or a number; "fast", "default" or "best".
std::string name(Imaginary imaginary);
std::string name(Effort effort);

}  // namespace tandem::build
