#pragma once
#include <cmath>
#include <cstdint>

#include "tandem/formats/status.h"
#include "tandem/kernels/detail/interval.h"
#include "tandem/kernels/manifold.h"
#include "tandem/kernels/world_box.h"

/// What options may be, by one rule for CPU and GPU. The status of an option that may not be so names it.
namespace tandem {

/// A reach of object pairs or of distances; it may be infinite. Result: kOk or kBadReach.
TANDEM_HD inline Status check_reach(double reach) {
  return reach >= 0 ? Status::kOk : Status::kBadReach;
}

/// A distance within which triangles count as contacts. Result: kOk or kBadReach.
inline Status check_within(double within) {
  return within >= 0 && within <= kLargestWorldCoordinate ? Status::kOk : Status::kBadReach;
}

/// Result: kOk, kBadTolerance or kBadReach.
inline Status check_distance_options(const DistanceTolerance& tolerance, double reach) {
  return tolerance.absolute >= 0 && tolerance.relative >= 0 ? check_reach(reach) : Status::kBadTolerance;
}

/// The tolerance of verdicts. Result: kOk or kBadTolerance.
inline Status check_level_tolerance(double tolerance) {
  return tolerance >= 0 && tolerance <= kLargestWorldCoordinate ? Status::kOk : Status::kBadTolerance;
}

/// Result: kOk, kBadDuration or kBadTolerance.
inline Status check_impact_options(double duration, double tolerance) {
  if (!(duration >= 0 && std::isfinite(duration))) return Status::kBadDuration;
  return tolerance >= 0 && std::isfinite(tolerance) ? Status::kOk : Status::kBadTolerance;
}

/// The most points of a manifold. Result: kOk or kBadOption.
inline Status check_most_points(std::uint32_t most_points) {
  return most_points >= 1 && most_points <= kMostManifoldPoints ? Status::kOk : Status::kBadOption;
}

}  // namespace tandem
