#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "reentry.h"
#include "run_file.h"

namespace tandem::simulation {

/// What a run writes while it is under way: OUTPUT.part, which becomes OUTPUT when all steps are made.
std::string part_file(const std::string& output);

struct RunOptions {
  std::string output;
  std::uint32_t steps = 1;             ///< to have made in the end
  std::uint32_t trajectory_every = 0;  ///< 0: no trajectory
  bool resume = false;                 ///< go on from the part file, if there is one
  double checkpoint_seconds = 60;      ///< between two writings of the part file
};

/// Makes the steps and writes the file. SIGINT, SIGTERM and SIGHUP end the process once the step under way is
/// made and the part file written; a process killed otherwise leaves the last part file. Shows its progress
/// where standard error is a terminal. Result: all the run has given. Throws bench::OutputError; with resume
/// bench::FileError; what the contact finder throws.
RunResults run_simulation(Simulator& simulator, const RunDescription& run,
                          const std::optional<Reentry>& reentry, const RunOptions& options);

}  // namespace tandem::simulation
