#pragma once
#include <cmath>

#include "tandem/formats/platform.h"

namespace tandem {

/// The place of an instance of an asset: x_world = rotation * x + translation, float64. Rigid to
/// kRigidTolerance.
struct Pose {
  double rotation[3][3];
  double translation[3];
};

/// The most that rotation^T * rotation may be off the identity, entry by entry, and the determinant off 1.
inline constexpr double kRigidTolerance = 1e-6;

inline constexpr Pose kIdentityPose = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};

namespace detail {

// These operations are rounded to float64 one by one, and never contracted into a fused one: host code is
// compiled with -ffp-contract=off.
TANDEM_HD inline double times(double a, double b) {
#ifdef __CUDA_ARCH__
  return __dmul_rn(a, b);
#else
  return a * b;
#endif
}

TANDEM_HD inline double plus(double a, double b) {
#ifdef __CUDA_ARCH__
  return __dadd_rn(a, b);
#else
  return a + b;
#endif
}

}  // namespace detail

/// ((r0 * x + r1 * y) + r2 * z) + t for each row, in this order and rounded after each operation, as anyone
/// can recompute it. The float64 points that come out *are* the geometry that queries are about.
TANDEM_HD inline void apply(const Pose& pose, double x, double y, double z, double* out) {
  for (int i = 0; i < 3; ++i) {
    const double* r = pose.rotation[i];
    const double sum =
        detail::plus(detail::plus(detail::times(r[0], x), detail::times(r[1], y)), detail::times(r[2], z));
    out[i] = detail::plus(sum, pose.translation[i]);
  }
}

/// The pose for stored coordinates, given the one for the file's coordinates: its translation is R * origin +
/// t, computed by apply().
TANDEM_HD inline Pose for_stored_coordinates(const Pose& pose, const double* origin) {
  Pose stored = pose;
  apply(pose, origin[0], origin[1], origin[2], stored.translation);
  return stored;
}

/// Returns whether all entries are finite and the rotation is one, to kRigidTolerance. NaN is not rigid.
TANDEM_HD inline bool is_rigid(const Pose& pose) {
  const auto& r = pose.rotation;
  bool rigid = true;
  for (int i = 0; i < 3; ++i) {
    rigid = rigid && std::fabs(pose.translation[i]) <= 1.7976931348623157e308;
    for (int j = 0; j < 3; ++j) {
      const double dot = r[0][i] * r[0][j] + r[1][i] * r[1][j] + r[2][i] * r[2][j];
      rigid = rigid && std::fabs(dot - (i == j ? 1 : 0)) <= kRigidTolerance;
    }
  }
  const double determinant = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) -
                             r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0]) +
                             r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
  return rigid && std::fabs(determinant - 1) <= 4 * kRigidTolerance;
}

}  // namespace tandem
