#pragma once
#include <vector>

#include "dynamics/scene_contacts.h"
#include "dynamics/simulation.h"
#include "kernels/manifold/manifold_scene.h"

namespace tandem::test {

/// Bodies of several shapes that fall on a floor and on each other, spinning.
struct FallingBodies {
  std::vector<dynamics::BodyProperties> properties;
  std::vector<dynamics::BodyState> states;

  explicit FallingBodies(std::uint32_t count, std::uint32_t seed = 1) {
    using namespace dynamics;
    assets.add(box(4, 4, 0.4F));
    assets.add(ring(12, 0.2, 8, 0.06));
    assets.add(cup(12, 0.15F, 0.3F, 0.03F));
    assets.add(box(0.4F, 0.3F, 0.2F));
    assets.add(sphere(0.2, 2));
    RandomPoses random(seed);
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t shape = i == 0 ? 0 : 1 + i % 4;
      const AssetView& asset = assets.views()[shape];
      BodyProperties body = body_properties(shape, mass_properties(asset).properties, 1000);
      body.radius = radius_about(body.centre, asset);
      if (i == 0) {
        body = {};
        body.motion = Motion::fixed, body.radius = radius_about({}, asset);
      }
      body.shape = shape;
      properties.push_back(body);
      Pose pose = any_motion(random, 0.3);
      if (i == 0) pose = shift(0, 0, -0.2);
      if (i > 0) pose.translation[2] += 0.5 + 0.25 * i;
      states.push_back(state_of(body, pose));
      if (i > 0) {
        const Pose turn = any_motion(random, 1);
        states.back().angular_velocity = {3 * turn.rotation[0][1], 3 * turn.rotation[1][2],
                                          turn.rotation[2][0]};
        states.back().velocity = {0.3 * turn.rotation[0][0], 0.3 * turn.rotation[1][1], -1};
      }
    }
  }

  SampleAssets assets;
};

}  // namespace tandem::test
