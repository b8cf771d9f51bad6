#pragma once
#include "kernels/geometry/relative_pose.h"
#include "tandem/formats/box.h"
#include "tandem/formats/status.h"
#include "tandem/kernels/motion.h"

/// Two instances that move during a step, and where they are at some time of it. Time is a part of the step,
/// from 0 to 1. Places are relative to a's centre, which moves along, so that nothing depends on how far from
/// the world's origin a pair is but the roundings that posed vertices have already.
namespace tandem::impact {

using manifold::Vector3;

struct Matrix3 {
  double row[3][3];

  TANDEM_HD friend Vector3 operator*(const Matrix3& m, const Vector3& v) {
    const auto& r = m.row;
    return {r[0][0] * v.x + r[0][1] * v.y + r[0][2] * v.z, r[1][0] * v.x + r[1][1] * v.y + r[1][2] * v.z,
            r[2][0] * v.x + r[2][1] * v.y + r[2][2] * v.z};
  }
  TANDEM_HD friend Matrix3 operator*(const Matrix3& m, const Matrix3& n) {
    Matrix3 out;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        out.row[i][j] = m.row[i][0] * n.row[0][j] + m.row[i][1] * n.row[1][j] + m.row[i][2] * n.row[2][j];
      }
    }
    return out;
  }
};

TANDEM_HD inline Vector3 vector_of(const double* x) {
  return {x[0], x[1], x[2]};
}

/// The matrix of w x (m v).
TANDEM_HD inline Matrix3 cross(const Vector3& w, const Matrix3& m) {
  Matrix3 out;
  for (int j = 0; j < 3; ++j) {
    const Vector3 column = manifold::cross(w, {m.row[0][j], m.row[1][j], m.row[2][j]});
    out.row[0][j] = column.x;
    out.row[1][j] = column.y;
    out.row[2][j] = column.z;
  }
  return out;
}

/// An instance that moves, in terms of the step.
struct MovingBody {
  Pose start;            ///< of stored coordinates
  Vector3 centre;        ///< at the start
  Vector3 displacement;  ///< of the centre in the whole step
  Vector3 turn;          ///< angular velocity times the length of the step
  double angle;          ///< |turn|
  double fastest;        ///< fastest_turn()
  double reach;          ///< of the tree: no stored point is farther from the stored origin
  double size;           ///< >= |translation - centre| + reach
  double radius;         ///< no posed vertex is farther from the centre, as it is rounded, at any time
  double error;          ///< pose_error()
  bool rests;            ///< its points stay where they are, to the bit
};

/// Motions of a step of `duration` seconds, as they are computed with. The products' roundings are relative:
/// PairMotion's slack has them. Result: kOk, or kOutOfRange where a number is not finite or too large.
TANDEM_HD inline Status moving_body(const Pose& stored, const RigidMotion& motion, double duration,
                                    const float* lower, const float* upper, const TreeExtent& tree,
                                    MovingBody& body) {
  const auto& w = motion.angular_velocity;
  body.start = stored;
  body.centre = vector_of(motion.centre);
  body.displacement = duration * vector_of(motion.velocity);
  body.turn = duration * vector_of(w);
  bool fits = true;
  for (int k = 0; k < 3; ++k) {
    fits = fits && std::fabs(motion.centre[k]) <= kLargestMovingCoordinate &&
           std::fabs(duration * motion.velocity[k]) <= kLargestMovingCoordinate &&
           std::fabs(stored.translation[k]) <= kLargestMovingCoordinate &&
           std::fabs(duration * w[k]) <= kLargestTurn;
  }
  body.angle = norm(body.turn);
  if (!(fits && body.angle <= kLargestTurn)) return Status::kOutOfRange;
  body.fastest = fastest_turn(stored, lower, upper, motion.centre, body.turn);
  body.reach = norm(vector_of(tree.reach));
  body.size = norm(vector_of(stored.translation) - body.centre) + body.reach;
  body.radius = farthest_from_centre(stored, lower, upper, motion.centre);
  body.error = pose_error(stored, body.reach, motion.centre, body.displacement, body.turn);
  body.rests = duration == 0 || is_at_rest(motion);
  return Status::kOk;
}

/// Two of them. Where what this folder computes says *apart*, for some time or from one time to another, with
/// `slack` added to every distance, then during that time neither the moving triangles meet nor those that
/// pose_at() and apply() make. Condition: it is used for no longer than either body turns by a radian.
///
/// **Slack.** Let w = 2^-53, Theta = 1 + the larger angle, and size the sum of both bodies' sizes, of the
/// centres' distance and of both displacements: no place or displacement relative to a's centre, and no
/// velocity along a direction of length 1, is larger than 2 Theta size in the step. Matrices of rotations err
/// by 2^-45 Theta, places by that times size, and velocities, times a time in which a body turns by a radian,
/// by that too. The rest of what is computed here, by at most 100 roundings on the way from numbers of this
/// size, errs by 200 w Theta size, so all together by less than 2^-43 Theta size, fused or not. Posed
/// vertices have been rounded, by w |translation| + 8 w reach at most, and those of pose_at() err by both
/// bodies' errors, which contain that. Half of the first term is spare: times within the step are rounded to
/// w, and nothing moves by more than 2^-51 Theta size in that time. Hence slack = 2^-42 Theta size + errors.
struct PairMotion {
  const MovingBody *a, *b;
  Vector3 offset;        ///< from a's centre to b's, at the start
  Vector3 displacement;  ///< of b's centre relative to a's, in the whole step
  double slack;
};

TANDEM_HD inline PairMotion pair_motion(const MovingBody& a, const MovingBody& b) {
  PairMotion pair;
  pair.a = &a;
  pair.b = &b;
  pair.offset = b.centre - a.centre;
  pair.displacement = b.displacement - a.displacement;
  const double size = a.size + b.size + norm(pair.offset) + norm(a.displacement) + norm(b.displacement);
  pair.slack = 0x1p-42 * (1 + manifold::greater(a.angle, b.angle)) * size + 1.01 * (a.error + b.error);
  return pair;
}

/// Returns whether the balls about the bodies' centres that hold them stay apart for the whole step. A turn
/// changes no distance from the centre, and the centres' offset goes straight ahead: it is least at one time,
/// which is computed with an error of 4 w |offset| / |displacement|, and so errs by that many |displacement|,
/// which slack is for.
TANDEM_HD inline bool balls_stay_apart(const PairMotion& pair) {
  const double squared = dot(pair.displacement, pair.displacement);
  const double nearest = squared > 0 ? -dot(pair.offset, pair.displacement) / squared : 0;
  const double time = manifold::lesser(manifold::greater(nearest, 0.0), 1.0);
  return norm(pair.offset + time * pair.displacement) > pair.a->radius + pair.b->radius + pair.slack;
}

/// Returns whether two bodies that are not in contact at the start surely stay apart, by what is known of
/// them without their trees. Hence pairs that the broad phase does not find have no impact where they are
/// given, either. swept_a, swept_b: swept_box() of each.
TANDEM_HD inline bool stay_apart(const PairMotion& pair, const WorldBox& swept_a, const WorldBox& swept_b) {
  return (pair.a->rests && pair.b->rests) || !overlap(swept_a, swept_b) || balls_stay_apart(pair);
}

/// No point of two bodies accelerates more along n, relative to the other. fastest_a, fastest_b: the largest
/// |turn x arm| of each body's points. A point at `arm` is accelerated by turn x (turn x arm), which lies
/// across the turn's axis, as all of its way about the centre does.
TANDEM_HD inline double acceleration_along(const PairMotion& pair, const Vector3& n, double fastest_a,
                                           double fastest_b) {
  return (1 + 0x1p-40) *
         (norm(cross(pair.a->turn, n)) * fastest_a + norm(cross(pair.b->turn, n)) * fastest_b);
}

/// The places of the two bodies at some time.
struct PairPlace {
  Matrix3 turn_a, turn_b;  ///< Q of each
  Vector3 offset;          ///< from a's centre to b's
};

TANDEM_HD inline PairPlace place_at(const PairMotion& pair, double time) {
  PairPlace place;
  rotation_by(time * pair.a->turn, place.turn_a.row);
  rotation_by(time * pair.b->turn, place.turn_b.row);
  place.offset = pair.offset + time * pair.displacement;
  return place;
}

}  // namespace tandem::impact
