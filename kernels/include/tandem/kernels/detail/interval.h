#pragma once
#include "tandem/formats/platform.h"

namespace tandem {

/// Says how wide the interval of a distance may be: upper - lower <= max(absolute, relative * upper). Neither
/// is negative. A relative one below kFinestRelative counts as that, unless an absolute one is met.
struct DistanceTolerance {
  double absolute = 0;  ///< in units of length
  double relative = 1e-6;
};

inline constexpr double kFinestRelative = 0x1p-48;

/// lower <= distance <= upper; 0, 0 exactly where the sets meet.
struct DistanceInterval {
  double lower, upper;
};

/// The widest interval that is allowed below this upper bound.
TANDEM_HD inline double allowed_width(const DistanceTolerance& tolerance, double upper) {
  const double relative =
      upper * (tolerance.relative > kFinestRelative ? tolerance.relative : kFinestRelative);
  return relative > tolerance.absolute ? relative : tolerance.absolute;
}

TANDEM_HD inline bool is_narrow(const DistanceInterval& interval, const DistanceTolerance& tolerance) {
  return interval.upper - interval.lower <= allowed_width(tolerance, interval.upper);
}

/// Returns how near a pair must be to count beside an upper bound: nearer than this. What may touch counts,
/// whatever the tolerance.
///
/// Rounded up, since what does not count may be a lower bound: upper - it <= allowed_width(). Where the
/// width is less than half of `upper`, that difference is exact (Sterbenz), so it tells whether the result
/// was rounded down. If it was, one or two units in the last place are added.
TANDEM_HD inline double nearness_below(const DistanceTolerance& tolerance, double upper) {
  constexpr double kLeast = 0x1p-1074;
  const double width = allowed_width(tolerance, upper);
  double lower = upper - width;
  if (upper - lower > width) lower += lower * 0x1p-52 + kLeast;
  return lower > kLeast ? lower : kLeast;
}

/// Points of two triangles as sums of corners: weights are in [0, 1] and sum to 1, up to rounding.
struct TriangleWeights {
  double a[3], b[3];
};

}  // namespace tandem
