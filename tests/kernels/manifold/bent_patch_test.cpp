#include <algorithm>
#include <cmath>
#include <functional>

#include "manifold_scene.h"

/// Points of patches that are thin and bent have normals of their own.
namespace tandem::test {
namespace {

constexpr double kPi = 180 * kDegree;

// A thread is a cross-section of three lobes that is turned as it rises.
constexpr double kLead = 0.5, kCore = 0.1, kLobe = 0.02, kPlay = 5e-4;
constexpr int kAround = 96;

using Loop = std::vector<std::array<float, 3>>;

Loop loop_of(const std::function<std::array<double, 2>(double)>& at, double z) {
  Loop loop;
  for (int i = 0; i < kAround; ++i) {
    const auto [radius, angle] = at(2 * kPi * i / kAround + 2 * kPi * z / kLead);
    loop.push_back({static_cast<float>(radius * std::cos(angle)),
                    static_cast<float>(radius * std::sin(angle)), static_cast<float>(z)});
  }
  return loop;
}

Loop thread_at(double z, double play) {
  return loop_of(
      [&](double angle) {
        return std::array{kCore + play + kLobe * std::cos(3 * (angle - 2 * kPi * z / kLead)), angle};
      },
      z);
}

Loop circle_at(double z, double radius) {
  return loop_of([&](double angle) { return std::array{radius, angle}; }, z);
}

// Joins each loop with the next.
Mesh lofted(const std::vector<Loop>& loops) {
  Mesh mesh;
  const auto add = [&](const auto& p, const auto& q, const auto& r) {
    if (p != q && q != r && r != p) mesh.add(p, q, r);
  };
  for (std::size_t k = 0; k + 1 < loops.size(); ++k) {
    for (std::size_t i = 0; i < kAround; ++i) {
      const std::size_t j = (i + 1) % kAround;
      add(loops[k][i], loops[k][j], loops[k + 1][j]);
      add(loops[k][i], loops[k + 1][j], loops[k + 1][i]);
    }
  }
  return mesh;
}

std::vector<Loop> thread_to(double height, double play) {
  std::vector<Loop> loops;
  for (int i = 0; i <= std::lround(height / kLead * kAround); ++i)
    loops.push_back(thread_at(i * kLead / kAround, play));
  return loops;
}

Mesh bolt(double height) {
  std::vector<Loop> loops = thread_to(height, 0);
  loops.insert(loops.begin(), circle_at(0, 0));
  loops.push_back(circle_at(loops.back()[0][2], 0));
  return lofted(loops);
}

Mesh nut(double height) {
  const std::vector<Loop> inside = thread_to(height, kPlay);
  std::vector<Loop> loops;
  for (const Loop& loop : inside) loops.push_back(circle_at(loop[0][2], 0.2));
  loops.insert(loops.end(), inside.rbegin(), inside.rend());
  loops.push_back(loops[0]);
  return lofted(loops);
}

// A ball that has sunk into a bowl, half a shell with the same centre but for the way.
constexpr double kBowl = 1, kBall = 0.996, kSunk = 0.008;

Mesh bowl() {
  std::vector<std::array<float, 2>> profile;
  constexpr int kSteps = 24;
  const auto add = [&](double radius, int step) {
    const double angle = kPi / 2 * step / kSteps;
    profile.push_back({step == 0 ? 0 : static_cast<float>(radius * std::sin(angle)),
                       static_cast<float>(-radius * std::cos(angle))});
  };
  for (int i = 0; i <= kSteps; ++i) add(1.2 * kBowl, i);
  for (int i = kSteps; i >= 0; --i) add(kBowl, i);
  return revolved(profile, 96);
}

struct Bent {
  const char* name;
  Mesh a, b;
  Pose of_b;
};

// Bodies that fit each other, but for some play, and are pushed together. No edge lies over another one.
const std::vector<Bent>& all_bent() {
  static const std::vector<Bent> all = {
      {"thin_nut", bolt(1), nut(0.02), after(shift(3e-5, -2e-5, kLead - 1.5e-3), turn(2, 3e-4))},
      {"pin", pipe(64, 0.1, 0.2, 0.1f), regular_prism(60, 0.0985, 0.3f),
       after(shift(2.5e-3, 3e-4, 0.01), after(turn(0, 0.004), turn(2, 0.013)))},
      {"nut", bolt(1), nut(0.3), shift(0, 0, kLead - 1.5e-3)},
      {"ball", bowl(), sphere(kBall, 5), shift(0, 0, -kSunk)}};
  return all;
}

const Bent& bent(const std::string& name) {
  return *std::ranges::find(all_bent(), name, &Bent::name);
}

void add_bodies(const Bent& bent, bool exchanged, ManifoldScene& scene) {
  scene.add_shape(exchanged ? bent.b : bent.a);
  scene.add_shape(exchanged ? bent.a : bent.b);
  scene.add_body(0, exchanged ? bent.of_b : kIdentityPose);
  scene.add_body(1, exchanged ? kIdentityPose : bent.of_b);
}

// Calls of(point, its normal from the first body towards the second, manifold's normal) for each point, with
// the bodies in either order.
template <typename Of>
void for_each_point(const char* name, const Of& of) {
  for (const bool exchanged : {false, true}) {
    SCOPED_TRACE(std::string(name) + (exchanged ? " exchanged" : ""));
    ManifoldScene scene;
    add_bodies(bent(name), exchanged, scene);
    scene.find();
    const double sign = exchanged ? -1 : 1;
    EXPECT_GE(scene.points().size(), 4u);
    for (const ManifoldPoint& p : scene.points())
      of(p, sign * vector_of(p.normal), sign * vector_of(scene.manifolds()[p.manifold].normal));
  }
}

// A nut whose points push it up is turned by them as it would turn while it sinks: of one that turns without
// friction, turning and sinking do opposite work.
TEST(BentPatch, ThreadTurnsWhatItCarries) {
  for (const char* name : {"nut", "thin_nut"}) {
    double lift = 0, torque = 0, largest = 0;
    for_each_point(name, [&](const ManifoldPoint& p, const Vector3& n, const Vector3&) {
      const Vector3 x = vector_of(p.position);
      const double radius = std::hypot(x.x, x.y), phase = 3 * (std::atan2(x.y, x.x) - 2 * kPi * x.z / kLead);
      // The gradient of the distance from the axis less that of the thread.
      const double along = 3 * kLobe * std::sin(phase), around = along / radius;
      const Vector3 surface =
          normalized(Vector3{x.x / radius - around * x.y / radius, x.y / radius + around * x.x / radius,
                             -along * 2 * kPi / kLead});
      largest = std::max(largest, angle_between(n, surface));
      lift += n.z, torque += x.x * n.y - x.y * n.x;
      EXPECT_GT(n.z, 0);
      EXPECT_LT(p.depth, 2e-3);
    });
    EXPECT_NEAR(torque, -lift * kLead / (2 * kPi), 0.06 * std::fabs(torque)) << name;
    EXPECT_LT(largest, 13 * kDegree);
  }
}

TEST(BentPatch, RoundBodiesArePushedTowardsTheMiddleOfWhatTheyFit) {
  for (const char* name : {"ball", "pin"}) {
    double leans = 0;
    for_each_point(name, [&](const ManifoldPoint& p, const Vector3& n, const Vector3& of_manifold) {
      const Vector3 inwards = {-p.position[0], -p.position[1], name[0] == 'b' ? -p.position[2] : 0};
      EXPECT_LT(angle_between(n, inwards), 6 * kDegree);
      leans = std::max(leans, angle_between(n, of_manifold));
    });
    EXPECT_GT(leans, 20 * kDegree) << name;
  }
}

TEST(BentPatch, PointsMoveWithTheBodies) {
  RandomPoses random(3);
  for (const char* name : {"thin_nut", "pin"}) {
    SCOPED_TRACE(name);
    ManifoldScene scene;
    add_bodies(bent(name), false, scene);
    scene.find();
    const std::vector<ManifoldPoint> found(scene.points().begin(), scene.points().end());
    for (int trial = 0; trial < 5; ++trial) {
      const Pose motion = any_motion(random, 1);
      scene.find(motion);
      ASSERT_EQ(scene.points().size(), found.size());
      for (std::size_t i = 0; i < found.size(); ++i) {
        const ManifoldPoint& p = scene.points()[i];
        EXPECT_LT(norm(vector_of(p.normal) - rotate(motion, vector_of(found[i].normal))), 1e-9);
        // They are looked for along directions of float32.
        EXPECT_LT(norm(vector_of(p.position) - apply(motion, vector_of(found[i].position))), 1e-6);
        EXPECT_NEAR(p.depth, found[i].depth, 1e-7);
      }
    }
  }
}

// Points between surfaces that are not bent have the manifold's normal, to the last bit: if one of them is
// flat, or both are convex.
TEST(FlatPatches, HaveOneNormal) {
  const Mesh ground = moved(box(4, 4, 2), 0, 0, -1);
  const Mesh meshes[] = {box(1, 0.75f, 0.5f), sphere(0.5, 3), regular_prism(24, 0.5, 0.5f),
                         ring(48, 0.5, 24, 0.1), project_mesh("cow_1500.obj")};
  RandomPoses random(5);
  std::size_t points = 0;
  for (const bool on_ground : {true, false}) {
    for (const Mesh& mesh : meshes) {
      if (!on_ground && &mesh - meshes > 2) break;  // the others are not convex
      ManifoldScene scene;
      scene.add_body(scene.add_shape(on_ground ? ground : sphere(0.7, 4)), kIdentityPose);
      scene.add_body(scene.add_shape(mesh), kIdentityPose);
      for (int trial = 0; trial < 20; ++trial) {
        scene.bodies[1].pose =
            after(shift(0, 0, random.uniform(0.1, on_ground ? 0.5 : 1.2)), any_motion(random, 0));
        scene.find();
        for (const ManifoldPoint& p : scene.points()) {
          const Manifold& m = scene.manifolds()[p.manifold];
          EXPECT_EQ(std::memcmp(p.normal, m.normal, sizeof p.normal), 0);
          ++points;
        }
      }
    }
  }
  EXPECT_GT(points, 200u);
}

}  // namespace
}  // namespace tandem::test
