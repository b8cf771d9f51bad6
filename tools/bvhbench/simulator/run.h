#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "body_mover.h"
#include "run_file.h"
#include "tandem/formats/view.h"

namespace tandem::simulation {

/// Puts bodies that leave a tilted ground back at its top, so that a slide never runs dry. A pure function of
/// seed, step and bodies: nothing to be kept for going on later.
class Reentry {
 public:
  /// `sheet`: asset of the ground's instances, which are the fixed bodies, tilted about the y axis by `tilt`
  /// degrees.
  Reentry(const AssetView& sheet, std::span<const Instance> grounds, double tilt, std::uint64_t seed);

  /// Every body whose centre of mass is no longer above the ground comes to rest above the ground's upper
  /// edge, turned at random, where no bounding sphere of another body is. Result: how many.
  std::uint64_t apply(BodyMover& mover, std::uint64_t step) const;

 private:
  bool has_left(const Vector3& position, double radius) const;
  BodyState entry(const BodyMover& mover, std::uint32_t body, std::uint64_t step) const;

  Matrix3 frame_;          // columns: downhill, across, up from the ground
  Vector3 lower_, upper_;  // of the ground, in that frame
  std::uint64_t seed_;
};

/// Returns the file that a run writes while it is under way: OUTPUT.part, which becomes OUTPUT when all steps
/// are made.
std::string part_file(const std::string& output);

struct RunOptions {
  std::string output;
  std::uint32_t steps = 1;             ///< to have made in the end
  std::uint32_t trajectory_every = 0;  ///< 0: no trajectory
  bool resume = false;                 ///< go on from the part file, if there is one
  double checkpoint_seconds = 10;      ///< between two writings of the part file
};

/// Makes the steps and writes the file. SIGINT, SIGTERM and SIGHUP end the process once the step under way is
/// made and the part file written; a process killed otherwise leaves the last part file. Shows its progress
/// where standard error is a terminal. Result: all the run has given. Throws bench::OutputError;
/// bench::FileError where a step fails, by its number and the body, and of the part file; what the contact
/// finder throws.
RunResults run_simulation(BodyMover& mover, const RunDescription& run, const std::optional<Reentry>& reentry,
                          const RunOptions& options);

}  // namespace tandem::simulation
