#pragma once
#include "kernels/geometry/pair_motion.h"
#include "tandem/kernels/detail/vector3.h"
#include "tandem/kernels/manifold.h"

/// A kept manifold is the one that was found, moved with its bodies, by one rule for CPU and GPU.
namespace tandem::manifold {

/// What of a manifold moves, as it was found.
struct FoundManifold {
  double normal[3], area_vector[3], centre[3];
};
struct FoundPoint {
  double position[3], normal[3], depth;
};

TANDEM_HD inline FoundManifold found(const Manifold& m) {
  FoundManifold out;
  for (int k = 0; k < 3; ++k) {
    out.normal[k] = m.normal[k], out.area_vector[k] = m.area_vector[k], out.centre[k] = m.centre[k];
  }
  return out;
}
TANDEM_HD inline FoundPoint found(const ManifoldPoint& p) {
  return {{p.position[0], p.position[1], p.position[2]}, {p.normal[0], p.normal[1], p.normal[2]}, p.depth};
}

/// Moves the manifolds of a pair from where its bodies stood to where they stand.
///
/// Normals and area turn with the larger body, whose flat faces they are mostly of. A point stays where it is
/// on either body (in_a, in_b). What the bodies move on from there, `shift`, is added to what was found, so
/// that a pose that is not quite rigid adds no more than a part of the motion, and bodies that stand still
/// add nothing: their manifolds keep their bytes.
class KeptMotion {
 public:
  /// then, now: poses of a and b in the coordinates of their files.
  TANDEM_HD KeptMotion(const Pose (&then)[2], const Pose (&now)[2], bool b_is_larger)
      : then_{then[0], then[1]}, now_{now[0], now[1]}, larger_(b_is_larger ? 1 : 0) {
    stands_ = is_same(then[0], now[0]) && is_same(then[1], now[1]);
  }

  /// Moves a manifold but for its depth, which is that of its deepest point.
  TANDEM_HD void move(const FoundManifold& from, Manifold& out) const {
    const Vector3 normal = of(from.normal), area = of(from.area_vector), centre = of(from.centre);
    write(normal, out.normal);
    write(area, out.area_vector);
    write(centre, out.centre);
    if (stands_) return;
    const bool has_normal = normal.x != 0 || normal.y != 0 || normal.z != 0;
    if (has_normal) write(turned_normal(normal), out.normal);
    write(turned(area), out.area_vector);
    const Vector3 by_a = shift(0, in_file(0, centre)), by_b = shift(1, in_file(1, centre));
    write(centre + 0.5 * (by_a + by_b), out.centre);
  }

  /// Moves a point and measures its depth anew: less than 0 where the bodies have come apart.
  TANDEM_HD void move(const FoundPoint& from, ManifoldPoint& out) const {
    write(of(from.position), out.position);
    write(of(from.normal), out.normal);
    out.depth = from.depth;
    if (stands_) return;
    const Vector3 by_a = shift(0, of(out.in_a)), by_b = shift(1, of(out.in_b));
    const Vector3 n = turned_normal(of(from.normal));
    write(of(from.position) + 0.5 * (by_a + by_b), out.position);
    write(n, out.normal);
    out.depth = dot(n, from.depth * of(from.normal) + (by_a - by_b));
  }

 private:
  TANDEM_HD static Vector3 of(const double (&x)[3]) { return {x[0], x[1], x[2]}; }
  TANDEM_HD static void write(const Vector3& x, double (&out)[3]) {
    out[0] = x.x, out[1] = x.y, out[2] = x.z;
  }
  TANDEM_HD static Vector3 posed(const Pose& pose, const Vector3& x) {
    double out[3];
    apply(pose, x.x, x.y, x.z, out);
    return of(out);
  }
  TANDEM_HD static Vector3 unturned(const Pose& pose, const Vector3& x) {
    const auto& r = pose.rotation;
    return {r[0][0] * x.x + r[1][0] * x.y + r[2][0] * x.z, r[0][1] * x.x + r[1][1] * x.y + r[2][1] * x.z,
            r[0][2] * x.x + r[1][2] * x.y + r[2][2] * x.z};
  }
  TANDEM_HD Vector3 in_file(int body, const Vector3& x) const {
    return unturned(then_[body], x - of(then_[body].translation));
  }
  /// The way of a point of a body, which is given in the coordinates of its file.
  TANDEM_HD Vector3 shift(int body, const Vector3& in_file) const {
    return posed(now_[body], in_file) - posed(then_[body], in_file);
  }
  /// A direction, turned with the larger body.
  TANDEM_HD Vector3 turned(const Vector3& x) const {
    const Vector3 in_file = unturned(then_[larger_], x);
    const auto turn = [&](const Pose& pose) {
      Pose rotation = pose;
      rotation.translation[0] = rotation.translation[1] = rotation.translation[2] = 0;
      return posed(rotation, in_file);
    };
    return x + (turn(now_[larger_]) - turn(then_[larger_]));
  }
  TANDEM_HD Vector3 turned_normal(const Vector3& n) const { return normalized(turned(n)); }
  Pose then_[2], now_[2];
  int larger_;
  bool stands_;
};

}  // namespace tandem::manifold
