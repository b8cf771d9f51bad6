#pragma once
#include "kernels/geometry/box_test.h"

/// Tests of boxes as they come, with no allowance for rounding: what tests compare with.
namespace tandem::test {

inline RelativePose without_slack(const double (&rotation)[3][3], const double (&translation)[3]) {
  RelativePose pose{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      pose.rotation[i][j] = static_cast<float>(rotation[i][j]);
      pose.abs_rotation[i][j] = std::fabs(pose.rotation[i][j]);
    }
    pose.translation[i] = static_cast<float>(translation[i]);
  }
  return pose;
}

/// Whether two boxes of one frame overlap, touching included.
TANDEM_HD inline bool overlap_aligned(const Box& a, const Box& b) {
  bool overlap = true;
  for (int k = 0; k < 3; ++k) {
    overlap = overlap && std::fabs(a.centre[k] - b.centre[k]) <= a.half_extent[k] + b.half_extent[k];
  }
  return overlap;
}

}  // namespace tandem::test
