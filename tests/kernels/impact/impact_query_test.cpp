// Times of impact, on the CPU.
#include "tandem/kernels/impact_query.h"
#include "kernels/asked.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "moving_scenes.h"

namespace tandem {
namespace {

using test::cube;
using test::ImpactChecker;
using test::Mesh;
using test::MotionFamily;
using test::moving;
using test::moving_crowd;
using test::MovingScene;
using test::soup;

class Impacts : public testing::Test {
 protected:
  Impact impact(const MovingScene& moves, const ImpactOptions& options = {}) {
    const ObjectPair pair[] = {{0, 1}};
    EXPECT_EQ(query_.set_assets(moves.scene.assets.views()), Status::kOk);
    EXPECT_EQ(ask_of(moves, moves.duration, pair, options), Status::kOk);
    EXPECT_EQ(query_.rows().size(), 1u);
    return query_.rows()[0];
  }

  /// Asks about the pairs that are found.
  Status ask_of(const MovingScene& moves, double duration, ImpactOptions options = {}) {
    options.motion = moves.motion;
    options.duration = duration;
    return query_.find(moves.scene.instances, options);
  }
  Status ask_of(const MovingScene& moves, double duration, std::span<const ObjectPair> pairs,
                ImpactOptions options = {}) {
    options.motion = moves.motion;
    options.duration = duration;
    return query_.find(moves.scene.instances, pairs, options);
  }

  test::Asked<ImpactQuery> query_;
};

MovingScene two_cubes(const Pose& second, const RigidMotion& first_moves, const RigidMotion& second_moves) {
  MovingScene moves;
  moves.scene.assets.add(cube(0.5f));
  moves.add(0, kIdentityPose, first_moves);
  moves.add(0, second, second_moves);
  return moves;
}

TEST_F(Impacts, ABoxThatFallsOnABoxStopsATimeBeforeIt) {
  const MovingScene moves = two_cubes(at(0.25, 0.125, 3), kAtRest, moving(0, 0, -4));
  const Impact found = impact(moves);
  EXPECT_EQ(found.status, ImpactStatus::found);
  const double tolerance = 1e-6 * std::sqrt(3);
  EXPECT_LT(found.t_safe, 0.5);
  EXPECT_GE(found.t_safe, 0.5 - tolerance / 4);
  EXPECT_NEAR(found.gap, 4 * (0.5 - found.t_safe), 1e-11);
  EXPECT_NEAR(found.point_a[2], 0.5, 1e-11);
  EXPECT_NEAR(found.point_b[2], 0.5 + found.gap, 1e-11);
}

TEST_F(Impacts, AFinerToleranceComesNearer) {
  const MovingScene moves = two_cubes(at(0.25, 0.125, 3), kAtRest, moving(0, 0, -4));
  ImpactOptions options;
  for (options.tolerance = 1e-1; options.tolerance > 1e-11; options.tolerance /= 10) {
    const Impact found = impact(moves, options);
    EXPECT_GT(found.gap, 0.4 * std::sqrt(3) * options.tolerance);
    EXPECT_LE(found.gap, std::sqrt(3) * options.tolerance);
  }
}

TEST_F(Impacts, ASpinningPlateStrikesWhereItsCircleMeetsTheWall) {
  // A bar of length 2 about its middle, its end at a distance of 1 from the axis; a wall at x = 0.9.
  MovingScene moves;
  moves.scene.assets.add(test::box(1e-6f, 2, 0.5f));
  moves.scene.assets.add(test::box(0.2f, 4, 4));
  moves.add(0, kIdentityPose, {{0, 0, 0}, {0, 0, -2}, {0, 0, 0}});
  moves.add(1, at(1, 0, 0), kAtRest);
  const Impact found = impact(moves);
  EXPECT_EQ(found.status, ImpactStatus::found);
  EXPECT_NEAR(found.t_safe, std::asin(0.9) / 2, 1e-5);
}

TEST_F(Impacts, TurningAboutACentreElsewhereIsAnOrbit) {
  // A cube at x = 2 goes round the origin; another one is a quarter of a turn ahead.
  const Pose ahead = at(0, 2, 0);
  const double quarter = std::numbers::pi / 2;
  MovingScene moves = two_cubes(ahead, {{0, 0, 0}, {0, 0, quarter}, {0, 0, 0}}, kAtRest);
  moves.scene.instances[0].pose = at(2, 0, 0);
  const Impact found = impact(moves);
  EXPECT_EQ(found.status, ImpactStatus::found);
  // Its corner (2 + .5, .5) is the first to reach x = .5 or the other's side.
  const double radius = std::hypot(2.5, 0.5), start = std::atan2(0.5, 2.5);
  EXPECT_GT(found.t_safe, 0.3);
  EXPECT_LE(found.t_safe, (std::acos(0.5 / radius) - start) / quarter + 1e-9);
}

TEST_F(Impacts, BodiesThatComeApartOrSlideOrRestJustApartGoOn) {
  for (const double gap : {1e-3, 1e-6, 1e-9, 1e-10}) {
    const Pose above = at(0, 0, 1 + gap);
    EXPECT_EQ(impact(two_cubes(above, kAtRest, moving(0, 0, 5))).status, ImpactStatus::none) << gap;
    EXPECT_EQ(impact(two_cubes(above, kAtRest, moving(50, 3, 0))).status, ImpactStatus::none) << gap;
    EXPECT_EQ(impact(two_cubes(above, kAtRest, kAtRest)).status, ImpactStatus::none) << gap;
    EXPECT_EQ(impact(two_cubes(above, moving(9, 8, 7), moving(9, 8, 7))).status, ImpactStatus::none) << gap;
    const RigidMotion spin = {{0, 0, 0}, {0, 0, 7}, {0.25, 0.25, 1}};
    EXPECT_EQ(impact(two_cubes(above, kAtRest, spin)).status, ImpactStatus::none) << gap;
  }
}

TEST_F(Impacts, BodiesThatTouchAtTheStartAreToldSo) {
  for (const double z : {1.0, 0.9, 0.5}) {
    const Impact found = impact(two_cubes(at(0.1, 0.2, z), kAtRest, moving(0, 0, 5)));
    EXPECT_EQ(found.status, ImpactStatus::at_start);
    EXPECT_EQ(found.t_safe, 0);
    EXPECT_EQ(found.gap, 0);
    EXPECT_NE(found.triangle_a, kNoIndex);
  }
}

TEST_F(Impacts, AThinPlateDoesNotTunnelAtAnySpeed) {
  for (const double speed : {1.0, 1e2, 1e4, 1e8}) {
    MovingScene moves;
    moves.scene.assets.add(test::box(1, 1, 0.01f));
    moves.add(0, kIdentityPose, kAtRest);
    moves.add(0, at(0.3, 0.2, 0.5), moving(0, 0, -speed));
    const Impact found = impact(moves);
    EXPECT_EQ(found.status, ImpactStatus::found);
    EXPECT_LE(speed * found.t_safe, 0.5 - double{0.01f});
    EXPECT_GE(speed * found.t_safe, 0.48999 - 1e-12 * speed);
  }
}

TEST_F(Impacts, AnInstanceAndItselfDoNotMoveRelativeToEachOther) {
  Mesh apart;
  apart.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  apart.add({0, 0, 1}, {1, 0, 1}, {0, 1, 1});
  MovingScene moves;
  moves.scene.assets.add(apart);
  moves.scene.assets.add(cube(0.5f));
  moves.add(0, kIdentityPose, moving(1, 2, 3));
  moves.add(1, kIdentityPose, moving(1, 2, 3));
  const ObjectPair pairs[] = {{0, 0}, {1, 1}};
  ASSERT_EQ(query_.set_assets(moves.scene.assets.views()), Status::kOk);
  ASSERT_EQ(ask_of(moves, 1, pairs), Status::kOk);
  EXPECT_EQ(query_.rows()[0].status, ImpactStatus::none);
  EXPECT_EQ(query_.rows()[1].status, ImpactStatus::at_start);
}

TEST_F(Impacts, PairsThatAreLeftOutDoNotMeet) {
  const MovingScene moves = moving_crowd(3, 60);
  ASSERT_EQ(query_.set_assets(moves.scene.assets.views()), Status::kOk);
  ASSERT_EQ(ask_of(moves, 1), Status::kOk);
  std::vector<ObjectPair> all;
  for (std::uint32_t b = 1; b < 60; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) all.push_back({a, b});
  }
  const std::vector<ObjectPair> pairs(query_.pairs().begin(), query_.pairs().end());
  const std::vector<Impact> impacts(query_.rows().begin(), query_.rows().end());
  ASSERT_EQ(ask_of(moves, 1, all), Status::kOk);
  EXPECT_LT(pairs.size(), all.size());
  std::size_t matched = 0, meet = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto found = std::find_if(pairs.begin(), pairs.end(), [&](const ObjectPair& pair) {
      return pair.a == all[i].a && pair.b == all[i].b;
    });
    const Impact& impact = query_.rows()[i];
    meet += impact.status != ImpactStatus::none;
    if (found == pairs.end()) {
      EXPECT_EQ(impact.status, ImpactStatus::none) << all[i].a << ' ' << all[i].b;
      continue;
    }
    ++matched;
    EXPECT_EQ(impact.t_safe, impacts[static_cast<std::size_t>(found - pairs.begin())].t_safe);
  }
  EXPECT_EQ(matched, pairs.size());
  EXPECT_GT(meet, 20u);
}

// Bodies that rest stay as they are to the bit, wherever the centre of their motion is.
TEST_F(Impacts, BodiesAtRestNeverMeetWhetherTheirPairIsFoundOrGiven) {
  RandomPoses random(19);
  const int count = test::trials(400, 10);
  std::size_t given = 0, found = 0, near = 0;
  for (int i = 0; i < count; ++i) {
    const double far = i % 2 == 0 ? 0 : std::pow(10, random.uniform(0, 8));
    const double gap = std::pow(10, random.uniform(-16, -3));
    Pose low = at(far, random.symmetric(far), 0), high = low;
    high.translation[0] += random.symmetric(0.5);
    high.translation[2] = 1 + gap;
    MovingScene moves = two_cubes(high, kAtRest, kAtRest);
    moves.scene.instances[0].pose = low;
    for (RigidMotion& motion : moves.motion) {
      for (double& x : motion.centre) x = random.symmetric(i % 3 == 0 ? 0 : far + 10);
    }
    const ImpactChecker checker(moves);
    const Impact impact = this->impact(moves);
    const bool touch = ImpactChecker(moves).touch_at(0);
    const ImpactStatus expected = touch ? ImpactStatus::at_start : ImpactStatus::none;
    EXPECT_EQ(impact.status, expected) << "gap " << gap << " far " << far;
    EXPECT_EQ(ImpactChecker(moves).touch_at(0.7), touch);
    ++given;
    ASSERT_EQ(ask_of(moves, moves.duration), Status::kOk);
    for (const Impact& row : query_.rows()) {
      ++found;
      EXPECT_EQ(row.status, impact.status) << "gap " << gap << " far " << far;
      EXPECT_EQ(row.t_safe, impact.t_safe);
    }
    near += !touch;
  }
  EXPECT_GT(near, given / 4);
  EXPECT_GT(found, 0u);
}

// The scene finds no pair whose boxes, swept by the motions, are apart.
TEST_F(Impacts, AGivenPairThatTheSceneDoesNotFindDoesNotMeet) {
  RandomPoses random(20);
  const int count = test::trials(400, 10);
  std::size_t left_out = 0;
  for (int i = 0; i < count; ++i) {
    const double gap = std::pow(10, random.uniform(-15, -6)), far = std::pow(10, random.uniform(0, 6));
    MovingScene moves = two_cubes(at(0.3, 0.2, 1 + gap), moving(0, 0, 0), moving(0.1, 0.1, 0));
    for (RigidMotion& motion : moves.motion) motion.centre[0] = random.symmetric(far);
    const Impact impact = this->impact(moves);
    ASSERT_EQ(ask_of(moves, moves.duration), Status::kOk);
    if (!query_.rows().empty()) {
      EXPECT_EQ(query_.rows()[0].status, impact.status);
      EXPECT_EQ(query_.rows()[0].t_safe, impact.t_safe);
    } else {
      ++left_out;
      EXPECT_EQ(impact.status, ImpactStatus::none) << "gap " << gap << " far " << far;
    }
  }
  EXPECT_GT(left_out, 0u);
}

TEST_F(Impacts, ThreadsChangeNothing) {
  const MovingScene moves = moving_crowd(4, 80);
  ASSERT_EQ(query_.set_assets(moves.scene.assets.views()), Status::kOk);
  ASSERT_EQ(ask_of(moves, 1), Status::kOk);
  const std::vector<Impact> alone(query_.rows().begin(), query_.rows().end());
  const ImpactCounters counters = query_.counters();
  EXPECT_EQ(counters.object_pairs, alone.size());
  EXPECT_GT(counters.found, 0u);
  EXPECT_GT(counters.at_start, 0u);
  for (const std::uint32_t threads : {2u, 5u, 16u}) {
    EXPECT_EQ(query_.scene.set_threads(threads), Status::kOk);
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(ask_of(moves, 1), Status::kOk);
      ASSERT_EQ(query_.rows().size(), alone.size());
      EXPECT_EQ(query_.counters(), counters);
      for (std::size_t row = 0; row < alone.size(); ++row) {
        const Impact &x = query_.rows()[row], &y = alone[row];
        EXPECT_EQ(x.t_safe, y.t_safe);
        EXPECT_EQ(x.gap, y.gap);
        EXPECT_EQ(x.triangle_a, y.triangle_a);
        EXPECT_EQ(x.triangle_b, y.triangle_b);
        EXPECT_TRUE(std::equal(x.point_a, x.point_a + 3, y.point_a));
        EXPECT_TRUE(std::equal(x.point_b, x.point_b + 3, y.point_b));
      }
    }
  }
}

/// One body that turns within another, about an axis that is turned somehow.
MovingScene one_within_another(const Mesh& inner, const Mesh& outer, double turn_inner, double turn_outer,
                               const std::array<double, 3>& along) {
  RandomPoses random(3);
  const Pose whole = test::any_rotation(random);
  MovingScene moves;
  moves.scene.assets.add(inner);
  moves.scene.assets.add(outer);
  for (const double turn : {turn_inner, turn_outer}) {
    RigidMotion motion = kAtRest;
    const bool first = moves.motion.empty();
    for (int k = 0; k < 3; ++k) {
      motion.angular_velocity[k] = turn * whole.rotation[k][2];
      for (int j = 0; j < 3 && first; ++j) motion.velocity[k] += whole.rotation[k][j] * along[j];
    }
    moves.add(first ? 0 : 1, whole, motion);
  }
  return moves;
}

// Most triangles of each are near one of the other in every piece of the step.
TEST_F(Impacts, OneBodyThatTurnsWithinAnotherLooksAtFewPairsHoweverFarItTurns) {
  const Mesh ball = test::sphere(1, 4), socket = test::sphere(1.01, 4);
  const Mesh shaft = test::regular_prism(512, 1, 1), bearing = test::pipe(512, 1.01, 1.25, 2);
  const MovingScene scenes[] = {one_within_another(ball, socket, 16, 0, {0, 0, 0}),
                                one_within_another(ball, socket, 16, 0, {0.001, -0.001, 0.002}),
                                one_within_another(ball, socket, 0, 16, {0, 0, 0}),
                                one_within_another(ball, socket, 16, -5, {0, 0, 0}),
                                one_within_another(shaft, bearing, 16, 0, {0, 0, 0.25}),
                                one_within_another(shaft, bearing, 16, -32, {0, 0.002, 0.25})};
  for (const MovingScene& moves : scenes) {
    EXPECT_EQ(impact(moves).status, ImpactStatus::none);
    EXPECT_LT(query_.counters().block_pairs + query_.counters().triangle_pairs, 10'000u);
  }
}

// Fins beside the ball and the socket meet when they would without these.
TEST_F(Impacts, WhatTurnsWithinAnotherStopsWhereOtherPartsMeet) {
  const Mesh fin = test::moved(test::box(0.25f, 0.25f, 0.25f), 3, 0, 0),
             other = test::moved(test::box(0.25f, 0.25f, 0.25f), -1.5f, 2.5f, 0.125f);
  const Mesh inner = test::joined(test::sphere(1, 4), fin),
             outer = test::joined(test::sphere(1.01, 4), other);
  RandomPoses random(4);
  for (const double turn : {16.0, -16.0}) {
    for (const double turn_outer : {0.0, 3.0}) {
      const MovingScene alone = one_within_another(fin, other, turn, turn_outer, {0, 0, 0.01});
      const MovingScene moves = one_within_another(inner, outer, turn, turn_outer, {0, 0, 0.0001});
      const Impact expected = impact(alone), found = impact(moves);
      EXPECT_EQ(expected.status, ImpactStatus::found);
      EXPECT_EQ(found.status, ImpactStatus::found);
      EXPECT_NEAR(found.t_safe, expected.t_safe, 1e-4);
      EXPECT_LT(query_.counters().block_pairs + query_.counters().triangle_pairs, 20'000u);
      ImpactChecker(moves).check(found, random, 20);
    }
  }
}

class ImpactFamilies : public Impacts, public testing::WithParamInterface<MotionFamily> {};

TEST_P(ImpactFamilies, NothingTouchesUntilTSafeAndThenTheGapIsWhatIsTold) {
  RandomPoses random(7);
  const int count = test::trials(200, 6);
  int found = 0, none = 0, near = 0;
  for (int i = 0; i < count && !HasFailure(); ++i) {
    const MovingScene moves = GetParam().make(random);
    // Without a tolerance nothing but rounding is left between what stops.
    ImpactOptions options;
    if (i % 2 != 0) options.tolerance = 0;
    const Impact impact = this->impact(moves, options);
    ImpactChecker(moves).check(impact, random, test::trials(100, 10));
    found += impact.status == ImpactStatus::found;
    none += impact.status == ImpactStatus::none;
    const double far = std::fabs(impact.point_a[0]) + std::fabs(moves.motion[0].centre[0]);
    near += impact.status == ImpactStatus::found && impact.gap <= 1.1e-6 * moves.diagonal() + 1e-14 * far;
    if (HasFailure()) ADD_FAILURE() << "motion " << i << "\n" << text(moves.scene);
  }
  RecordProperty("found", found);
  RecordProperty("none", none);
  EXPECT_GT(found, count / 20);
  EXPECT_GT(none, 0);
  EXPECT_GE(near, found * 0.99);
}

/// What float64 may leave between triangles that stop, besides the tolerance: docs/impact.md has this
/// formula.
double resolution_of(const MovingScene& moves) {
  double turn = 0, size = 0, offset = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const Instance& body = moves.scene.instances[i];
    const RigidMotion& motion = moves.motion[i];
    const AssetView& asset = moves.scene.assets.views()[body.asset];
    const Pose stored = for_stored_coordinates(body.pose, asset.header->origin);
    double farthest = 0;
    for (std::uint32_t t = 0; t < asset.level().triangle_count; ++t) {
      for (const auto& corner : asset.level().triangles[t].corner) {
        const double x = corner.position[0], y = corner.position[1], z = corner.position[2];
        farthest = std::max(farthest, std::hypot(x, y, z));
      }
    }
    const auto& [v, w, c] = motion;
    const auto& x = stored.translation;
    turn = std::max(turn, moves.duration * std::hypot(w[0], w[1], w[2]));
    size += farthest + std::hypot(x[0] - c[0], x[1] - c[1], x[2] - c[2]) +
            moves.duration * std::hypot(v[0], v[1], v[2]) + 0x1p-8 * std::hypot(c[0], c[1], c[2]);
  }
  const auto &a = moves.motion[0].centre, &b = moves.motion[1].centre;
  offset = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  return 0x1p-41 * (1 + turn) * (size + offset);
}

TEST_P(ImpactFamilies, TheGapIsAtMostTheToleranceAndTheResolution) {
  RandomPoses random(8);
  const int count = test::trials(120, 6);
  int found = 0;
  double largest = 0;
  for (int i = 0; i < count; ++i) {
    MovingScene moves = GetParam().make(random);
    if (i % 2 != 0) {  // up to the largest turn
      const double turns = std::pow(10, random.uniform(0, 3)) / moves.duration;
      for (RigidMotion& motion : moves.motion) {
        auto& w = motion.angular_velocity;
        const double length = std::hypot(w[0], w[1], w[2]);
        for (int k = 0; k < 3 && length > 0; ++k) w[k] *= turns / length;
      }
    }
    ImpactOptions options;
    if (i % 3 != 0) options.tolerance = i % 3 == 1 ? 0 : 1e-9;
    const Impact impact = this->impact(moves, options);
    if (impact.status != ImpactStatus::found || query_.counters().unconverged != 0) continue;
    ++found;
    const double beyond = impact.gap - options.tolerance * moves.diagonal();
    largest = std::max(largest, beyond / resolution_of(moves));
    EXPECT_LE(beyond, resolution_of(moves)) << "motion " << i;
  }
  EXPECT_GT(found, count / 20);
  EXPECT_GT(largest, 0.1);
}

INSTANTIATE_TEST_SUITE_P(All, ImpactFamilies, testing::ValuesIn(test::kMotionFamilies),
                         [](const auto& family) {
                           std::string name = family.param.name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace tandem
