#pragma once
#include <cmath>
#include <random>

#include "kernels/geometry/relative_pose.h"
#include "tandem/formats/box.h"
#include "tandem/kernels/pose.h"

/// Poses and boxes that are hard on box tests.
namespace tandem::test {

/// How large the numbers of one trial are.
struct Scale {
  double size = 1;         ///< of boxes
  double centre = 1;       ///< of their centres
  double translation = 1;  ///< of poses
  double deviation = 0;    ///< of rotations from rigid ones, entry by entry
  double turn = 4;         ///< angle between rotations and axis-parallel ones, radians
};

class RandomPoses {
 public:
  explicit RandomPoses(std::uint64_t seed) : random_(seed) {}

  std::mt19937_64& engine() { return random_; }
  double uniform(double lo, double hi) {
    return lo + (hi - lo) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  double symmetric(double size) { return uniform(-size, size); }
  std::uint64_t below(std::uint64_t n) { return random_() % n; }

  Pose pose(const Scale& scale) {
    Pose pose{};
    double q[4] = {1, 0, 0, 0}, length = 1;
    do {
      length = 0;
      for (int k = 0; k < 4; ++k) {
        q[k] = scale.turn >= 3 ? symmetric(1) : k == 0 ? 1 : symmetric(0.5 * scale.turn);
        length += q[k] * q[k];
      }
    } while (length < 0.01 || length > 1.5);
    const double s = 2 / length, w = q[0], x = q[1], y = q[2], z = q[3];
    const double turned[3][3] = {{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
                                 {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
                                 {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}};
    // Rows turned round cyclically: an axis-parallel rotation on top.
    const auto first = static_cast<int>(below(3));
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        pose.rotation[i][j] = turned[(i + first) % 3][j] + symmetric(scale.deviation);
      }
      pose.translation[i] = symmetric(scale.translation);
    }
    return pose;
  }

  /// Corner points of a box, and what a node stores of it.
  Box box(const Scale& scale, Position& lo, Position& hi) {
    for (int k = 0; k < 3; ++k) {
      const double c = symmetric(scale.centre);
      const double h = below(8) == 0 ? 0 : uniform(0, scale.size) * (below(4) == 0 ? 1e-3 : 1);
      lo[k] = static_cast<float>(c - h);
      hi[k] = static_cast<float>(c + h);
    }
    return enclose(lo, hi);
  }

 private:
  std::mt19937_64 random_;
};

inline TreeExtent extent_of(const Box& box) {
  Block root;
  set_node(root, 0, box, 0, NodeKind::leaf);
  for (int i = 1; i < kNodesPerBlock; ++i) set_imaginary(root, i);
  return tandem::extent_of(root);
}

}  // namespace tandem::test
