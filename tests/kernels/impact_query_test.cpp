// Times of impact, on the CPU.
#include "tandem/kernels/impact_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "contact_query_fixture.h"
#include "solid_meshes.h"
#include "tandem/kernels/detail/impact/triangle_impact.h"
#include "tandem/kernels/excluded_pairs.h"

namespace tandem {
namespace {

using test::cube;
using test::Mesh;
using test::soup;

// Instances that move for a second or less.
struct MovingScene {
  Scene scene;
  std::vector<RigidMotion> motion;
  double duration = 1;

  void add(std::uint32_t asset, const Pose& pose, const RigidMotion& moves) {
    scene.instances.push_back({asset, pose});
    motion.push_back(moves);
  }
  Pose pose(std::size_t i, double t) const { return pose_at(scene.instances[i].pose, motion[i], t); }
  double diagonal() const {
    double least = INFINITY;
    for (std::uint32_t a = 0; a < scene.assets.size(); ++a) {
      const FileHeader& header = *scene.assets.views()[a].header;
      double squared = 0;
      for (int k = 0; k < 3; ++k) {
        const double side = static_cast<double>(header.upper[k]) - static_cast<double>(header.lower[k]);
        squared += side * side;
      }
      least = std::min(least, std::sqrt(squared));
    }
    return least;
  }
};

RigidMotion moving(double x, double y, double z) {
  return {{x, y, z}, {0, 0, 0}, {0, 0, 0}};
}

// A wheel of this many teeth about the z axis.
Mesh gear(int teeth, double inner, double outer, float height) {
  Mesh mesh;
  const int corners = 4 * teeth;
  const auto rim = [&](int i, float z) -> std::array<float, 3> {
    const double angle = 2 * std::numbers::pi * i / corners, r = i % 4 < 2 ? outer : inner;
    return {static_cast<float>(r * std::cos(angle)), static_cast<float>(r * std::sin(angle)), z};
  };
  const float z = height / 2;
  for (int i = 0; i < corners; ++i) {
    mesh.add({0, 0, z}, rim(i, z), rim(i + 1, z));
    mesh.add({0, 0, -z}, rim(i + 1, -z), rim(i, -z));
    mesh.add(rim(i, -z), rim(i + 1, -z), rim(i + 1, z));
    mesh.add(rim(i, -z), rim(i + 1, z), rim(i, z));
  }
  return mesh;
}

class Impacts : public testing::Test {
 protected:
  Impact impact(const MovingScene& moves, const ImpactOptions& options = {}) {
    const ObjectPair pair[] = {{0, 1}};
    EXPECT_EQ(query_.set_assets(moves.scene.assets.views()), Status::kOk);
    EXPECT_EQ(query_.find(moves.scene.instances, moves.motion, moves.duration, pair, options), Status::kOk);
    EXPECT_EQ(query_.impacts().size(), 1u);
    return query_.impacts()[0];
  }

  bool touch_at(const MovingScene& moves, double t) {
    const ObjectPair pair[] = {{0, 1}};
    std::vector<Instance> at = moves.scene.instances;
    for (std::size_t i = 0; i < at.size(); ++i) at[i].pose = moves.pose(i, t);
    QueryOptions first;
    first.first_contact_only = true;
    EXPECT_EQ(contacts_.find_contacts(at, pair, first), Status::kOk);
    return !contacts_.contacts().empty();
  }

  // All that an impact promises.
  Impact check(const MovingScene& moves, RandomPoses& random, int times, const ImpactOptions& options = {}) {
    const Impact found = impact(moves, options);
    EXPECT_EQ(contacts_.set_assets(moves.scene.assets.views()), Status::kOk);
    EXPECT_EQ(touch_at(moves, 0), found.status == ImpactStatus::at_start);
    if (found.status == ImpactStatus::at_start) {
      EXPECT_EQ(found.t_safe, 0);
      return found;
    }
    EXPECT_FALSE(touch_at(moves, found.t_safe)) << "t_safe " << found.t_safe;
    for (int i = 0; i < times; ++i) {
      // Half of them near the end.
      const double part = i % 2 == 0 ? random.uniform(0, 1) : 1 - std::pow(10, random.uniform(-12, 0));
      EXPECT_FALSE(touch_at(moves, part * found.t_safe)) << part << " of " << found.t_safe;
    }
    if (found.status == ImpactStatus::none) {
      EXPECT_EQ(found.t_safe, moves.duration);
      EXPECT_EQ(found.triangle_a, kNoIndex);
    } else {
      check_gap(moves, found);
      EXPECT_LT(found.t_safe, moves.duration);
    }
    return found;
  }

  // The gap and the points are those of the two triangles then.
  void check_gap(const MovingScene& moves, const Impact& found) {
    Scene then = {};
    TrianglePair pair;
    const std::uint32_t triangle[2] = {found.triangle_a, found.triangle_b};
    for (int body = 0; body < 2; ++body) {
      const Instance& instance = moves.scene.instances[body];
      const AssetView& asset = moves.scene.assets.views()[instance.asset];
      const Pose stored = for_stored_coordinates(moves.pose(body, found.t_safe), asset.header->origin);
      const Triangle& corners = asset.level().triangles[triangle[body]];
      for (int c = 0; c < 3; ++c) {
        const float* p = corners.corner[c].position;
        apply(stored, p[0], p[1], p[2], body == 0 ? pair.a[c] : pair.b[c]);
      }
      EXPECT_EQ(corners.source_face(), body == 0 ? found.face_a : found.face_b);
    }
    const TriangleDistance distance = triangle_distance(pair);
    double size = 0, apart = 0;
    for (int k = 0; k < 3; ++k) {
      size += std::fabs(found.point_a[k]) + std::fabs(moves.motion[0].velocity[k] * moves.duration) +
              std::fabs(moves.motion[0].center[k]) + moves.diagonal();
      apart += std::pow(found.point_a[k] - found.point_b[k], 2);
    }
    const double rounding = 1e-11 * size;
    EXPECT_GE(found.gap, distance.interval.lower - rounding);
    EXPECT_LE(found.gap, distance.interval.upper + rounding);
    EXPECT_NEAR(found.gap, std::sqrt(apart), rounding);
  }

  ImpactQuery query_;
  ContactQuery contacts_;
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

TEST_F(Impacts, BothMovementsCount) {
  const MovingScene moves = two_cubes(at(3, 0, 0), moving(3, 1, 0), moving(-1, 1, 0));
  EXPECT_NEAR(impact(moves).t_safe, 0.5, 1e-6);
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

TEST_F(Impacts, TurningAboutACenterElsewhereIsAnOrbit) {
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
  ASSERT_EQ(query_.find(moves.scene.instances, moves.motion, 1, pairs, {}), Status::kOk);
  EXPECT_EQ(query_.impacts()[0].status, ImpactStatus::none);
  EXPECT_EQ(query_.impacts()[1].status, ImpactStatus::at_start);
}

TEST_F(Impacts, ErrorsAreNamedAndLeaveNothing) {
  MovingScene moves = two_cubes(at(3, 0, 0), moving(1, 0, 0), kAtRest);
  const ObjectPair pair[] = {{0, 1}}, unknown[] = {{0, 1}, {0, 2}};
  ASSERT_EQ(query_.set_assets(moves.scene.assets.views()), Status::kOk);
  const auto ask = [&](double duration = 1, const ImpactOptions& options = {}) {
    const Status status = query_.find(moves.scene.instances, moves.motion, duration, pair, options);
    EXPECT_EQ(query_.impacts().size(), status == Status::kOk ? 1u : 0u);
    EXPECT_EQ(query_.pairs().size(), query_.impacts().size());
    return status;
  };
  EXPECT_EQ(ask(), Status::kOk);
  EXPECT_EQ(ask(0), Status::kOk);
  EXPECT_EQ(ask(-1), Status::kOutOfRange);
  EXPECT_EQ(ask(INFINITY), Status::kOutOfRange);
  EXPECT_EQ(ask(NAN), Status::kOutOfRange);
  ImpactOptions options;
  options.tolerance = NAN;
  EXPECT_EQ(ask(1, options), Status::kOutOfRange);
  EXPECT_EQ(query_.find(moves.scene.instances, moves.motion, 1, unknown, {}), Status::kUnknownInstance);
  EXPECT_EQ(query_.where(), 1u);
  EXPECT_EQ(query_.find(moves.scene.instances, std::span(moves.motion).first(1), 1), Status::kMotionMismatch);
  const std::vector<RigidMotion> good = moves.motion;
  const auto refused = [&](double& number, double value) {
    number = value;
    EXPECT_EQ(ask(), Status::kOutOfRange) << value;
    EXPECT_EQ(query_.where(), 1u);
    moves.motion = good;
  };
  refused(moves.motion[1].velocity[0], NAN);
  refused(moves.motion[1].velocity[1], 1e101);
  refused(moves.motion[1].center[2], INFINITY);
  refused(moves.motion[1].angular_velocity[0], 1.001 * kLargestTurn);
  moves.motion[1].angular_velocity[0] = kLargestTurn;
  EXPECT_EQ(ask(), Status::kOk);
  moves.scene.instances[1].asset = 1;
  EXPECT_EQ(ask(), Status::kUnknownAsset);
  EXPECT_EQ(query_.where(), 1u);
  EXPECT_EQ(ImpactQuery().find({}, {}, 1), Status::kOk);
}

// Many bodies that move.
MovingScene moving_crowd(std::uint64_t seed, int count) {
  MovingScene moves;
  moves.scene = crowd(seed, count);
  RandomPoses random(seed);
  for (const Instance& instance : moves.scene.instances) {
    RigidMotion motion;
    for (int k = 0; k < 3; ++k) {
      motion.velocity[k] = random.symmetric(3);
      motion.angular_velocity[k] = random.symmetric(4);
      motion.center[k] = instance.pose.translation[k] + random.symmetric(0.5);
    }
    moves.motion.push_back(motion);
  }
  return moves;
}

TEST_F(Impacts, PairsThatAreLeftOutDoNotMeet) {
  const MovingScene moves = moving_crowd(3, 60);
  ASSERT_EQ(query_.set_assets(moves.scene.assets.views()), Status::kOk);
  ASSERT_EQ(query_.find(moves.scene.instances, moves.motion, 1), Status::kOk);
  std::vector<ObjectPair> all;
  for (std::uint32_t b = 1; b < 60; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) all.push_back({a, b});
  }
  const std::vector<ObjectPair> pairs(query_.pairs().begin(), query_.pairs().end());
  const std::vector<Impact> impacts(query_.impacts().begin(), query_.impacts().end());
  ASSERT_EQ(query_.find(moves.scene.instances, moves.motion, 1, all, {}), Status::kOk);
  EXPECT_LT(pairs.size(), all.size());
  std::size_t matched = 0, meet = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto found = std::find_if(pairs.begin(), pairs.end(), [&](const ObjectPair& pair) {
      return pair.a == all[i].a && pair.b == all[i].b;
    });
    const Impact& impact = query_.impacts()[i];
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

TEST_F(Impacts, ThreadsChangeNothing) {
  const MovingScene moves = moving_crowd(4, 80);
  ASSERT_EQ(query_.set_assets(moves.scene.assets.views()), Status::kOk);
  ASSERT_EQ(query_.find(moves.scene.instances, moves.motion, 1), Status::kOk);
  const std::vector<Impact> alone(query_.impacts().begin(), query_.impacts().end());
  const ImpactCounters counters = query_.counters();
  EXPECT_EQ(counters.object_pairs, alone.size());
  EXPECT_GT(counters.found, 0u);
  EXPECT_GT(counters.at_start, 0u);
  for (const std::uint32_t threads : {2u, 5u, 16u}) {
    ImpactOptions options;
    options.threads = threads;
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(query_.find(moves.scene.instances, moves.motion, 1, options), Status::kOk);
      ASSERT_EQ(query_.impacts().size(), alone.size());
      EXPECT_EQ(query_.counters(), counters);
      for (std::size_t row = 0; row < alone.size(); ++row) {
        const Impact &x = query_.impacts()[row], &y = alone[row];
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

TEST_F(Impacts, FiltersLeavePairsOut) {
  const MovingScene moves = two_cubes(at(3, 0, 0), moving(3, 0, 0), kAtRest);
  const ObjectPair joint[] = {{1, 0}};
  ExcludedPairTable excluded;
  ASSERT_EQ(excluded.set(joint), Status::kOk);
  const PairFilter filter = {.excluded = excluded.view()};
  ImpactOptions options;
  options.filter = &filter;
  ASSERT_EQ(query_.set_assets(moves.scene.assets.views()), Status::kOk);
  ASSERT_EQ(query_.find(moves.scene.instances, moves.motion, 1), Status::kOk);
  EXPECT_EQ(query_.pairs().size(), 1u);
  ASSERT_EQ(query_.find(moves.scene.instances, moves.motion, 1, options), Status::kOk);
  EXPECT_EQ(query_.pairs().size(), 0u);
}

// Random motions, families of them.

struct MotionFamily {
  const char* name;
  MovingScene (*make)(RandomPoses&);
};

std::ostream& operator<<(std::ostream& out, const MotionFamily& family) {
  return out << family.name;
}

Pose placed(RandomPoses& random, double far) {
  Pose pose = any_rotation(random);
  for (double& x : pose.translation) x = random.symmetric(far);
  return pose;
}

RigidMotion random_motion(RandomPoses& random, const Pose& pose, double speed, double spin,
                          double arm = 0.2) {
  RigidMotion motion;
  for (int k = 0; k < 3; ++k) {
    motion.velocity[k] = random.symmetric(speed);
    motion.angular_velocity[k] = random.symmetric(spin);
    motion.center[k] = pose.translation[k] + random.symmetric(arm);
  }
  return motion;
}

// b comes towards a from some distance.
void add_meeting(MovingScene& moves, RandomPoses& random, double far, double spin) {
  const Pose a = placed(random, 0.2), b = placed(random, far);
  moves.add(0, a, random_motion(random, a, 0.5, spin));
  RigidMotion motion = random_motion(random, b, 0.5, spin);
  for (int k = 0; k < 3; ++k) {
    motion.velocity[k] += random.uniform(-0.5, 3) * (a.translation[k] - b.translation[k]);
  }
  moves.add(moves.scene.assets.size() - 1, b, motion);
}

const MotionFamily kFamilies[] = {
    {"soups",
     [](RandomPoses& random) {
       MovingScene moves;
       moves.scene.assets.add(soup(random, 30, 0.4));
       moves.scene.assets.add(soup(random, 20, 0.6));
       add_meeting(moves, random, 3, 1);
       return moves;
     }},
    {"cubes",
     [](RandomPoses& random) {
       MovingScene moves;
       moves.scene.assets.add(cube(0.5f, 2));
       add_meeting(moves, random, 2, 2);
       return moves;
     }},
    {"spinning plates",
     [](RandomPoses& random) {
       MovingScene moves;
       moves.scene.assets.add(test::box(1, 1, 0.01f));
       moves.scene.assets.add(test::box(1.5f, 0.5f, 0.01f));
       add_meeting(moves, random, 1.5, 30);
       return moves;
     }},
    {"gears",
     [](RandomPoses& random) {
       // Teeth of one turn in the gaps of the other, with some play; or do not.
       MovingScene moves;
       moves.scene.assets.add(gear(12, 0.9, 1, 0.2f));
       const double distance = random.uniform(1.9, 2.05), speed = random.uniform(-9, 9);
       moves.add(0, kIdentityPose, {{0, 0, 0}, {0, 0, speed}, {0, 0, 0}});
       Pose turned = random.pose({});
       const double angle = random.uniform(0, 0.6);
       turned = {{{std::cos(angle), -std::sin(angle), 0}, {std::sin(angle), std::cos(angle), 0}, {0, 0, 1}},
                 {distance, 0, random.symmetric(0.1)}};
       moves.add(0, turned, {{0, 0, 0}, {0, 0, -speed * random.uniform(0.9, 1.1)}, {distance, 0, 0}});
       return moves;
     }},
    {"needles",
     [](RandomPoses& random) {
       MovingScene moves;
       moves.scene.assets.add(test::box(2, 1e-3f, 1e-3f));
       moves.scene.assets.add(test::box(3, 1e-4f, 1e-2f));
       add_meeting(moves, random, random.uniform(0.5, 4), 10);
       return moves;
     }},
    {"far from the origin",
     [](RandomPoses& random) {
       MovingScene moves;
       moves.scene.assets.add(cube(0.5f));
       moves.scene.assets.add(soup(random, 20, 0.5));
       add_meeting(moves, random, 2, 3);
       const double far = std::pow(10, random.uniform(3, 9));
       for (std::size_t i = 0; i < 2; ++i) {
         for (int k = 0; k < 3; ++k) {
           moves.scene.instances[i].pose.translation[k] += far;
           moves.motion[i].center[k] += far;
         }
       }
       return moves;
     }},
    {"just apart",
     [](RandomPoses& random) {
       const double gap = std::pow(10, random.uniform(-13, -2));
       const Pose above = at(random.symmetric(0.5), random.symmetric(0.5), 1 + gap);
       MovingScene moves;
       moves.scene.assets.add(cube(0.5f));
       moves.add(0, kIdentityPose, random_motion(random, kIdentityPose, 0.01, 0.01));
       moves.add(0, above, random_motion(random, above, 0.01, 0.01));
       return moves;
     }},
    {"centres far away",
     [](RandomPoses& random) {
       MovingScene moves;
       moves.scene.assets.add(cube(0.5f));
       for (int i = 0; i < 2; ++i) {
         const Pose pose = placed(random, 2);
         moves.add(0, pose, random_motion(random, pose, 0.1, 0.3, 100));
       }
       return moves;
     }},
    {"sizes and durations",
     [](RandomPoses& random) {
       const double size = std::pow(10, random.uniform(-20, 20));
       MovingScene moves;
       Mesh mesh = soup(random, 20, 0.5);
       test::scale(mesh, size);
       moves.scene.assets.add(mesh);
       add_meeting(moves, random, 2, 3);
       moves.duration = std::pow(10, random.uniform(-20, 20));
       for (std::size_t i = 0; i < 2; ++i) {
         for (int k = 0; k < 3; ++k) {
           moves.scene.instances[i].pose.translation[k] *= size;
           moves.motion[i].center[k] *= size;
           moves.motion[i].velocity[k] *= size / moves.duration;
           moves.motion[i].angular_velocity[k] /= moves.duration;
         }
       }
       return moves;
     }},
};

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
    const Impact impact = check(moves, random, test::trials(100, 10), options);
    found += impact.status == ImpactStatus::found;
    none += impact.status == ImpactStatus::none;
    const double far = std::fabs(impact.point_a[0]) + std::fabs(moves.motion[0].center[0]);
    near += impact.status == ImpactStatus::found && impact.gap <= 1.1e-6 * moves.diagonal() + 1e-14 * far;
    if (HasFailure()) ADD_FAILURE() << "motion " << i << "\n" << text(moves.scene);
  }
  RecordProperty("found", found);
  RecordProperty("none", none);
  EXPECT_GT(found, count / 20);
  EXPECT_GT(none, 0);
  EXPECT_GE(near, found * 0.99);
}

INSTANTIATE_TEST_SUITE_P(All, ImpactFamilies, testing::ValuesIn(kFamilies), [](const auto& family) {
  std::string name = family.param.name;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

}  // namespace
}  // namespace tandem
