#pragma once
#include <array>
#include <cmath>
#include <cstdint>

#include "kernels/geometry/oriented_test.h"
#include "kernels/tolerance/sure_verdicts.h"
#include "random_pose.h"

/// Rotations of blocks, from harmless to hostile.
namespace tandem::test {

using Quaternion = std::array<int, 4>;  ///< w, x, y, z

inline BlockRotation packed(const Quaternion& q) {
  std::uint32_t half[4];
  for (int i = 0; i < 4; ++i) half[i] = static_cast<std::uint32_t>(q[i]) + kQuaternionOffset;
  return {half[0] | half[1] << 16, half[2] | half[3] << 16};
}

inline Quaternion unpacked(const BlockRotation& r) {
  const std::uint32_t half[4] = {r.wx & 0xFFFFu, r.wx >> 16, r.yz & 0xFFFFu, r.yz >> 16};
  Quaternion q;
  for (int i = 0; i < 4; ++i) q[i] = static_cast<int>(half[i]) - static_cast<int>(kQuaternionOffset);
  return q;
}

/// None, tiny angles, 90, 120 and 180 degrees, of small parts and of the largest ones, and any.
inline Quaternion random_quaternion(RandomPoses& random) {
  const auto within = [&](int most) { return static_cast<int>(random.below(2 * most + 1)) - most; };
  Quaternion q = {0, 0, 0, 0};
  const auto kind = random.below(8);
  const int size = random.below(2) == 0 ? 1 : kLargestQuaternionPart;
  for (bool zero = true; zero;) {
    for (int& part : q) {
      if (kind < 3) part = within(kLargestQuaternionPart);
      if (kind == 3) part = within(3);
      if (kind == 4) part = size * within(1);  // 0, 90, 120 or 180 degrees
      if (kind == 5) part = within(1) < 0 ? -kLargestQuaternionPart : kLargestQuaternionPart;
      if (kind == 6) part = within(2);
    }
    if (kind == 6) q[random.below(4)] = kLargestQuaternionPart;  // nearly none, or nearly 180 degrees
    if (kind == 7) q[0] = kLargestQuaternionPart;
    zero = q == Quaternion{0, 0, 0, 0};
  }
  return q;
}

/// Column k: the frame's axis k, of length 1.
inline std::array<Direction, 3> axes_of(const BlockFrame& frame) {
  std::array<Direction, 3> axes;
  for (int k = 0; k < 3; ++k) {
    Real squared = 0;
    for (int i = 0; i < 3; ++i) squared += static_cast<Real>(frame.scaled[i][k]) * frame.scaled[i][k];
    for (int i = 0; i < 3; ++i) axes[k][i] = frame.scaled[i][k] / std::sqrt(squared);
  }
  return axes;
}

/// frame_of(), with any inverse that the GPU's may be: one within one unit in the last place.
inline BlockFrame any_frame_of(const BlockRotation& rotation, RandomPoses& random) {
  BlockFrame frame = frame_of(rotation);
  Real squared = 0;
  for (const int part : unpacked(rotation)) squared += static_cast<Real>(part) * part;
  const float upper = std::nextafter(frame.inverse_length, 2.0f),
              lower = std::nextafter(frame.inverse_length, 0.0f);
  const float other = random.below(2) == 0 ? upper : lower;
  if (random.below(3) != 0 && std::fabs(other * squared - 1) <= 0x1p-23L) frame.inverse_length = other;
  return frame;
}

}  // namespace tandem::test
