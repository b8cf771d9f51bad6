#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/asked.h"
#include "kernels/contact/contact_query_fixture.h"
#include "kernels/geometry/triangle_distance.h"
#include "kernels/solid_meshes.h"
#include "tandem/kernels/impact_query.h"

/// Bodies that move, for tests of impacts, and what is promised of them.
namespace tandem::test {

/// Instances that move for a second or less.
struct MovingScene {
  BodyScene scene;
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

inline RigidMotion moving(double x, double y, double z) {
  return {{x, y, z}, {0, 0, 0}, {0, 0, 0}};
}

/// A wheel of this many teeth about the z axis.
inline Mesh gear(int teeth, double inner, double outer, float height) {
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

/// Many bodies that move.
inline MovingScene moving_crowd(std::uint64_t seed, int count) {
  MovingScene moves;
  moves.scene = crowd(seed, count);
  RandomPoses random(seed);
  for (const Instance& instance : moves.scene.instances) {
    RigidMotion motion;
    for (int k = 0; k < 3; ++k) {
      motion.velocity[k] = random.symmetric(3);
      motion.angular_velocity[k] = random.symmetric(4);
      motion.centre[k] = instance.pose.translation[k] + random.symmetric(0.5);
    }
    moves.motion.push_back(motion);
  }
  return moves;
}

/// Checks what an impact of a pair promises.
class ImpactChecker {
 public:
  explicit ImpactChecker(const MovingScene& moves, const ObjectPair& pair = {0, 1})
      : moves_(moves), pair_{pair.a, pair.b} {
    EXPECT_EQ(contacts_.set_assets(moves.scene.assets.views()), Status::kOk);
  }

  /// All of it, at `times` random times before the impact.
  void check(const Impact& found, RandomPoses& random, int times) {
    EXPECT_EQ(touch_at(0), found.status == ImpactStatus::at_start);
    if (found.status == ImpactStatus::at_start) {
      EXPECT_EQ(found.t_safe, 0);
      return;
    }
    EXPECT_FALSE(touch_at(found.t_safe)) << "t_safe " << found.t_safe;
    for (int i = 0; i < times; ++i) {
      // Half of them near the end.
      const double part = i % 2 == 0 ? random.uniform(0, 1) : 1 - std::pow(10, random.uniform(-12, 0));
      EXPECT_FALSE(touch_at(part * found.t_safe)) << part << " of " << found.t_safe;
    }
    if (found.status == ImpactStatus::none) {
      EXPECT_EQ(found.t_safe, moves_.duration);
      EXPECT_EQ(found.triangle_a, kNoIndex);
    } else {
      check_gap(found);
      EXPECT_LT(found.t_safe, moves_.duration);
    }
  }

  /// The gap and the points are those of the two triangles then.
  void check_gap(const Impact& found) {
    TrianglePair pair;
    const std::uint32_t triangle[2] = {found.triangle_a, found.triangle_b};
    for (int body = 0; body < 2; ++body) {
      const Instance& instance = moves_.scene.instances[pair_[body]];
      const AssetView& asset = moves_.scene.assets.views()[instance.asset];
      const Pose stored =
          for_stored_coordinates(moves_.pose(pair_[body], found.t_safe), asset.header->origin);
      const Triangle& corners = asset.level().triangles[triangle[body]];
      for (int c = 0; c < 3; ++c) {
        const float* p = corners.corner[c].position;
        apply(stored, p[0], p[1], p[2], body == 0 ? pair.a[c] : pair.b[c]);
      }
      EXPECT_EQ(corners.source_face(), body == 0 ? found.face_a : found.face_b);
    }
    const TriangleDistance distance = triangle_distance(pair);
    const RigidMotion& first = moves_.motion[pair_[0]];
    double size = 0, apart = 0;
    for (int k = 0; k < 3; ++k) {
      size += std::fabs(found.point_a[k]) + std::fabs(first.velocity[k] * moves_.duration) +
              std::fabs(first.centre[k]) + moves_.diagonal();
      apart += std::pow(found.point_a[k] - found.point_b[k], 2);
    }
    const double rounding = 1e-11 * size;
    EXPECT_GE(found.gap, distance.interval.lower - rounding);
    EXPECT_LE(found.gap, distance.interval.upper + rounding);
    EXPECT_NEAR(found.gap, std::sqrt(apart), rounding);
  }

  bool touch_at(double t) {
    std::vector<Instance> at = moves_.scene.instances;
    for (const std::uint32_t body : pair_) at[body].pose = moves_.pose(body, t);
    const ObjectPair pair[] = {{pair_[0], pair_[1]}};
    ContactOptions first;
    first.first_contact_only = true;
    EXPECT_EQ(contacts_.find(at, pair, first), Status::kOk);
    return !contacts_.rows().empty();
  }

 private:
  const MovingScene& moves_;
  const std::uint32_t pair_[2];
  test::Asked<ContactQuery> contacts_;
};

/// Random motions, families of them.
struct MotionFamily {
  const char* name;
  MovingScene (*make)(RandomPoses&);
};

inline std::ostream& operator<<(std::ostream& out, const MotionFamily& family) {
  return out << family.name;
}

inline Pose placed(RandomPoses& random, double far) {
  Pose pose = any_rotation(random);
  for (double& x : pose.translation) x = random.symmetric(far);
  return pose;
}

inline RigidMotion random_motion(RandomPoses& random, const Pose& pose, double speed, double spin,
                                 double arm = 0.2) {
  RigidMotion motion;
  for (int k = 0; k < 3; ++k) {
    motion.velocity[k] = random.symmetric(speed);
    motion.angular_velocity[k] = random.symmetric(spin);
    motion.centre[k] = pose.translation[k] + random.symmetric(arm);
  }
  return motion;
}

/// b comes towards a from some distance.
inline void add_meeting(MovingScene& moves, RandomPoses& random, double far, double spin) {
  const Pose a = placed(random, 0.2), b = placed(random, far);
  moves.add(0, a, random_motion(random, a, 0.5, spin));
  RigidMotion motion = random_motion(random, b, 0.5, spin);
  for (int k = 0; k < 3; ++k) {
    motion.velocity[k] += random.uniform(-0.5, 3) * (a.translation[k] - b.translation[k]);
  }
  moves.add(moves.scene.assets.size() - 1, b, motion);
}

inline const MotionFamily kMotionFamilies[] = {
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
       moves.scene.assets.add(box(1, 1, 0.01f));
       moves.scene.assets.add(box(1.5f, 0.5f, 0.01f));
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
       moves.scene.assets.add(box(2, 1e-3f, 1e-3f));
       moves.scene.assets.add(box(3, 1e-4f, 1e-2f));
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
           moves.motion[i].centre[k] += far;
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
       scale(mesh, size);
       moves.scene.assets.add(mesh);
       add_meeting(moves, random, 2, 3);
       moves.duration = std::pow(10, random.uniform(-20, 20));
       for (std::size_t i = 0; i < 2; ++i) {
         for (int k = 0; k < 3; ++k) {
           moves.scene.instances[i].pose.translation[k] *= size;
           moves.motion[i].centre[k] *= size;
           moves.motion[i].velocity[k] *= size / moves.duration;
           moves.motion[i].angular_velocity[k] /= moves.duration;
         }
       }
       return moves;
     }},
};

}  // namespace tandem::test
