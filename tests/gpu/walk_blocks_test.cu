#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "gpu_query_data.h"
#include "gpu_scene_fixture.h"
#include "kernels/random_rotation.h"
#include "walk_block_check.h"

namespace tandem {
namespace {

using test::download;
using test::Mesh;
using test::on_gpu;
using test::RandomPoses;
using test::SampleAssets;

class WalkBlocks : public test::GpuTest {};

/// What the GPU makes of the trees, numbered one after the other behind some numbers of others.
void expect_sound(const SampleAssets& assets) {
  constexpr std::uint32_t kOthers = 7;
  std::uint32_t numbers = kOthers, block_count = 0;
  std::vector<DeviceAsset> uploads(assets.size());
  std::vector<gpu::Asset> table;
  for (std::uint32_t i = 0; i < assets.size(); ++i) {
    const AssetView& view = assets.views()[i];
    ASSERT_EQ(uploads[i].upload(view, nullptr), Status::kOk);
    table.push_back({gpu_asset(uploads[i].level(), *view.header), {}, numbers, block_count});
    numbers += static_cast<std::uint32_t>(gpu::numbers_of(view.level()));
    block_count += view.level().block_count;
  }
  gpu::WalkBlock none;
  std::memset(&none, 0xCD, sizeof none);
  const auto blocks = on_gpu(std::vector<gpu::WalkBlock>(numbers, none));
  const auto file_blocks = on_gpu(std::vector<std::uint32_t>(numbers, 0xCDCDCDCDu));
  const auto scratch = on_gpu(std::vector<std::uint32_t>(block_count, 0xCDCDCDCDu));
  const auto assets_on_gpu = on_gpu(table);
  ASSERT_EQ(gpu::make_walk_blocks(assets_on_gpu.data(), assets.size(), block_count, blocks.data(),
                                  file_blocks.data(), scratch.data(), nullptr),
            cudaSuccess);
  const auto made = download(assets_on_gpu.data(), table.size());
  std::vector<test::WalkTree> walks;
  for (std::uint32_t i = 0; i < assets.size(); ++i) {
    const TreeExtent extent = extent_of(assets.views()[i].level().blocks[0]);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(made[i].extent.reach[k], extent.reach[k]);
      EXPECT_EQ(made[i].extent.half_extent[k], extent.half_extent[k]);
    }
    walks.push_back({table[i].root, made[i].root, {}, {}});
  }
  const auto all_blocks = download(blocks.data(), numbers);
  const auto all_file_blocks = download(file_blocks.data(), numbers);
  for (std::uint32_t i = 0; i < kOthers; ++i) {
    EXPECT_EQ(std::memcmp(&all_blocks[i], &none, sizeof none), 0) << "another's block " << i;
    EXPECT_EQ(all_file_blocks[i], 0xCDCDCDCDu) << "another's block " << i;
  }
  for (std::uint32_t i = 0; i < assets.size(); ++i) {
    SCOPED_TRACE(testing::Message() << "asset " << i);
    walks[i].blocks = all_blocks;
    walks[i].file_blocks = all_file_blocks;
    test::expect_walk_blocks(assets.views()[i].level(), walks[i]);
  }
}

Mesh moved(Mesh mesh, double factor, double by) {
  for (auto& point : mesh.points) {
    for (float& x : point) x = static_cast<float>(x * factor + by);
  }
  return mesh;
}

TEST_F(WalkBlocks, OfBoxesAndSoupsAreSound) {
  RandomPoses random(1);
  SampleAssets assets;
  for (const int cells : {1, 2, 3, 7, 12}) assets.add(test::cube(0.5f, cells));
  for (const std::uint32_t triangles : {1u, 2u, 4u, 5u, 6u, 16u, 17u, 63u, 999u})
    assets.add(test::soup(random, triangles, 0.1));
  expect_sound(assets);
}

/// Blocks with more than 4,096 triangles below them are made by another kernel than those with fewer.
TEST_F(WalkBlocks, OfLargeTreesAreSound) {
  RandomPoses random(2);
  SampleAssets assets;
  for (const std::uint32_t triangles : {4095u, 4096u, 4097u, 30'000u})
    assets.add(test::soup(random, triangles, 0.05));
  assets.add(test::cube(0.5f, 50));
  expect_sound(assets);
}

TEST_F(WalkBlocks, OfHostileMeshesAreSound) {
  RandomPoses random(3);
  SampleAssets assets;
  Mesh coincident, flat, points, lines;
  for (int i = 0; i < 9; ++i) {
    const float x = static_cast<float>(i);
    coincident.add({0.1f, 0.2f, 0.3f}, {1.7f, 0.4f, 0.9f}, {0.3f, 1.1f, 0.2f});
    flat.add({x, 0.5f * x, 1}, {x + 1, x * x, 1}, {0.25f * x, 2, 1});
    points.add({x, -x, 0.3f}, {x, -x, 0.3f}, {x, -x, 0.3f});
    lines.add({x, x, x}, {2 * x, 2 * x, 2 * x}, {-x, -x, -x});
  }
  for (const Mesh& mesh : {coincident, flat, points, lines}) assets.add(mesh);
  assets.add(test::grid_soup(random, 300, 3));
  for (const double factor :
       {0x1p-146, 0x1p-140, 0x1p-120, 0x1p-70, 0x1p-30, 0x1p30, 0x1p55, 0x1p90, 0x1p118})
    assets.add(moved(test::soup(random, 200, 0.2), factor, 0));
  for (const double by : {1e3, 1e6, -1e9}) assets.add(moved(test::soup(random, 200, 0.2), 1, by));
  expect_sound(assets);
}

TEST_F(WalkBlocks, OfTreesWithManyImaginaryNodesAreSound) {
  RandomPoses random(4);
  SampleAssets assets;
  for (const std::uint32_t triangles : {5u, 100u, 6000u}) {
    assets.add(test::soup(random, triangles, 0.1), {}, build::Imaginary::free);
    assets.add(test::cube(1, 9), {}, build::Imaginary::free);
  }
  expect_sound(assets);
}

/// Positions and faces of a file whose faces are triangles; empty where there is none.
Mesh read_obj(const std::filesystem::path& path) {
  Mesh mesh;
  std::ifstream file(path);
  for (std::string line, word; std::getline(file, line);) {
    std::istringstream words(line);
    words >> word;
    if (word == "v") {
      std::array<float, 3> point;
      words >> point[0] >> point[1] >> point[2];
      mesh.points.push_back(point);
    }
    if (word == "f") {
      std::array<std::uint32_t, 3> triangle;
      for (std::uint32_t& corner : triangle) {
        words >> word;
        corner = static_cast<std::uint32_t>(std::stoul(word)) - 1;  // what follows a slash is no number
      }
      mesh.triangles.push_back(triangle);
    }
    word.clear();
  }
  return mesh;
}

TEST_F(WalkBlocks, OfACowAreSound) {
  const char* named = std::getenv("TANDEM_MESHES");
  const std::filesystem::path folder = named != nullptr ? named : TANDEM_SOURCE_DIR "/../shared/meshes";
  const Mesh cow = read_obj(folder / "cow.obj");
  if (cow.triangles.empty()) GTEST_SKIP() << "cow.obj is not here (set TANDEM_MESHES)";
  SampleAssets assets;
  assets.add(cow);
  assets.add(moved(cow, 1, 100));
  expect_sound(assets);
}

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
TEST_F(WalkBlocks, HaveInversesWithinTwoUnitsOfRoundoff) {
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

TEST_F(WalkBlocks, HaveTheFramesOfTheCpu) {
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
