#pragma once
#include <cmath>

#include "tandem/kernels/detail/vector3.h"
#include "tandem/kernels/world_box.h"

namespace tandem {

/// The motion of an instance during a step, in the world: its centre goes straight ahead, and the instance
/// turns about it, both at constant speed.
///
/// **Definition.** Let x be a posed vertex at the start of the step, a float64 point as apply() makes it. At
/// time t its place is, in real arithmetic on the numbers below,
///
///     x(t) = c + t v + Q(t w) (x - c),
///
/// where c is the centre, v the velocity, w the angular velocity, and Q the rotation by the angle |t w|,
/// counter-clockwise about t w (Rodrigues). Triangles move with their corners, which all turn alike.
struct RigidMotion {
  double velocity[3];          ///< of the centre, units of length a second
  double angular_velocity[3];  ///< radians a second
  double centre[3];            ///< where the centre is at the start
};

inline constexpr RigidMotion kAtRest = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};

/// Returns whether a body with this motion stays where it is, wherever its centre is.
TANDEM_HD inline bool is_at_rest(const RigidMotion& motion) {
  bool rests = true;
  for (int k = 0; k < 3; ++k) rests = rests && motion.velocity[k] == 0 && motion.angular_velocity[k] == 0;
  return rests;
}

/// The largest angle that a body may turn by in a step, in radians, and the largest coordinate, displacement
/// and centre that motions take.
inline constexpr double kLargestTurn = 1024;
inline constexpr double kLargestMovingCoordinate = 1e100;

/// The rotation by the angle |turn| about `turn`. Condition: |turn| <= kLargestTurn. |out - Q(turn)| <= 2^-45
/// (1 + |turn|) as a matrix, where sin and cos err by 2 units in the last place at most.
///
/// Proof. Let w = 2^-53. The axis k has a relative error of 5w (a division by the largest coordinate, a sum
/// of squares, a root, a division), the angle too, so that sine and cosine err by (5 |turn| + 4) w. An entry
/// is a sum of (1 - cos) k_i k_j, whose parts are at most 2, and of cos or sin k_l, at most 1, in 5 roundings
/// at most: it errs by (10 |turn| + 45) w, and nine entries, in the Frobenius norm, by 135 w (1 + |turn|).
TANDEM_HD inline void rotation_by(const manifold::Vector3& turn, double (&out)[3][3]) {
  using manifold::greater;
  const double largest = greater(greater(std::fabs(turn.x), std::fabs(turn.y)), std::fabs(turn.z));
  const manifold::Vector3 scaled =
      largest > 0 ? manifold::Vector3{turn.x / largest, turn.y / largest, turn.z / largest}
                  : manifold::Vector3{1, 0, 0};
  const double length = norm(scaled), angle = largest * length;
  const double k[3] = {scaled.x / length, scaled.y / length, scaled.z / length};
  const double s = std::sin(angle), c = std::cos(angle);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] = (1 - c) * k[i] * k[j];
  }
  for (int i = 0; i < 3; ++i) {
    out[i][i] += c;
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    out[i2][i1] += s * k[i];
    out[i1][i2] -= s * k[i];
  }
}

/// The float64 pose at time t: rotation Q R and translation c + t v + Q (translation - c), of the coordinates
/// that `start` is of. At t = 0, and of a body at rest, it is `start`. How far it is from the motion:
/// pose_error().
TANDEM_HD inline Pose pose_at(const Pose& start, const RigidMotion& motion, double t) {
  if (t == 0 || is_at_rest(motion)) return start;
  const auto& w = motion.angular_velocity;
  double q[3][3];
  rotation_by({t * w[0], t * w[1], t * w[2]}, q);
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    double turned = 0;
    for (int j = 0; j < 3; ++j) {
      pose.rotation[i][j] =
          q[i][0] * start.rotation[0][j] + q[i][1] * start.rotation[1][j] + q[i][2] * start.rotation[2][j];
      turned += q[i][j] * (start.translation[j] - motion.centre[j]);
    }
    pose.translation[i] = turned + (motion.centre[i] + t * motion.velocity[i]);
  }
  return pose;
}

/// Returns how far a point that apply() makes with pose_at() may be from where the motion takes it, at any
/// time of a step: a posed vertex at `reach` from the coordinates' origin at most. displacement, turn: the
/// velocities times the length of the step. Condition: the rotation is rigid.
///
/// Proof. Let w = 2^-53, x = R p + t + e the posed vertex, |e| <= w |t| + 8 w |p|. The rotation of pose_at()
/// errs by what rotation_by() says and 10 w for the product with R, which moves p and t - c by (2^-45 (1 +
/// |turn|) + 10 w) 1.01 (|p| + |t - c|). Roundings of t - c, its product with Q and apply()'s products
/// contribute 20 w (|p| + |t - c|), and Q e those of |e|. Numbers of the size of the centre's place round
/// four times: the displacement, its sum with c, the translation, and apply()'s last sum: 4.1 w (|c| + |t
/// v|). |t| is at most |c| + |t - c|.
TANDEM_HD inline double pose_error(const Pose& start, double reach, const double (&centre)[3],
                                   const manifold::Vector3& displacement, const manifold::Vector3& turn) {
  const manifold::Vector3 c = {centre[0], centre[1], centre[2]};
  const auto& t = start.translation;
  const double arm = norm(manifold::Vector3{t[0], t[1], t[2]} - c);
  return 0x1p-50 * (norm(c) + norm(displacement)) + 0x1p-44 * (1 + norm(turn)) * (arm + reach);
}

/// The largest |turn x (x - centre)| of the posed points of an asset with these bounds, or more: how fast the
/// fastest of them turns, and its greatest acceleration divided by |turn|. pose: of stored coordinates.
///
/// A convex function of the point, so a corner of the bounds has the largest value; the last term is for
/// roundings, also those that posed vertices have.
TANDEM_HD inline double fastest_turn(const Pose& pose, const float* lower, const float* upper,
                                     const double (&centre)[3], const manifold::Vector3& turn) {
  double most = 0, size = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double x[3];
    apply(pose, corner & 1 ? upper[0] : lower[0], corner & 2 ? upper[1] : lower[1],
          corner & 4 ? upper[2] : lower[2], x);
    const manifold::Vector3 arm = {x[0] - centre[0], x[1] - centre[1], x[2] - centre[2]};
    most = manifold::greater(most, norm(cross(turn, arm)));
    size = manifold::greater(size, norm(arm));
  }
  const auto& t = pose.translation;
  return most * (1 + 0x1p-40) +
         0x1p-45 * norm(turn) * (size + std::fabs(t[0]) + std::fabs(t[1]) + std::fabs(t[2]));
}

/// The largest distance from the centre of the posed points of an asset with these bounds, or more, also of
/// posed vertices as they are rounded. A corner of the bounds has it, as above.
TANDEM_HD inline double farthest_from_centre(const Pose& pose, const float* lower, const float* upper,
                                             const double (&centre)[3]) {
  double most = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double x[3];
    apply(pose, corner & 1 ? upper[0] : lower[0], corner & 2 ? upper[1] : lower[1],
          corner & 4 ? upper[2] : lower[2], x);
    most = manifold::greater(most,
                             norm(manifold::Vector3{x[0] - centre[0], x[1] - centre[1], x[2] - centre[2]}));
  }
  const auto& t = pose.translation;
  return most * (1 + 0x1p-40) + 0x1p-45 * (std::fabs(t[0]) + std::fabs(t[1]) + std::fabs(t[2]));
}

/// A box that the instance does not leave during a step, nor do the points of pose_at(). start: its world
/// box; fastest: fastest_turn(); error: pose_error().
///
/// A point is displaced by its centre's displacement, or a part of it, and by a chord of a circle of radius
/// fastest / |turn| across the turn's axis, at most min(2, |turn|) radii long, of which axis k sees the part
/// that is |e_k x turn| / |turn|.
TANDEM_HD inline WorldBox swept_box(const WorldBox& start, const manifold::Vector3& displacement,
                                    const manifold::Vector3& turn, double fastest, double error) {
  const double angle = norm(turn), along[3] = {displacement.x, displacement.y, displacement.z};
  const double across[3] = {std::sqrt(turn.y * turn.y + turn.z * turn.z),
                            std::sqrt(turn.z * turn.z + turn.x * turn.x),
                            std::sqrt(turn.x * turn.x + turn.y * turn.y)};
  // Below the angle 2 the chord is fastest itself.
  const double chord = angle > 2 ? 2 * fastest / angle : fastest;
  WorldBox box;
  for (int k = 0; k < 3; ++k) {
    const double seen = angle > 0x1p-500 ? across[k] / angle : 1;
    const double turned = chord * seen * (1 + 0x1p-40);
    const double margin =
        error + 0x1p-49 * (std::fabs(start.lo[k]) + std::fabs(start.hi[k]) + std::fabs(along[k]) + turned);
    box.lo[k] = start.lo[k] + (along[k] < 0 ? along[k] : 0) - turned - margin;
    box.hi[k] = start.hi[k] + (along[k] > 0 ? along[k] : 0) + turned + margin;
  }
  return box;
}

}  // namespace tandem
