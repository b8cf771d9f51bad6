#pragma once
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <span>

#include "kernels/contact/contact_query_fixture.h"
#include "tandem/kernels/distance_query.h"

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

inline bool same_bytes(std::span<const ObjectDistance> x, std::span<const ObjectDistance> y) {
  return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size_bytes()) == 0);
}

/// A reach for each pair: none, 0, less than its distance, as much, more, in turn.
inline std::vector<double> mixed_reaches(std::span<const ObjectDistance> distances) {
  std::vector<double> reaches;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const double upper = distances[i].upper;
    const double choices[] = {INFINITY, 0, 0.5 * upper, upper, 2 * upper};
    reaches.push_back(choices[i % 5]);
  }
  return reaches;
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
