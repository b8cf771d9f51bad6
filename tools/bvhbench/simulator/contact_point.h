#pragma once
#include <Eigen/Core>
#include <compare>
#include <cstdint>

namespace tandem::simulation {

/// Two bodies, a < b.
struct BodyPair {
  std::uint32_t a, b;

  friend auto operator<=>(const BodyPair&, const BodyPair&) = default;
};

/// A point in which two bodies push against each other: what a solver makes one contact of.
struct ContactPoint {
  std::uint32_t body_a, body_b;  ///< a < b
  Eigen::Vector3d position;      ///< world
  Eigen::Vector3d normal;        ///< unit, from a towards b: pushing b along it separates the bodies
  double depth;                  ///< lengths along the normal; where bodies are apart, less than 0
  std::uint64_t feature;         ///< equal in successive steps for what is the same contact; 0: none, to be
                                 ///< matched by position
};

/// What a contact did in a step: an impulse on b, the opposite one on a.
struct ContactImpulse {
  double normal = 0;                                     ///< along the contact's normal, >= 0
  Eigen::Vector3d tangential = Eigen::Vector3d::Zero();  ///< across it, in the world
  Eigen::Vector3d turning = Eigen::Vector3d::Zero();     ///< what resists turning, in the world; each contact
                                                         ///< of a pair has an equal part
};

}  // namespace tandem::simulation
