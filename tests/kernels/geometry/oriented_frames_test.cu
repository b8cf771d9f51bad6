// Frames of oriented blocks as a GPU computes with them.
#include <cstdio>
#include <cstring>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/random_rotation.h"

namespace tandem {
namespace {

using test::download;
using test::on_gpu;
using test::RandomPoses;

class OrientedFrames : public test::GpuTest {};

__global__ void invert_all(std::uint32_t numbers, unsigned long long* worst) {
  for (std::uint32_t n = 1 + blockIdx.x * blockDim.x + threadIdx.x; n <= numbers;
       n += gridDim.x * blockDim.x) {
    const double x = n, y = oriented_detail::inverse(static_cast<float>(n));
    // Exact: a product of 48 bits, near 1.
    const double off = fabs(x * y - 1) * 0x1p24;
    atomicMax(worst, static_cast<unsigned long long>(__double_as_longlong(off)));  // positive: in their order
  }
}

/// All squared lengths of quaternions: the GPU's approximate inverse of each.
TEST_F(OrientedFrames, HaveInversesWithinTwoUnitsOfRoundoff) {
  const auto worst = on_gpu(std::vector<unsigned long long>{0});
  invert_all<<<256, 256>>>(4 * kLargestQuaternionPart * kLargestQuaternionPart, worst.data());
  const unsigned long long bits = download(worst.data(), 1)[0];
  double off;
  std::memcpy(&off, &bits, sizeof off);
  std::printf("largest error of an inverse: %.3f units of roundoff\n", off);
  EXPECT_GT(off, 0);
  EXPECT_LE(off, 2);
}

__global__ void make_frames(const BlockRotation* rotation, std::uint32_t count, BlockFrame* frame) {
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < count; i += gridDim.x * blockDim.x)
    frame[i] = frame_of(rotation[i]);
}

TEST_F(OrientedFrames, HaveTheFramesOfTheCpu) {
  RandomPoses random(5);
  std::vector<BlockRotation> rotations(1'000'000);
  for (BlockRotation& r : rotations) r = test::packed(test::random_quaternion(random));
  const auto device = on_gpu(rotations);
  const auto frames = on_gpu(std::vector<BlockFrame>(rotations.size()));
  make_frames<<<256, 256>>>(device.data(), static_cast<std::uint32_t>(rotations.size()), frames.data());
  const std::vector<BlockFrame> made = download(frames.data(), rotations.size());
  for (std::size_t i = 0; i < made.size(); ++i) {
    const BlockFrame expected = frame_of(rotations[i]);
    ASSERT_EQ(std::memcmp(made[i].scaled, expected.scaled, sizeof expected.scaled), 0) << i;
    ASSERT_NEAR(made[i].inverse_length / expected.inverse_length, 1, 0x1p-22) << i;
  }
}

}  // namespace
}  // namespace tandem
