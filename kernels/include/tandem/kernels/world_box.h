#pragma once
#include "tandem/kernels/pose.h"

namespace tandem {

/// An axis-aligned box in world coordinates, float64, ends included.
struct WorldBox {
  double lo[3], hi[3];
};

/// The box around an instance: contains every posed vertex of an asset with these bounds (stored
/// coordinates), and so every posed triangle.
///
/// It needs no slack, because rounding is monotone. apply() computes fl(fl(fl(fl(r0 x) + fl(r1 y)) + fl(r2
/// z)) + t). Each product is at least the smaller and at most the larger of its values at the two ends of x,
/// y or z; each rounded sum of smaller terms is not larger. So the same formula over the smaller products
/// gives a float64 number that no posed vertex lies below, and over the larger ones above. pose: of stored
/// coordinates (for_stored_coordinates). Real: float or double.
template <typename Real>
TANDEM_HD inline WorldBox world_box(const Pose& pose, const Real* lower, const Real* upper) {
  WorldBox box;
  for (int i = 0; i < 3; ++i) {
    double least[3], most[3];
    for (int j = 0; j < 3; ++j) {
      const double a = detail::times(pose.rotation[i][j], lower[j]),
                   b = detail::times(pose.rotation[i][j], upper[j]);
      least[j] = a < b ? a : b;
      most[j] = a < b ? b : a;
    }
    box.lo[i] = detail::plus(detail::plus(detail::plus(least[0], least[1]), least[2]), pose.translation[i]);
    box.hi[i] = detail::plus(detail::plus(detail::plus(most[0], most[1]), most[2]), pose.translation[i]);
  }
  return box;
}

/// The largest coordinate of a world box that queries take.
inline constexpr double kLargestWorldCoordinate = 1e300;

/// Returns whether queries take this box; NaN is not in range.
TANDEM_HD inline bool in_range(const WorldBox& box) {
  bool in_range = true;
  for (int k = 0; k < 3; ++k) {
    in_range = in_range && std::fabs(box.lo[k]) <= kLargestWorldCoordinate &&
               std::fabs(box.hi[k]) <= kLargestWorldCoordinate;
  }
  return in_range;
}

/// Returns whether two world boxes meet, touching included.
TANDEM_HD inline bool overlap(const WorldBox& a, const WorldBox& b) {
  bool overlap = true;
  for (int k = 0; k < 3; ++k) overlap = overlap && a.lo[k] <= b.hi[k] && b.lo[k] <= a.hi[k];
  return overlap;
}

/// A lower bound of the distance of what is in two boxes: the largest gap along an axis, which rounding makes
/// larger by at most a factor of 1 + 2^-53.
TANDEM_HD inline double distance_between(const WorldBox& a, const WorldBox& b) {
  double gap = 0;
  for (int k = 0; k < 3; ++k) {
    const double above = b.lo[k] - a.hi[k], below = a.lo[k] - b.hi[k];
    gap = above > gap ? above : gap;
    gap = below > gap ? below : gap;
  }
  return gap * (1 - 0x1p-52);
}

/// Returns whether along each axis no gap as computed is larger than `reach`; with 0, whether they meet.
TANDEM_HD inline bool are_near(const WorldBox& a, const WorldBox& b, double reach) {
  bool meet = true;
  for (int k = 0; k < 3; ++k) meet = meet && a.lo[k] - b.hi[k] <= reach && b.lo[k] - a.hi[k] <= reach;
  return meet;
}

/// The box, larger by `margin` on each side, rounded outward, as far as queries take boxes.
TANDEM_HD inline WorldBox grown(const WorldBox& box, double margin) {
  WorldBox out;
  for (int k = 0; k < 3; ++k) {
    out.lo[k] = std::fmax(std::nextafter(box.lo[k] - margin, -HUGE_VAL), -kLargestWorldCoordinate);
    out.hi[k] = std::fmin(std::nextafter(box.hi[k] + margin, HUGE_VAL), kLargestWorldCoordinate);
  }
  return out;
}

}  // namespace tandem
