#pragma once
#include <vector>

#include "dynamics/scene_contacts.h"
#include "dynamics/simulation.h"
#include "kernels/manifold/manifold_scene.h"
#include "tandem/dynamics/world.h"

namespace tandem::test {

/// Bodies of several shapes that fall on a floor and on each other, spinning.
struct FallingBodies {
  explicit FallingBodies(std::uint32_t count, std::uint32_t seed = 1) {
    assets.add(box(40, 40, 0.4F));
    assets.add(ring(12, 0.2, 8, 0.06));
    assets.add(cup(12, 0.15F, 0.3F, 0.03F));
    assets.add(box(0.4F, 0.3F, 0.2F));
    assets.add(sphere(0.2, 2));
    RandomPoses random(seed);
    for (std::uint32_t i = 0; i < count; ++i) {
      BodyDescription& body = descriptions.emplace_back();
      body.asset = i == 0 ? 0 : 1 + i % 4;
      body.pose = i == 0 ? shift(0, 0, -0.2) : any_motion(random, 0.3);
      if (i == 0) {
        body.filter.motion = Motion::fixed;
        continue;
      }
      body.pose.translation[2] += 0.5 + 0.25 * i;
      const Pose turn = any_motion(random, 1);
      for (int k = 0; k < 3; ++k) {
        body.velocity[k] = k < 2 ? 0.3 * turn.rotation[k][k] : -1;
        body.angular_velocity[k] = 3 * turn.rotation[k][(k + 1) % 3];
      }
    }
  }

  std::vector<BodyDescription> descriptions;
  SampleAssets assets;
};

}  // namespace tandem::test
