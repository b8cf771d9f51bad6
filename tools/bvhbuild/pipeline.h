#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "bvhbuild/meshing/clean_report.h"
#include "common/exit_code.h"
#include "input_digest.h"
#include "options.h"
#include "statistics/statistics.h"

namespace tandem::build {

/// Everything that a report tells of one run.
struct Outcome {
  ExitCode exit_code = kDone;
  std::string error;  ///< with the file that it speaks of: "cow.obj: line 12: ..."; empty when done

  InputDigest input;
  std::string reader;
  bool single_precision = false;
  std::vector<std::string> remarks;
  CleanReport clean;
  std::uint64_t parts = 0;
  double origin[3] = {};
  double rounding_error = 0;
  bool interrupted = false;  ///< Ctrl-C ended the optimisation; the tree is the best until then
  TreeStatistics tree;
  bool gpu_blocks = false;  ///< the file has oriented blocks
  bool topology = false;    ///< the file has topology
  std::uint64_t file_bytes = 0;
  std::string hash;  ///< of the output, 16 hexadecimal digits

  struct Seconds {
    double import = 0, clean = 0, build = 0, write = 0;
  } seconds;
};

/// import -> clean -> build -> write. Throws std::bad_alloc and, on a defect of the program,
/// std::logic_error; no output then.
Outcome run_pipeline(const Options& options);

}  // namespace tandem::build
