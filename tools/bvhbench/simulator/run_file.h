#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "bvhbench/scenes/scene_file.h"
#include "bvhbench/scenes/scene_motion.h"
#include "common/json.h"
#include "simulator.h"

namespace tandem::simulation {

/// States of a run that are kept: those after 0, every, 2 * every, ... steps.
struct Trajectory {
  std::uint32_t every = 0;                         ///< 0: none is kept
  std::vector<std::uint32_t> frame;                ///< steps made before each state
  std::vector<double> position;                    ///< of the centres of mass, bodies x 3 for each state
  std::vector<double> orientation;                 ///< quaternions w x y z, bodies x 4 for each state
  std::vector<double> velocity, angular_velocity;  ///< as position

  void keep(std::uint32_t step, std::span<const BodyState> states);
};

/// The results of a run so far; docs/run_file.md describes the file.
struct RunResults {
  std::vector<StepRecord> records;
  Trajectory trajectory;
  SimulationState state;
};

/// The description of a run, apart from its results.
struct RunDescription {
  Json options;                           ///< name: value; what they say decides the results
  std::vector<std::string> assets;        ///< .bvh paths, relative to the run file
  std::vector<bench::SceneShape> shapes;  ///< of these assets, as the bodies name them
  std::vector<BodyProperties> bodies;
  std::uint64_t triangles = 0;  ///< of the dynamic bodies: what contact_ratio is a ratio to
};

/// Makes the file at the path hold the run, or leaves it as it was. Throws bench::OutputError.
void write_run(const std::string& path, const RunDescription& run, const RunResults& results);

/// Reads the results of a run that is to go on. Throws bench::FileError: no such file, damaged, or of a run
/// with other bodies or options; it names the option.
RunResults read_run(const std::string& path, const RunDescription& expected);

/// A kept state: assets and poses of bodies, as the engine saw them, what moves them, and how they move.
/// Throws bench::FileError: of the file, or where it keeps no such state; it names those that it keeps.
struct StoredFrame {
  std::vector<std::string> assets;   ///< relative to the run file
  std::vector<BodyPose> poses;       ///< of these assets
  std::vector<std::uint32_t> level;  ///< of detail, of each body; none: level 0 of all
  std::vector<Motion> motion;
  bench::SceneMotion moving;
};
StoredFrame read_frame(const std::string& path, std::uint32_t frame);

}  // namespace tandem::simulation
