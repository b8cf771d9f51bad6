#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "build/sample_asset.h"
#include "gpu_scene_fixture.h"
#include "kernels/plain_boxes.h"
#include "made_files.h"
#include "tandem/kernels/detail/box_test.h"
#include "tandem/runtime/upload.h"

namespace tandem {
namespace {

class Gpu : public test::GpuTest {};

using test::download;
using test::on_gpu;

TEST_F(Gpu, AnUploadedLevelHasTheSameBytes) {
  const build::Image image = test::make_file(test::random_mesh(5000, 1));
  const CheckResult checked = check(image.data(), image.size());
  ASSERT_EQ(checked.status, Status::kOk);
  const LevelView host = checked.asset.level();
  DeviceAsset asset;
  ASSERT_EQ(asset.upload(checked.asset, nullptr), Status::kOk) << cudaGetErrorString(asset.cuda_error());
  ASSERT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  EXPECT_EQ(asset.bytes(), image.size());
  const LevelView device = asset.level();
  ASSERT_EQ(device.block_count, host.block_count);
  const auto blocks = download(device.blocks, device.block_count);
  const auto triangles = download(device.triangles, device.triangle_count);
  const auto oriented = download(device.oriented_blocks, device.block_count);
  EXPECT_EQ(std::memcmp(blocks.data(), host.blocks, blocks.size() * sizeof(Block)), 0);
  EXPECT_EQ(std::memcmp(triangles.data(), host.triangles, triangles.size() * sizeof(Triangle)), 0);
  EXPECT_EQ(std::memcmp(oriented.data(), host.oriented_blocks, oriented.size() * sizeof(OrientedBlock)), 0);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(device.blocks) % alignof(Block), 0u);
}

TEST_F(Gpu, AnUploadForExactQueriesHasWhatTheyNeed) {
  test::RandomPoses random(4);
  std::vector<test::MadeLevel> levels;
  for (const std::uint32_t triangles : {2001u, 100u, 7u})
    levels.push_back(test::built_level(test::soup(random, triangles, 0.1), 2001.0 - triangles));
  const test::Bytes file = test::made_file(levels);
  const AssetView view = file.check().asset;
  DeviceAsset asset;
  ASSERT_EQ(asset.upload(view, nullptr, Contents::exact_queries), Status::kOk);
  ASSERT_EQ(asset.level_count(), 3u);
  std::size_t needed = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const LevelView host = view.level(i), device = asset.level(i);
    EXPECT_EQ(device.blocks, nullptr);
    const auto triangles = download(device.triangles, device.triangle_count);
    const auto oriented = download(device.oriented_blocks, device.block_count);
    EXPECT_EQ(std::memcmp(triangles.data(), host.triangles, triangles.size() * sizeof(Triangle)), 0);
    EXPECT_EQ(std::memcmp(oriented.data(), host.oriented_blocks, oriented.size() * sizeof(OrientedBlock)), 0);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(device.triangles) % kSectionAlignment, 0u);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(device.oriented_blocks) % kSectionAlignment, 0u);
    needed += triangles.size() * sizeof(Triangle) + oriented.size() * sizeof(OrientedBlock);
  }
  EXPECT_GE(asset.bytes(), needed);
  EXPECT_LT(asset.bytes(), needed + 6 * kSectionAlignment);
}

TEST_F(Gpu, AssetsMoveAndUploadAgain) {
  const build::Image image = test::make_file(test::random_mesh(100, 1));
  const AssetView view = check(image.data(), image.size()).asset;
  DeviceAsset first;
  ASSERT_EQ(first.upload(view, nullptr), Status::kOk);
  DeviceAsset second = std::move(first);
  EXPECT_EQ(first.level_count(), 0u);
  ASSERT_EQ(second.upload(view, nullptr), Status::kOk);
  EXPECT_EQ(second.level().triangle_count, 100u);
  second.free();
  EXPECT_EQ(second.bytes(), 0u);
}

// One thread a block: counts leaves by walking lanes on the device.
__global__ void count_leaves(LevelView level, unsigned* leaves) {
  const unsigned b = blockIdx.x * blockDim.x + threadIdx.x;
  if (b >= level.block_count || !level.blocks[b].is_leaf_block()) return;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if (level.blocks[b].kind[i] == NodeKind::leaf && level.blocks[b].index[i] < level.triangle_count)
      atomicAdd(leaves, 1u);
  }
}

TEST_F(Gpu, KernelsReadTheTreeInPlace) {
  const build::Image image = test::make_file(test::random_mesh(5001, 2));
  DeviceAsset asset;
  ASSERT_EQ(asset.upload(check(image.data(), image.size()).asset, nullptr), Status::kOk);
  const auto leaves = on_gpu(std::vector<unsigned>{0});
  const LevelView level = asset.level();
  count_leaves<<<(level.block_count + 127) / 128, 128>>>(level, leaves.data());
  ASSERT_EQ(cudaGetLastError(), cudaSuccess);
  EXPECT_EQ(download(leaves.data(), 1)[0], 5001u);
}

struct Trial {
  Box other;
  RelativePose pose;
};

// Fused multiply-adds and the device's fabs included: no box test may accept an imaginary node.
__global__ void test_imaginary(const Trial* trials, int count, unsigned* accepted) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  const Box imaginary = {{kImaginaryCenter, kImaginaryCenter, kImaginaryCenter},
                         {kImaginaryHalfExtent, kImaginaryHalfExtent, kImaginaryHalfExtent}};
  const Trial& t = trials[i];
  const bool any = overlap_6_axes(imaginary, t.other, t.pose) || overlap_6_axes(t.other, imaginary, t.pose) ||
                   overlap_15_axes(imaginary, t.other, t.pose) ||
                   overlap_15_axes(t.other, imaginary, t.pose) || test::overlap_aligned(imaginary, t.other) ||
                   test::overlap_aligned(t.other, imaginary);
  if (any) atomicAdd(accepted, 1u);
}

TEST_F(Gpu, ImaginaryNodesAreRejectedAgainstEveryOtherBox) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity(),
                  kLargest = std::numeric_limits<float>::max();
  const float special[] = {0.0f, -0.0f, 1e-45f, 1.0f, -1.0f, kLargest, -kLargest, kInfinity, -kInfinity, NAN};
  std::mt19937_64 random(3);
  const auto pick = [&] { return special[random() % std::size(special)]; };
  std::vector<Trial> trials(1 << 20);
  for (Trial& trial : trials) {
    const bool aligned = random() % 3 == 0;
    for (int i = 0; i < 3; ++i) {
      trial.other.center[i] = pick();
      trial.other.half_extent[i] = pick();
      trial.pose.translation[i] = pick();
      trial.pose.slack_a[i] = random() % 2 == 0 ? 0 : pick();
      trial.pose.slack_b[i] = random() % 2 == 0 ? 0 : pick();
      for (int j = 0; j < 3; ++j) {
        trial.pose.rotation[i][j] = aligned ? static_cast<float>(i == j) : pick();
        trial.pose.abs_rotation[i][j] = std::fabs(trial.pose.rotation[i][j]);
      }
    }
  }
  const auto device = on_gpu(trials);
  const auto accepted = on_gpu(std::vector<unsigned>{0});
  const int count = static_cast<int>(trials.size());
  test_imaginary<<<(count + 255) / 256, 256>>>(device.data(), count, accepted.data());
  ASSERT_EQ(cudaGetLastError(), cudaSuccess);
  EXPECT_EQ(download(accepted.data(), 1)[0], 0u);
}

}  // namespace
}  // namespace tandem
