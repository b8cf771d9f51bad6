// All that a step finds in random scenes, on the GPU: the bytes of the CPU.
#include <gtest/gtest.h>

#include "gpu/gpu_detection.h"
#include "gpu/gpu_scene_fixture.h"

namespace tandem::test {
namespace {

class GpuRandomScenes : public GpuTest {};

TEST_F(GpuRandomScenes, AreTheCpus) {
  const SampleAssets meshes = sample_meshes();
  std::size_t points = 0;
  for (int seed = 0; seed < trials(10, 20) && !HasFailure(); ++seed) {
    const RandomScene scene = random_scene(meshes.views(), static_cast<std::uint64_t>(seed));
    SCOPED_TRACE(testing::Message() << scene.kind << ", seed " << seed);
    CpuDetection cpu(meshes.views());
    GpuDetection gpu(meshes.views());
    for (const auto& instances : scene.steps) {
      const Detected expected = cpu.step(instances);
      EXPECT_EQ(first_difference(expected, gpu.step(instances)), "");
      points += expected.points.size();
    }
  }
  EXPECT_GT(points, 1000u);
}

}  // namespace
}  // namespace tandem::test
