// Attacks the promise of oriented_slack(): where overlap_oriented() says apart, posed points are apart.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "kernels/random_rotation.h"
#include "kernels/tolerance/sure_verdicts.h"

namespace tandem::test {
namespace {

constexpr Real dot(const Direction& a, const Direction& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// A few vertices below a node of a block, and what is made of them.
struct Body {
  Pose pose;
  ScaledRotation rotation;
  BlockFrame frame;
  std::array<Direction, 3> axes;  // of the frame, in the mesh
  std::vector<std::array<float, 3>> vertices;
  TreeExtent extent;
  Box box;

  Direction posed_axis(int k) const {
    Direction out{};
    for (int i = 0; i < 3; ++i) {
      for (int l = 0; l < 3; ++l) out[i] += pose.rotation[i][l] * axes[k][l];
    }
    return out;
  }

  std::vector<Point> points() const {
    std::vector<Point> out(vertices.size());
    for (std::size_t i = 0; i < out.size(); ++i)
      apply(pose, vertices[i][0], vertices[i][1], vertices[i][2], out[i].data());
    return out;
  }
};

void begin(RandomPoses& random, const Scale& scale, Body& body) {
  body.pose = random.pose(scale);
  const BlockRotation rotation = packed(random_quaternion(random));
  body.rotation = scaled_rotation(rotation);
  body.frame = any_frame_of(rotation, random);
  body.axes = axes_of(body.frame);
  body.vertices.clear();
}

void add_vertex(Body& body, const Direction& in_frame) {
  std::array<float, 3> vertex;
  for (int i = 0; i < 3; ++i) {
    Real x = 0;
    for (int k = 0; k < 3; ++k) x += body.axes[k][i] * in_frame[k];
    vertex[i] = static_cast<float>(x);
  }
  body.vertices.push_back(vertex);
}

// The box around the vertices as queries make it, and a tree that reaches as far, or twice as far.
void enclose_vertices(RandomPoses& random, Body& body) {
  Position lo, hi;
  for (int k = 0; k < 3; ++k) {
    lo[k] = hi[k] = body.vertices[0][k];
    for (const auto& vertex : body.vertices)
      lo[k] = std::min(lo[k], vertex[k]), hi[k] = std::max(hi[k], vertex[k]);
  }
  body.extent = extent_of(enclose(lo, hi));
  const double larger = random.below(8) == 0 ? 2 : 1;
  double squared = 0;
  for (double& reach : body.extent.reach) reach *= larger, squared += reach * reach;
  for (int k = 0; k < 3; ++k) {
    double lowest = HUGE_VAL, highest = -HUGE_VAL;
    for (const auto& vertex : body.vertices) {
      const float x[3] = {vertex[0], vertex[1], vertex[2]};
      const double at = along_axis(body.rotation, k, x);
      lowest = std::min(lowest, at), highest = std::max(highest, at);
    }
    box_along(lowest, highest, std::sqrt(squared), body.box.centre[k], body.box.half_extent[k]);
  }
}

// Across the faces of the posed boxes: 3 of a, 3 of b. Not quite rigid poses shear the boxes.
Direction axis(const Body& a, const Body& b, int which) {
  const Body& body = which < 3 ? a : b;
  return cross(body.posed_axis((which + 1) % 3), body.posed_axis((which + 2) % 3));
}

bool surely_apart(const Body& a, const Body& b) {
  const std::vector<Point> points_a = a.points(), points_b = b.points();
  for (int which = 0; which < 6; ++which) {
    if (plane_separates(points_a, points_b, axis(a, b, which))) return true;
  }
  // Where b is sheared, the test looks along its axes as they are posed.
  for (int k = 0; k < 3; ++k) {
    if (plane_separates(points_a, points_b, b.posed_axis(k))) return true;
  }
  return false;
}

struct Trial {
  Body a, b;
  RelativePose b_in_a;
  float slack;
};

bool relate(Trial& trial) {
  const Body &a = trial.a, &b = trial.b;
  if (relative_pose(a.pose, a.extent, b.pose, b.extent, trial.b_in_a) != RelativePoseStatus::kOk)
    return false;
  trial.slack = oriented_slack(trial.b_in_a, a.extent, b.extent);
  return true;
}

bool overlap(const Trial& trial) {
  const OrientedPose pose = oriented_pose(trial.b_in_a.rotation, trial.b_in_a.translation, trial.slack,
                                          trial.a.frame, trial.b.frame);
  return overlap_oriented(trial.a.box, trial.b.box, pose);
}

// Vertices at the two corners of a box that lie farthest along a direction of the world, and some within.
void fill(RandomPoses& random, const Scale& scale, const Direction& along, Body& body) {
  Direction centre, half, corner[2];
  for (int k = 0; k < 3; ++k) {
    centre[k] = random.symmetric(scale.centre);
    half[k] = random.below(8) == 0 ? 0 : random.uniform(0, scale.size) * (random.below(4) == 0 ? 1e-3 : 1);
    const Real to = dot(body.posed_axis(k), along) < 0 ? -half[k] : half[k];
    corner[0][k] = centre[k] - to;
    corner[1][k] = centre[k] + to;
  }
  add_vertex(body, corner[0]);
  add_vertex(body, corner[1]);
  for (auto more = random.below(3); more > 0; --more) {
    Direction inner;
    for (int k = 0; k < 3; ++k) inner[k] = centre[k] + half[k] * random.symmetric(1);
    add_vertex(body, inner);
  }
  enclose_vertices(random, body);
}

// Lowest and highest of the vertices along a direction, and their middle, the translation left out.
struct Span {
  Real lowest = HUGE_VALL, highest = -HUGE_VALL;
  Direction middle{};

  Span(const Body& body, const Direction& along) {
    for (const auto& vertex : body.vertices) {
      Direction at{};
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) at[i] += static_cast<Real>(body.pose.rotation[i][k]) * vertex[k];
        middle[i] += at[i] / static_cast<Real>(body.vertices.size());
      }
      lowest = std::min(lowest, dot(at, along));
      highest = std::max(highest, dot(at, along));
    }
  }
};

// Moves b so that the vertices are `gap` apart along the direction and near each other along others.
void place(const Body& a, Body& b, const Direction& along, const Direction& aside, Real gap) {
  const Span of_a(a, along), of_b(b, along);
  Direction move;
  for (int k = 0; k < 3; ++k) move[k] = of_a.middle[k] - of_b.middle[k] + aside[k];
  const Real more = of_a.highest + gap - of_b.lowest - dot(move, along);
  for (int k = 0; k < 3; ++k)
    b.pose.translation[k] = static_cast<double>(a.pose.translation[k] + move[k] + more * along[k]);
}

// Bodies whose gap along one of the 6 axes is none, or some slacks at most, and now and then far less. The
// promise holds for poses too that are less rigid than queries take.
bool make_trial(RandomPoses& random, const Scale& scale, int which, Trial& trial) {
  begin(random, scale, trial.a);
  Scale sheared = scale;
  if (scale.deviation == 0 && random.below(4) == 0) sheared.deviation = 1e-3;
  begin(random, sheared, trial.b);
  Direction along = axis(trial.a, trial.b, which);
  const Real length = std::sqrt(dot(along, along)) * (random.below(2) == 0 ? 1 : -1);
  for (Real& x : along) x /= length;
  fill(random, scale, along, trial.a);
  fill(random, scale, along, trial.b);
  Direction aside;
  for (Real& x : aside) x = random.symmetric(0.2 * scale.size);
  place(trial.a, trial.b, along, aside, 0);
  if (!relate(trial)) return false;
  if (random.below(8) == 0) return true;
  const double gap = random.symmetric(2) * (random.below(2) == 0 ? 1 : std::exp2(-random.uniform(0, 10)));
  place(trial.a, trial.b, along, aside, gap * trial.slack);
  return relate(trial);
}

TEST(OrientedBlocks, WhatTheyCallApartIsApartInExactArithmetic) {
  RandomPoses random(1);
  std::uint64_t apart[6] = {}, made = 0;
  const std::uint64_t count = hundredth_of(40'000'000);
  for (std::uint64_t i = 0; i < count; ++i) {
    Trial trial;
    const auto which = static_cast<int>(random.below(6));
    if (!make_trial(random, any_scale(random), which, trial)) continue;
    ++made;
    if (overlap(trial)) continue;
    ++apart[which];
    ASSERT_TRUE(surely_apart(trial.a, trial.b)) << "trial " << i;
  }
  std::printf("%llu trials, apart by axis:", static_cast<unsigned long long>(made));
  for (const std::uint64_t n : apart) std::printf(" %llu", static_cast<unsigned long long>(n));
  std::printf("\n");
  EXPECT_GT(made, count / 2);
  for (const std::uint64_t n : apart) EXPECT_GT(n, made / 100);  // most gaps lie within the slack
}

// A vertex of a lies inside a tetrahedron of b's vertices, a few units in the last place large, and both
// boxes lie on opposite sides of it: contact by construction.
bool make_contact(RandomPoses& random, const Scale& scale, int which, Trial& trial) {
  Body &a = trial.a, &b = trial.b;
  begin(random, scale, a);
  begin(random, scale, b);
  const Direction along = axis(a, b, which);
  fill(random, scale, along, a);
  const std::vector<Point> points_a = a.points();
  const Point& p = points_a[1];  // the farthest of a
  for (int k = 0; k < 3; ++k)
    b.pose.translation[k] =
        p[k] + random.symmetric(random.below(2) == 0 ? scale.size : scale.size + scale.centre);
  std::array<double, 3> middle;
  double ulp = 0;
  for (int k = 0; k < 3; ++k) {
    double w = 0;
    for (int i = 0; i < 3; ++i) w += b.pose.rotation[i][k] * (p[i] - b.pose.translation[i]);
    middle[k] = w;
    ulp = std::max({ulp, std::fabs(w) * 0x1p-23, std::fabs(p[k]) * 0x1p-51, 0x1p-149});
  }
  ulp += 4 * scale.deviation * std::hypot(middle[0], middle[1], middle[2]);
  ulp *= random.uniform(0.1, 3);
  constexpr int kCorners[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  for (const auto& corner : kCorners) {
    std::array<float, 3> vertex;
    for (int k = 0; k < 3; ++k) vertex[k] = static_cast<float>(middle[k] + ulp * corner[k]);
    b.vertices.push_back(vertex);
  }
  const std::vector<Point> around = b.points();
  if (!surely_inside(p, {around[0], around[1], around[2], around[3]})) return false;
  Direction far;  // in b's frame, beyond p along the direction
  for (int k = 0; k < 3; ++k) {
    far[k] = dot(b.posed_axis(k), along) < 0 ? -random.uniform(0, scale.size) : random.uniform(0, scale.size);
    for (int i = 0; i < 3; ++i) far[k] += b.axes[k][i] * middle[i];
  }
  add_vertex(b, far);
  enclose_vertices(random, b);
  return relate(trial);
}

TEST(OrientedBlocks, ContactsByConstructionAreNeverCalledApart) {
  RandomPoses random(2);
  std::uint64_t made = 0;
  const std::uint64_t count = hundredth_of(60'000'000);
  for (std::uint64_t i = 0; i < count; ++i) {
    Trial trial;
    if (!make_contact(random, any_scale(random), static_cast<int>(random.below(6)), trial)) continue;
    ++made;
    ASSERT_TRUE(overlap(trial)) << "trial " << i;
  }
  std::printf("%llu contacts\n", static_cast<unsigned long long>(made));
  EXPECT_GT(made, count / 4);
}

// Translations that float32 cannot hold, of boxes that are far apart: no overflow, and apart.
TEST(OrientedBlocks, AreApartAtAnyDistanceInRange) {
  const Box box = {{0, 0, 0}, {1, 1, 1}};
  const TreeExtent extent = {{2, 2, 2}, {2, 2, 2}, {2, 2, 2}};
  RandomPoses random(3);
  for (const double t : {1e2, 1e30, 1e38, 1e45, 1e48}) {
    for (int i = 0; i < 100; ++i) {
      Pose here = random.pose({}), there = random.pose({});
      there.translation[i % 3] = i % 2 == 0 ? t : -t;
      RelativePose b_in_a;
      ASSERT_EQ(relative_pose(here, extent, there, extent, b_in_a), RelativePoseStatus::kOk);
      const OrientedPose pose = oriented_pose(
          b_in_a.rotation, b_in_a.translation, oriented_slack(b_in_a, extent, extent),
          frame_of(packed(random_quaternion(random))), frame_of(packed(random_quaternion(random))));
      EXPECT_FALSE(overlap_oriented(box, box, pose)) << t;
    }
  }
}

}  // namespace
}  // namespace tandem::test
