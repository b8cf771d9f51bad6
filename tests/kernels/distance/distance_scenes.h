#pragma once
#include <gtest/gtest.h>

#include <cstdio>

#include "kernels/contact/contact_query_fixture.h"

/// Scenes that tests of distances on the CPU and on a GPU share.
namespace tandem {

/// The instances moved from the first one, so that there is room between them.
inline BodyScene spread_out(BodyScene scene, double factor) {
  const Pose first = scene.instances[0].pose;
  for (Instance& instance : scene.instances) {
    for (int k = 0; k < 3; ++k) {
      double& t = instance.pose.translation[k];
      t = first.translation[k] + factor * (t - first.translation[k]);
    }
  }
  return scene;
}

/// Calls check(scene, seed) for so many scenes of a family until it fails.
template <class Check>
void for_spread_scenes(const test::SceneFamily& family, std::uint64_t first_seed, int count, Check check) {
  for (int seed = 0; seed < count && !testing::Test::HasFailure(); ++seed) {
    RandomPoses random(first_seed + static_cast<std::uint64_t>(seed));
    const BodyScene scene = spread_out(family.make(random), seed % 4);
    check(scene, seed);
    if (testing::Test::HasFailure()) std::printf("%s, seed %d:\n%s", family.name, seed, text(scene).c_str());
  }
}

}  // namespace tandem
