// All that a step finds in random scenes: the same bytes by any number of threads, and sound.
#include "kernels/random_scenes.h"

#include <gtest/gtest.h>

namespace tandem::test {
namespace {

TEST(RandomScenes, AreTheSameByAnyNumberOfThreads) {
  const SampleAssets meshes = sample_meshes();
  std::size_t points = 0, found_again = 0, contained = 0;
  for (int seed = 0; seed < trials(10, 20); ++seed) {
    const RandomScene scene = random_scene(meshes.views(), static_cast<std::uint64_t>(seed));
    SCOPED_TRACE(testing::Message() << scene.kind << ", seed " << seed);
    std::vector<CpuDetection> sides;
    for (const std::uint32_t threads : {1u, 2u, 7u, 16u}) sides.emplace_back(meshes.views(), threads);
    Detected before;
    for (const auto& instances : scene.steps) {
      const Detected one = sides[0].step(instances);
      EXPECT_EQ(first_defect(instances, one, before), "");
      for (std::size_t i = 1; i < sides.size(); ++i)
        EXPECT_EQ(first_difference(one, sides[i].step(instances)), "");
      points += one.points.size(), contained += one.contained.size();
      found_again += points_found_again(one);
      before = one;
    }
  }
  EXPECT_GT(points, 1000u);
  EXPECT_GT(found_again, points / 4);
  EXPECT_GT(contained, 10u);
}

}  // namespace
}  // namespace tandem::test
