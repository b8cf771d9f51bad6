#pragma once
#include <cstdint>
#include <vector>

#include "simulator.h"
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
  std::uint64_t apply(Simulator& simulator, std::uint64_t step) const;

 private:
  bool has_left(const Eigen::Vector3d& position, double radius) const;
  BodyState entry(const Simulator& simulator, std::uint32_t body, std::uint64_t step) const;

  Eigen::Matrix3d frame_;          // columns: downhill, across, up from the ground
  Eigen::Vector3d lower_, upper_;  // of the ground, in that frame
  std::uint64_t seed_;
};

}  // namespace tandem::simulation
