#pragma once
#include <Eigen/Core>
#include <cstdint>

namespace tandem::simulation {

/// A point in which two bodies push against each other: what a solver makes one contact of.
struct ContactPoint {
  std::uint32_t body_a, body_b;  ///< a < b
  Eigen::Vector3d position;      ///< world
  Eigen::Vector3d normal;        ///< unit, from a towards b: pushing b along it separates the bodies
  double depth;                  ///< >= 0, lengths along the normal
  std::uint64_t feature;         ///< equal in successive steps for what is the same contact; 0: none, to be
                                 ///< matched by position
};

}  // namespace tandem::simulation
