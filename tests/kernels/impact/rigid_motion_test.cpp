// Tests where the motion of a step takes points and triangles, in long double.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/contact/contact_query_fixture.h"
#include "kernels/impact/triangle_impact.h"
#include "tandem/kernels/motion.h"

namespace tandem {
namespace {

using test::RandomPoses;

// Returns where a stored point is at time t, by the definition of RigidMotion in long double.
template <typename Number>
std::array<long double, 3> moved(const Pose& start, const RigidMotion& motion, const Number (&p)[3],
                                 long double t) {
  double x[3];
  apply(start, p[0], p[1], p[2], x);
  long double axis[3], arm[3], angle = 0, along = 0;
  for (int k = 0; k < 3; ++k) {
    axis[k] = t * motion.angular_velocity[k];
    arm[k] = static_cast<long double>(x[k]) - motion.centre[k];
    angle += axis[k] * axis[k];
  }
  angle = std::sqrt(angle);
  for (int k = 0; k < 3; ++k) along += (axis[k] /= angle) * arm[k];
  std::array<long double, 3> out;
  for (int k = 0; k < 3; ++k) {
    const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    out[k] = motion.centre[k] + t * motion.velocity[k] + std::cos(angle) * arm[k] +
             std::sin(angle) * (axis[k1] * arm[k2] - axis[k2] * arm[k1]) +
             (1 - std::cos(angle)) * along * axis[k];
  }
  return out;
}

TEST(RigidMotions, PosesAreWhereTheMotionTakesThem) {
  RandomPoses random(11);
  for (int i = 0; i < test::trials(2000, 50); ++i) {
    const double far = std::pow(10, random.uniform(-3, 8)), turn = std::pow(10, random.uniform(-12, 3));
    Pose start = random.pose({});
    RigidMotion motion;
    double reach = 0, p[3];
    for (int k = 0; k < 3; ++k) {
      start.translation[k] = random.symmetric(far);
      motion.centre[k] = start.translation[k] + random.symmetric(2);
      motion.velocity[k] = random.symmetric(far);
      motion.angular_velocity[k] = random.symmetric(turn / 2);
      p[k] = random.symmetric(1);
      reach += p[k] * p[k];
    }
    const double t = random.uniform(0, 1);
    double computed[3];
    const Pose then = pose_at(start, motion, t);
    apply(then, p[0], p[1], p[2], computed);
    const std::array<long double, 3> place = moved(start, motion, p, t);
    long double error = 0;
    for (int k = 0; k < 3; ++k) error += (place[k] - computed[k]) * (place[k] - computed[k]);
    const manifold::Vector3 displacement = {motion.velocity[0], motion.velocity[1], motion.velocity[2]},
                            turned = {motion.angular_velocity[0], motion.angular_velocity[1],
                                      motion.angular_velocity[2]};
    EXPECT_LE(static_cast<double>(std::sqrt(error)),
              pose_error(start, std::sqrt(reach), motion.centre, displacement, turned));
  }
}

TEST(RigidMotions, NoPointLeavesTheSweptBox) {
  RandomPoses random(12);
  const float lower[3] = {-1, -0.5f, -2}, upper[3] = {0.5f, 1, 0.25f};
  for (int i = 0; i < test::trials(500, 50); ++i) {
    const Pose start = random.pose({1, 1, 3, 0, 4});
    RigidMotion motion;
    const double spin = std::pow(10, random.uniform(-3, 1.5));
    for (int k = 0; k < 3; ++k) {
      motion.centre[k] = start.translation[k] + random.symmetric(2);
      motion.velocity[k] = random.symmetric(5);
      motion.angular_velocity[k] = random.below(3) == 0 ? 0 : random.symmetric(spin);
    }
    const auto vector = [](const double* x) { return manifold::Vector3{x[0], x[1], x[2]}; };
    const auto turn = vector(motion.angular_velocity), displacement = vector(motion.velocity);
    const double fastest = fastest_turn(start, lower, upper, motion.centre, turn);
    const WorldBox swept = swept_box(world_box(start, lower, upper), displacement, turn, fastest,
                                     pose_error(start, 4, motion.centre, displacement, turn));
    for (int step = 0; step <= 20; ++step) {
      for (int corner = 0; corner < 8; ++corner) {
        double x[3];
        apply(pose_at(start, motion, step / 20.0), corner & 1 ? upper[0] : lower[0],
              corner & 2 ? upper[1] : lower[1], corner & 4 ? upper[2] : lower[2], x);
        for (int k = 0; k < 3; ++k) {
          EXPECT_GE(x[k], swept.lo[k]);
          EXPECT_LE(x[k], swept.hi[k]);
        }
      }
    }
  }
}

// A body that is one triangle, whose place at a part of a step of a second is known in long double.
struct MovingTriangle {
  Pose pose;
  RigidMotion motion;
  Triangle triangle;

  impact::MovingBody body() const {
    float lower[3], upper[3];
    Block root = {};
    for (int k = 0; k < 3; ++k) {
      const auto [least, most] = std::minmax({at(0, k), at(1, k), at(2, k)});
      lower[k] = least;
      upper[k] = most;
    }
    set_node(root, 0, enclose(lower, upper), 0, NodeKind::leaf);
    for (int i = 1; i < kNodesPerBlock; ++i) set_imaginary(root, i);
    impact::MovingBody out;
    EXPECT_EQ(impact::moving_body(pose, motion, 1, lower, upper, extent_of(root), out), Status::kOk);
    return out;
  }
  float at(int corner, int k) const { return triangle.corner[corner].position[k]; }

  std::array<long double, 3> place(int corner, long double t) const {
    return moved(pose, motion, triangle.corner[corner].position, t);
  }
};

// Half of them turn about an axis across n, on a circle that bends towards the other as fast as it can.
MovingTriangle triangle_above(RandomPoses& random, const double (&n)[3], double height, double side) {
  MovingTriangle out;
  out.pose = random.pose({});
  const bool bends = random.below(2) == 0;
  double spin[3], arm = random.uniform(0.1, 3) * side, along = 0;
  for (int k = 0; k < 3; ++k) {
    out.pose.translation[k] = n[k] * height;
    spin[k] = random.symmetric(random.below(2) == 0 ? 10 : 0.1);
    out.motion.velocity[k] = bends ? 0 : random.symmetric(2);
    along += spin[k] * n[k];
  }
  for (int k = 0; k < 3; ++k) {
    out.motion.angular_velocity[k] = bends ? spin[k] - along * n[k] : spin[k];
    out.motion.centre[k] = out.pose.translation[k] - (bends ? arm * n[k] : random.symmetric(1));
  }
  const double size = std::pow(10, random.uniform(-4, 0));
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < 3; ++k)
      out.triangle.corner[c].position[k] = static_cast<float>(random.symmetric(size));
  }
  return out;
}

TEST(TriangleTimes, ADirectionTellsTrianglesApartForAsLongAsItSays) {
  RandomPoses random(13);
  int throughout = 0, ends = 0;
  for (int i = 0; i < test::trials(3000, 100); ++i) {
    const Pose frame = random.pose({});
    const double n[3] = {frame.rotation[0][0], frame.rotation[0][1], frame.rotation[0][2]};
    const MovingTriangle a = triangle_above(random, n, 0, -1),
                         b = triangle_above(random, n, std::pow(10, random.uniform(-3, 0.5)), 1);
    const impact::MovingBody body_a = a.body(), body_b = b.body();
    const impact::PairMotion pair = impact::pair_motion(body_a, body_b);
    const impact::MovingTriangles start = impact::moving_triangles(pair, a.triangle, b.triangle);
    const double now = random.uniform(0, 1);
    const impact::TrianglesAt at_now = triangles_at(pair, start, impact::place_at(pair, now));
    const double left = random.uniform(0, 1 - now);
    const impact::Apart apart = apart_along(pair, at_now, impact::vector_of(n), left, 0);
    const double time = apart.throughout ? left : apart.nearly;
    if (!(time > 0)) continue;
    throughout += apart.throughout;
    ends += !apart.throughout;
    EXPECT_LE(time, left * (1 + 1e-12));
    for (int step = 0; step <= 20; ++step) {
      const long double t = now + step / 20.0L * time;
      long double most_a = -INFINITY, least_b = INFINITY;
      for (int c = 0; c < 3; ++c) {
        const auto p = a.place(c, t), q = b.place(c, t);
        most_a = std::max(most_a, p[0] * n[0] + p[1] * n[1] + p[2] * n[2]);
        least_b = std::min(least_b, q[0] * n[0] + q[1] * n[1] + q[2] * n[2]);
      }
      EXPECT_LT(most_a, least_b) << "motion " << i << ", step " << step;
    }
  }
  EXPECT_GT(throughout, 500);
  EXPECT_GT(ends, 300);
}

}  // namespace
}  // namespace tandem
