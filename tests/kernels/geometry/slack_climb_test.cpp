// Climbs to touches that need as much of the box tests' slack as any can: the reserve in it is kSafety alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "kernels/geometry/box_test.h"
#include "kernels/tolerance/sure_verdicts.h"

namespace tandem {
namespace {

using test::RandomPoses;

/// What two boxes that touch are made of along one axis of a: a vertex of either, which are one point as
/// posed, and how far each box extends away from it.
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

/// What kSafety leaves of a slack whose every term is used up, and a little for how it is rounded.
constexpr double kMostNeeded = 0.9991;
static_assert(kMostNeeded > 1 / relative_pose_detail::kSafety);

/// The smallest share of the slack by which the test does not lose the touch; more than 1 where it does lose
/// it, and below 0 where there is no touch.
double needed_share(const Touch& touch) {
  Posed posed_touch;
  RelativePose pose;
  if (!posed(touch, posed_touch)) return -1;
  if (relative_pose(kIdentityPose, test::extent_of(posed_touch.a), posed_touch.pose_b,
                    test::extent_of(posed_touch.b), pose) != RelativePoseStatus::kOk)
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
  const auto climbs = static_cast<int>(test::hundredth_of(20000));
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
}  // namespace tandem
