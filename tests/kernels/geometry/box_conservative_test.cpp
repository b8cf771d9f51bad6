// Attacks the promise of relative_pose(): where a box test says apart, posed points are apart.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "kernels/geometry/box_test.h"
#include "kernels/tolerance/sure_verdicts.h"

namespace tandem::test {
namespace {

struct Side {
  Pose pose;
  Position lo, hi;
  Box box;

  Point corner(int which) const {
    const auto at = [&](int k) { return static_cast<double>((which >> k & 1) != 0 ? hi[k] : lo[k]); };
    Point out;
    apply(pose, at(0), at(1), at(2), out.data());
    return out;
  }
};

Direction column(const Pose& pose, int j) {
  return {pose.rotation[0][j], pose.rotation[1][j], pose.rotation[2][j]};
}

// World directions that are across the faces of the posed boxes: 3 + 3 + 9. Sheared boxes have them across
// their faces too.
Direction axis(const Pose& a, const Pose& b, int which) {
  if (which < 3) return cross(column(a, (which + 1) % 3), column(a, (which + 2) % 3));
  if (which < 6) return cross(column(b, (which + 1) % 3), column(b, (which + 2) % 3));
  return cross(column(a, (which - 6) / 3), column(b, (which - 6) % 3));
}

using Corners = std::array<Point, 8>;

Corners corners(const Side& side) {
  Corners out;
  for (int i = 0; i < 8; ++i) out[i] = side.corner(i);
  return out;
}

bool surely_apart(const Side& a, const Side& b) {
  const Corners corners_a = corners(a), corners_b = corners(b);
  for (int which = 0; which < 15; ++which) {
    if (plane_separates(corners_a, corners_b, axis(a.pose, b.pose, which))) return true;
  }
  return false;
}

// Moves b so that the boxes are `gap` apart along an axis and near each other along the others.
// Result: false if the axis has no length.
bool place(RandomPoses& random, const Side& a, Side& b, int which, double gap) {
  Direction along = axis(a.pose, b.pose, which);
  const Real length = std::sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
  if (length < 1e-12L) return false;
  Real reach = 0, aside_along = 0;
  Direction aside{}, centre_a{}, centre_b{};
  for (Real& x : along) x /= length;
  for (int j = 0; j < 3; ++j) {
    const Direction of_a = column(a.pose, j), of_b = column(b.pose, j);
    const Real half_a = 0.5L * (static_cast<Real>(a.hi[j]) - a.lo[j]),
               half_b = 0.5L * (static_cast<Real>(b.hi[j]) - b.lo[j]);
    Real on_a = 0, on_b = 0;
    for (int k = 0; k < 3; ++k) {
      on_a += along[k] * of_a[k];
      on_b += along[k] * of_b[k];
      centre_a[k] += of_a[k] * 0.5L * (static_cast<Real>(a.hi[j]) + a.lo[j]);
      centre_b[k] += of_b[k] * 0.5L * (static_cast<Real>(b.hi[j]) + b.lo[j]);
      aside[k] += of_a[k] * half_a * random.symmetric(0.4) + of_b[k] * half_b * random.symmetric(0.4);
    }
    reach += half_a * std::fabs(on_a) + half_b * std::fabs(on_b);
  }
  for (int k = 0; k < 3; ++k) aside_along += aside[k] * along[k];
  for (int k = 0; k < 3; ++k) {
    const Real moved = along[k] * (reach + gap - aside_along) + aside[k];
    b.pose.translation[k] = static_cast<double>(a.pose.translation[k] + centre_a[k] + moved - centre_b[k]);
  }
  return true;
}

double length(const float (&v)[3]) {
  return std::hypot(v[0], v[1], v[2]);
}

struct Trial {
  Side a, b;
  RelativePose b_in_a;
  double slack;
};

/// The poses of a trial. False: out of range.
bool relate(Trial& trial, const TreeExtent& extent_a) {
  const TreeExtent extent_b = extent_of(trial.b.box);
  return relative_pose(trial.a.pose, extent_a, trial.b.pose, extent_b, trial.b_in_a) ==
         RelativePoseStatus::kOk;
}

// Boxes whose gap along a random one of the 15 axes is within twice the slack, or exactly none.
bool make_trial(RandomPoses& random, const Scale& scale, double largest_gap_in_slacks, Trial& trial) {
  Side &a = trial.a, &b = trial.b;
  for (Side* side : {&a, &b}) {
    side->pose = random.pose(scale);
    side->box = random.box(scale, side->lo, side->hi);
  }
  // Now and then a tree that is larger than the box.
  TreeExtent extent_a = extent_of(a.box);
  if (random.below(8) == 0) {
    for (double& reach : extent_a.reach) reach = std::min(2 * reach, kLargestReach);
  }
  const auto which = static_cast<int>(random.below(15));
  if (!place(random, a, b, which, 0)) return false;
  if (!relate(trial, extent_a)) return false;
  trial.slack = length(trial.b_in_a.slack_a) + length(trial.b_in_a.slack_b);
  if (random.below(4) == 0) return true;
  if (!place(random, a, b, which, random.symmetric(largest_gap_in_slacks) * trial.slack)) return false;
  return relate(trial, extent_a);
}

TEST(BoxTest, WhatItCallsApartIsApartInExactArithmetic) {
  RandomPoses random(1);
  std::uint64_t apart = 0, made = 0;
  const std::uint64_t count = hundredth_of(100'000'000);
  for (std::uint64_t i = 0; i < count; ++i) {
    Trial trial;
    if (!make_trial(random, any_scale(random), 2, trial)) continue;
    ++made;
    ASSERT_TRUE(is_rigid(trial.a.pose) && is_rigid(trial.b.pose)) << i;
    if (overlap_15_axes(trial.a.box, trial.b.box, trial.b_in_a)) continue;
    ++apart;
    ASSERT_TRUE(surely_apart(trial.a, trial.b)) << "trial " << i;
  }
  std::printf("%llu trials, %llu apart\n", static_cast<unsigned long long>(made),
              static_cast<unsigned long long>(apart));
  EXPECT_GT(made, count / 2);
  EXPECT_GT(apart, made / 50);  // the trials are hard: most gaps lie within the slack
}

// A corner of a lies inside a tetrahedron of b's vertices, a few units in the last place large, and both
// boxes extend to opposite sides of it: contact by construction.
bool make_contact(RandomPoses& random, const Scale& scale, Trial& trial) {
  Side &a = trial.a, &b = trial.b;
  a.pose = random.pose(scale);
  b.pose = random.pose(scale);
  a.box = random.box(scale, a.lo, a.hi);
  const auto which = static_cast<int>(random.below(8));
  const Point p = a.corner(which);
  for (double& t : b.pose.translation) t = 0;
  for (int k = 0; k < 3; ++k) b.pose.translation[k] = p[k] + random.symmetric(scale.size + scale.centre);
  Position middle;
  double ulp = 0;
  for (int k = 0; k < 3; ++k) {
    double w = 0;
    for (int i = 0; i < 3; ++i) w += b.pose.rotation[i][k] * (p[i] - b.pose.translation[i]);
    middle[k] = static_cast<float>(w);
    ulp = std::max({ulp, std::fabs(w) * 0x1p-23, std::fabs(p[k]) * 0x1p-51, 0x1p-149});
  }
  // Deviation of the rotation: the transpose is no longer the inverse.
  ulp += 4 * scale.deviation * std::hypot(middle[0], middle[1], middle[2]);
  constexpr int kCorners[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  std::array<Point, 4> tetrahedron;
  for (int k = 0; k < 3; ++k) b.lo[k] = b.hi[k] = middle[k];
  for (int i = 0; i < 4; ++i) {
    Position w;
    for (int k = 0; k < 3; ++k) {
      w[k] = static_cast<float>(middle[k] + 3 * ulp * kCorners[i][k]);
      b.lo[k] = std::min(b.lo[k], w[k]);
      b.hi[k] = std::max(b.hi[k], w[k]);
    }
    apply(b.pose, w[0], w[1], w[2], tetrahedron[i].data());
  }
  if (!surely_inside(p, tetrahedron)) return false;
  // b grows away from a's middle, so that the contact is at a corner of both.
  const Point inner = a.corner(7 - which);
  for (int k = 0; k < 3; ++k) {
    double away = 0;
    for (int i = 0; i < 3; ++i) away += b.pose.rotation[i][k] * (p[i] - inner[i]);
    float& end = away > 0 ? b.hi[k] : b.lo[k];
    end = static_cast<float>(end + (away > 0 ? 1 : -1) * random.uniform(0, scale.size));
  }
  b.box = enclose(b.lo, b.hi);
  return relate(trial, extent_of(a.box));
}

TEST(BoxTest, ContactsByConstructionAreNeverCalledApart) {
  RandomPoses random(2);
  std::uint64_t made = 0;
  const std::uint64_t count = hundredth_of(100'000'000);
  for (std::uint64_t i = 0; i < count; ++i) {
    Trial trial;
    if (!make_contact(random, any_scale(random), trial)) continue;
    ++made;
    ASSERT_TRUE(overlap_15_axes(trial.a.box, trial.b.box, trial.b_in_a)) << "trial " << i;
  }
  std::printf("%llu contacts\n", static_cast<unsigned long long>(made));
  EXPECT_GT(made, count / 3);
}

// How much the slack costs: boxes placed at random distances, as a traversal meets them.
double overlaps_that_are_apart(Scale scale, std::uint64_t seed) {
  RandomPoses random(seed);
  std::uint64_t overlaps = 0, wrong = 0;
  for (int i = 0; i < 200'000; ++i) {
    Trial trial;
    if (!make_trial(random, scale, 0, trial)) continue;
    if (!place(random, trial.a, trial.b, static_cast<int>(random.below(15)),
               random.symmetric(0.5) * scale.size))
      continue;
    if (relative_pose(trial.a.pose, extent_of(trial.a.box), trial.b.pose, extent_of(trial.b.box),
                      trial.b_in_a) != RelativePoseStatus::kOk)
      continue;
    if (!overlap_15_axes(trial.a.box, trial.b.box, trial.b_in_a)) continue;
    ++overlaps;
    wrong += surely_apart(trial.a, trial.b);
  }
  EXPECT_GT(overlaps, 10'000u);
  return static_cast<double>(wrong) / static_cast<double>(overlaps);
}

TEST(BoxTest, SlackCostsNextToNothingInOrdinaryScenes) {
  Scale near, far;
  far.translation = 1e7;
  const double at_origin = overlaps_that_are_apart(near, 3), far_away = overlaps_that_are_apart(far, 4);
  std::printf("overlaps that are apart: %.2e at the origin, %.2e at 10^7 lengths\n", at_origin, far_away);
  EXPECT_LT(at_origin, 1e-4);
  EXPECT_LT(far_away, 1e-4);
}

/// Numbers beyond float32 are not converted to it, which C++ leaves undefined.
void expect_finite(const RelativePose& pose) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(std::isfinite(pose.slack_a[i]) && std::isfinite(pose.slack_b[i]));
    EXPECT_TRUE(std::isfinite(pose.translation[i]) || std::isnan(pose.translation[i]));
    for (int j = 0; j < 3; ++j)
      EXPECT_TRUE(std::isfinite(pose.rotation[i][j]) && std::isfinite(pose.abs_rotation[i][j]));
  }
}

TEST(RelativePose, ConvertsNothingThatFloat32CannotHold) {
  const TreeExtent small = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}},
                   endless = {{1e300, 1, 1}, {1e300, 1, INFINITY}, {1e300, 1, 1}};
  for (const double huge : std::initializer_list<double>{1e39, 1e80, 1e200, 1e300, INFINITY, -1e300,
                                                         -INFINITY, static_cast<double>(NAN)}) {
    for (int entry = 0; entry < 12; ++entry) {
      Pose hostile = kIdentityPose;
      (entry < 9 ? hostile.rotation[entry / 3][entry % 3] : hostile.translation[entry - 9]) = huge;
      for (const TreeExtent& extent : {small, endless}) {
        RelativePose out;
        const bool far_translation_in_range = entry >= 9 && std::fabs(huge) < 1e50;
        const RelativePoseStatus expected = far_translation_in_range && extent.reach[0] == 1
                                                ? RelativePoseStatus::kOk
                                                : RelativePoseStatus::kOutOfRange;
        EXPECT_EQ(relative_pose(kIdentityPose, small, hostile, extent, out), expected)
            << huge << ' ' << entry;
        expect_finite(out);
        // A hostile a may be in range: its inverse need not be good.
        static_cast<void>(relative_pose(hostile, extent, kIdentityPose, small, out));
        expect_finite(out);
      }
    }
  }
}

TEST(RelativePose, RefusesWhatFloat32CannotHold) {
  const TreeExtent small = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}},
                   large = {{0x1p121, 1, 1}, {1, 1, 1}, {0x1p121, 1, 1}};
  Pose far = kIdentityPose, broken = kIdentityPose, scaled = kIdentityPose;
  far.translation[1] = 1e52;
  broken.rotation[2][2] = NAN;
  for (int i = 0; i < 3; ++i) scaled.rotation[i][i] = 2;
  const Pose& here = kIdentityPose;
  RelativePose out;
  EXPECT_EQ(relative_pose(here, small, here, small, out), RelativePoseStatus::kOk);
  EXPECT_EQ(relative_pose(here, large, here, small, out), RelativePoseStatus::kOutOfRange);
  EXPECT_EQ(relative_pose(here, small, here, large, out), RelativePoseStatus::kOutOfRange);
  EXPECT_EQ(relative_pose(here, small, far, small, out), RelativePoseStatus::kOutOfRange);
  EXPECT_EQ(relative_pose(far, small, here, small, out), RelativePoseStatus::kOutOfRange);
  EXPECT_EQ(relative_pose(broken, small, here, small, out), RelativePoseStatus::kOutOfRange);
  EXPECT_EQ(relative_pose(here, small, broken, small, out), RelativePoseStatus::kOutOfRange);
  EXPECT_EQ(relative_pose(here, small, scaled, small, out), RelativePoseStatus::kOutOfRange);
}

// Translations that float32 cannot hold, of boxes that are far apart: no overflow, and apart.
TEST(RelativePose, HoldsBoxesApartAtAnyDistanceInRange) {
  const Box box = {{0, 0, 0}, {1, 1, 1}};
  for (const double t : {1e30, 1e38, 1e45, 1e48}) {
    Pose there = kIdentityPose;
    there.translation[2] = -t;
    RelativePose out;
    ASSERT_EQ(relative_pose(kIdentityPose, extent_of(box), there, extent_of(box), out),
              RelativePoseStatus::kOk);
    EXPECT_FALSE(overlap_15_axes(box, box, out)) << t;
  }
}

// Climbs to touches that need as much of the box tests' slack as any can: the reserve in it is kSafety alone.

/// Describes two boxes that touch along one axis of a: a vertex of each, which are one point as posed, and
/// how far each box extends away from it.
struct AlongAxis {
  float at_a, at_b, extent_a, extent_b;
};

/// A rotation of b that permutes the axes, and what touches along each axis of a.
struct Touch {
  Pose turn;
  AlongAxis along[3];
};

float anywhere(RandomPoses& random) {
  return static_cast<float>(random.symmetric(2) * std::ldexp(1.0, static_cast<int>(random.below(40)) - 12));
}

Touch any_touch(RandomPoses& random) {
  Touch touch;
  touch.turn = random.pose({1, 1, 0, 0, 0});
  for (AlongAxis& along : touch.along) {
    along = {anywhere(random), anywhere(random), std::fabs(anywhere(random)), std::fabs(anywhere(random))};
  }
  return touch;
}

/// One number becomes another one, a few units in the last place away or anything.
Touch mutated(RandomPoses& random, Touch touch) {
  AlongAxis& along = touch.along[random.below(3)];
  float* const which[4] = {&along.at_a, &along.at_b, &along.extent_a, &along.extent_b};
  float& x = *which[random.below(4)];
  const bool is_extent = &x == &along.extent_a || &x == &along.extent_b;
  switch (random.below(4)) {
    case 0:
      x = anywhere(random);
      break;
    case 1:
      x *= static_cast<float>(random.uniform(0.5, 2));
      break;
    default:
      for (std::uint64_t i = random.below(30) + 1; i > 0; --i)
        x = std::nextafter(x, random.below(2) == 0 ? 1e30f : -1e30f);
  }
  if (is_extent) x = std::fabs(x);
  return touch;
}

struct Posed {
  Box a, b;
  Pose pose_b;
};

/// a = [at_a - extent_a, at_a] at the identity; b = [at_b, at_b + extent_b] along the axes of a, before its
/// turn. The translation takes b's vertex to a's; false where float64 rounds on the way.
bool posed(const Touch& touch, Posed& out) {
  Position lo_a{}, hi_a{}, lo_b{}, hi_b{}, vertex_b{};
  out.pose_b = touch.turn;
  for (int i = 0; i < 3; ++i) {
    const AlongAxis& along = touch.along[i];
    lo_a[i] = along.at_a - along.extent_a;
    hi_a[i] = along.at_a;
    for (int j = 0; j < 3; ++j) {
      const double turn = touch.turn.rotation[i][j];
      if (turn == 0) continue;
      const auto sign = static_cast<float>(turn);
      vertex_b[j] = sign * along.at_b;
      const float end = sign * (along.at_b + along.extent_b);
      lo_b[j] = std::min(vertex_b[j], end);
      hi_b[j] = std::max(vertex_b[j], end);
    }
    out.pose_b.translation[i] = static_cast<double>(along.at_a) - static_cast<double>(along.at_b);
  }
  double point[3];
  apply(out.pose_b, vertex_b[0], vertex_b[1], vertex_b[2], point);
  for (int i = 0; i < 3; ++i) {
    if (point[i] != static_cast<double>(touch.along[i].at_a)) return false;
  }
  out.a = enclose(lo_a, hi_a);
  out.b = enclose(lo_b, hi_b);
  return true;
}

bool overlap_with(const Posed& posed, RelativePose pose, double share_of_slack) {
  for (float* slack : {pose.slack_a, pose.slack_b}) {
    for (int k = 0; k < 3; ++k) slack[k] = static_cast<float>(share_of_slack * static_cast<double>(slack[k]));
  }
  return overlap_6_axes(posed.a, posed.b, pose);
}

/// No touch needs more than this share of the slack: kSafety reserves the rest, but for a little rounding.
constexpr double kMostNeeded = 0.9991;
static_assert(kMostNeeded > 1 / relative_pose_detail::kSafety);

/// The smallest share of the slack by which the test does not lose the touch; more than 1 where it does lose
/// it, and below 0 where there is no touch.
double needed_share(const Touch& touch) {
  Posed posed_touch;
  RelativePose pose;
  if (!posed(touch, posed_touch)) return -1;
  if (relative_pose(kIdentityPose, extent_of(posed_touch.a), posed_touch.pose_b, extent_of(posed_touch.b),
                    pose) != RelativePoseStatus::kOk)
    return -1;
  if (!overlap_with(posed_touch, pose, 1)) return 2;
  double enough = 1, little = 0;
  if (overlap_with(posed_touch, pose, little)) return 0;
  while (enough - little > 1e-5) {
    const double middle = 0.5 * (enough + little);
    (overlap_with(posed_touch, pose, middle) ? enough : little) = middle;
  }
  return enough;
}

TEST(BoxTest, TouchesNeedAllOfTheSlackButItsReserve) {
  RandomPoses random(1);
  double most = 0;
  const auto climbs = static_cast<int>(hundredth_of(20000));
  for (int climb = 0; climb < climbs; ++climb) {
    Touch best = any_touch(random);
    double share = needed_share(best);
    for (int step = 0; step < 6000; ++step) {
      const Touch next = mutated(random, best);
      const double needed = needed_share(next);
      ASSERT_LE(needed, kMostNeeded) << "climb " << climb << ", step " << step
                                     << (needed > 1 ? ": a touch is lost" : ": the reserve is smaller");
      if (needed < share) continue;
      best = next;
      share = needed;
    }
    most = std::max(most, share);
  }
  std::printf("%d climbs: a touch needs %.4f of the slack\n", climbs, most);
  EXPECT_GT(most, 0.998);  // else the climbs are too weak to show anything
}

}  // namespace
}  // namespace tandem::test
