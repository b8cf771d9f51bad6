#pragma once
#include <algorithm>
#include <limits>
#include <vector>

#include "kernels/manifold/manifold_scene.h"
#include "tandem/dynamics/world.h"

namespace tandem::test {

inline constexpr double kStep = 1.0 / 60, kGravity = 9.81;
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A ground whose upper side is z = 0, and bodies above it.
class WorldOnGround {
 public:
  explicit WorldOnGround(const Mesh& mesh) {
    assets_.add(box(40, 40, 2));
    assets_.add(mesh);
    add(shift(0, 0, -1)).filter.motion = Motion::fixed;
    bodies.back().asset = 0;
  }
  BodyDescription& add(const Pose& pose) {
    BodyDescription& body = bodies.emplace_back();
    body.asset = 1, body.pose = pose;
    return body;
  }
  World& begin(const WorldOptions& options = {}) {
    EXPECT_EQ(world.set_assets(assets_.views()), Status::kOk);
    EXPECT_EQ(world.set_bodies(bodies, options), Status::kOk);
    return world;
  }
  double fastest() const {
    double most = 0;
    for (const BodyMotion& body : world.bodies()) most = std::max(most, norm(vector_of(body.velocity)));
    return most;
  }
  double kinetic_energy() const {
    double sum = 0;
    for (std::uint32_t i = 0; i < world.bodies().size(); ++i) {
      const Vector3 v = vector_of(world.bodies()[i].velocity);
      sum += 0.5 * world.mass_of(i) * dot(v, v);
    }
    return sum;
  }

  std::vector<BodyDescription> bodies;
  World world;

 private:
  SampleAssets assets_;
};

}  // namespace tandem::test
