#pragma once
#include <cstdint>
#include <string>

#include "command.h"

namespace tandem::bench {

/// What `bvhbench query --tolerance` was asked for.
struct ToleranceArguments {
  std::string scene, out, backend;
  double tolerance;
  std::uint32_t threads, repeats;
  bool json;
};

/// Finds what is certain of the pairs of a scene, whose bodies stand for all their levels, and prints it.
ExitCode run_tolerance(const ToleranceArguments& arguments);

}  // namespace tandem::bench
