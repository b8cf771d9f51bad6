#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bvhbuild/levels/ladder.h"
#include "common/exit_code.h"
#include "options.h"
#include "sample_work.h"
#include "statistics/statistics.h"
#include "tandem/build/clean_report.h"

namespace tandem::build {

/// Size and XXH64 of a file's bytes: what `xxhsum -H64` prints. Both zero where the file cannot be read.
struct InputDigest {
  std::uint64_t bytes = 0;
  std::uint64_t hash = 0;
};

/// A level of the file that was written.
struct LevelOutcome {
  std::optional<LevelError> wanted;  ///< what was asked for; none for the finest
  TreeStatistics tree;
  double error_bound = 0;
  double error_bound_relative = 0;  ///< to the diagonal of the finest's bounds; 0 where that is 0
  std::optional<bool> closed;       ///< whether all components are; none without topology
  /// Pairs of triangles that meet without having a corner in common; none: more than kMostSelfContacts.
  std::optional<std::uint64_t> self_contacts;
};

/// An error that was asked for and got no level.
struct LevelLeftOut {
  LevelError wanted;
  NoLevel why;
};

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
  bool refit = false;       ///< the file has what refitting needs
  std::uint64_t file_bytes = 0;
  std::string hash;  ///< of the output, 16 hexadecimal digits

  std::vector<SampleWork> samples;  ///< of the animation or poses that the tree was made for; empty without
  std::vector<InputDigest> poses;   ///< of the files of poses

  std::vector<LevelOutcome> levels;  ///< of the file where some were asked for, the finest first
  std::vector<LevelLeftOut> levels_left_out;
  std::uint64_t fixed_vertices = 0;  ///< that stay in place at every level: surfaces meet there

  struct Seconds {
    double import = 0, clean = 0, build = 0, write = 0;
    double samples = 0;  ///< of `build`: what measuring the tree in all samples took
    double levels = 0;   ///< of `build`: what the levels beyond the finest took
  } seconds;
};

/// import -> clean -> build -> write. Throws std::bad_alloc and, on a defect of the program,
/// std::logic_error; no output then.
Outcome run_pipeline(const Options& options);

}  // namespace tandem::build
