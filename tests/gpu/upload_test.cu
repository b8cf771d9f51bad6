#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "build/sample_asset.h"
#include "gpu_scene_fixture.h"
#include "kernels/common/plain_boxes.h"
#include "kernels/geometry/box_test.h"
#include "made_files.h"
#include "staged_copy.h"
#include "tandem/runtime/upload.h"

namespace tandem {
namespace {

class Gpu : public test::GpuTest {};

using test::download;
using test::on_gpu;

/// `host` to be the same as `device`, which was uploaded with these contents.
void expect_same(const LevelView& host, const LevelView& device, Contents contents) {
  ASSERT_EQ(device.block_count, host.block_count);
  ASSERT_EQ(device.triangle_count, host.triangle_count);
  const auto expect_same_array = [](const auto* expected, const auto* on_gpu, std::uint32_t count) {
    ASSERT_EQ(on_gpu == nullptr, expected == nullptr);
    if (expected == nullptr) return;
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(on_gpu) % kSectionAlignment, 0u);
    EXPECT_EQ(std::memcmp(download(on_gpu, count).data(), expected, count * sizeof *expected), 0);
  };
  expect_same_array(host.triangles, device.triangles, host.triangle_count);
  expect_same_array(host.oriented_blocks, device.oriented_blocks, host.block_count);
  EXPECT_EQ(device.vertex_count, host.vertex_count);
  EXPECT_EQ(device.component_count, host.component_count);
  EXPECT_EQ(device.closed, host.closed);
  if (contents == Contents::exact_queries) {
    EXPECT_EQ(device.topology, nullptr);
    EXPECT_EQ(device.components, nullptr);
    EXPECT_EQ(device.source_vertices, nullptr);
  } else {
    expect_same_array(host.topology, device.topology, host.triangle_count);
    expect_same_array(host.components, device.components, host.component_count);
    expect_same_array(host.source_vertices, device.source_vertices, host.vertex_count);
  }
  if (contents == Contents::all)
    expect_same_array(host.blocks, device.blocks, host.block_count);
  else
    EXPECT_EQ(device.blocks, nullptr);
}

/// Triangles for a coarser level: within the bounds of any soup of more of them.
test::Mesh inner_soup(test::RandomPoses& random, std::uint32_t triangles) {
  test::Mesh mesh = test::soup(random, triangles, 0.1);
  for (auto& point : mesh.points) {
    for (float& coordinate : point) coordinate *= 0.5f;
  }
  return mesh;
}

/// A file, and its copy in GPU memory.
struct Uploaded {
  explicit Uploaded(const test::Bytes& bytes, Contents contents = Contents::all)
      : file(bytes), view(file.check().asset) {
    EXPECT_EQ(file.check().status, Status::kOk);
    EXPECT_EQ(assets.upload({&view, 1}, contents, nullptr), Status::kOk)
        << cudaGetErrorString(assets.cuda_error());
  }
  explicit Uploaded(const test::Mesh& mesh) : Uploaded(test::Bytes(test::make_file(mesh))) {}

  test::Bytes file;
  AssetView view;
  DeviceAssets assets;
};

TEST_F(Gpu, AnUploadedFileHasTheSameBytes) {
  const Uploaded uploaded(test::random_mesh(5000, 1));
  EXPECT_EQ(uploaded.assets.bytes(), uploaded.file.size());
  expect_same(uploaded.view.level(), uploaded.assets.level(0), Contents::all);
}

TEST_F(Gpu, AnUploadHasWhatItIsFor) {
  test::RandomPoses random(4);
  std::vector<test::MadeLevel> levels;
  levels.push_back(test::built_level(test::soup(random, 2001, 0.1)));
  for (const std::uint32_t triangles : {100u, 7u})
    levels.push_back(test::built_level(inner_soup(random, triangles), 2001.0 - triangles));
  const test::Bytes file = test::made_file(levels);
  ASSERT_EQ(file.check().status, Status::kOk);
  const AssetView view = file.check().asset;
  DeviceAssets assets;
  for (const Contents contents : {Contents::exact_queries, Contents::manifolds}) {
    ASSERT_EQ(assets.upload({&view, 1}, contents, nullptr), Status::kOk);
    std::size_t needed = 0;
    for (std::uint32_t i = 0; i < 3; ++i) {
      const LevelView host = view.level(i);
      expect_same(host, assets.level(0, i), contents);
      needed += host.triangle_count * sizeof(Triangle) + host.block_count * sizeof(OrientedBlock);
      if (contents != Contents::manifolds) continue;
      needed +=
          host.triangle_count * sizeof(TriangleTopology) + host.component_count * sizeof(SurfaceComponent);
      needed += host.vertex_count * sizeof(std::uint32_t);
    }
    EXPECT_GE(assets.bytes(), needed);
    EXPECT_LT(assets.bytes(), needed + 18 * kSectionAlignment);
  }
}

TEST_F(Gpu, AFileWithoutTopologyIsUploadedForManifoldsWithoutIt) {
  test::RandomPoses random(7);
  const test::MadeLevel level = test::built_level(test::soup(random, 30, 0.1));
  const Uploaded uploaded(test::made_file({&level, 1}, true, false), Contents::manifolds);
  EXPECT_NE(uploaded.assets.level(0).triangles, nullptr);
  EXPECT_EQ(uploaded.assets.level(0).topology, nullptr);
  EXPECT_EQ(uploaded.assets.level(0).components, nullptr);
  EXPECT_EQ(uploaded.assets.level(0).source_vertices, nullptr);
}

/// Files from one triangle on, of one level and of several, and so many views of them, in turn, that threads
/// copy them.
class ManyFiles {
 public:
  static constexpr std::uint64_t kLeastBytes = std::uint64_t{200} << 20;

  ManyFiles() {
    test::RandomPoses random(5);
    std::vector<AssetView> once;
    for (const std::uint32_t triangles : {1u, 100'000u, 3u, 777u, 20'000u}) {
      std::vector<test::MadeLevel> levels = {test::built_level(test::soup(random, triangles, 0.1))};
      if (triangles == 777) levels.push_back(test::built_level(inner_soup(random, 50), 1));
      files_.push_back(std::make_unique<test::Bytes>(test::made_file(levels)));
      EXPECT_EQ(files_.back()->check().status, Status::kOk);
      once.push_back(files_.back()->check().asset);
    }
    for (std::uint64_t bytes = 0; bytes < kLeastBytes;) {
      views.push_back(once[views.size() % once.size()]);
      bytes += views.back().level().triangle_count * sizeof(Triangle);
    }
  }

  void expect_all(const DeviceAssets& assets, Contents contents) const {
    ASSERT_EQ(assets.count(), views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
      for (std::uint32_t level = 0; level < views[i].levels.size(); ++level)
        expect_same(views[i].level(level), assets.level(i, level), contents);
    }
  }

  std::vector<AssetView> views;

 private:
  std::vector<std::unique_ptr<test::Bytes>> files_;
};

TEST_F(Gpu, ManyAssetsAreAllThereAtOnce) {
  const ManyFiles files;
  DeviceAssets assets;
  for (const Contents contents : {Contents::all, Contents::exact_queries, Contents::manifolds}) {
    ASSERT_EQ(assets.upload(files.views, contents, nullptr), Status::kOk);
    EXPECT_GE(assets.bytes(), ManyFiles::kLeastBytes);
    files.expect_all(assets, contents);
  }
}

TEST_F(Gpu, ThreadsUploadSideBySide) {
  const ManyFiles files;
  DeviceAssets assets[2];
  Status status[2];
  const auto upload = [&](int i) {
    GpuStream stream;
    ASSERT_EQ(stream.create(), cudaSuccess);
    status[i] = assets[i].upload(files.views, Contents::exact_queries, stream.get());
  };
  std::thread other(upload, 1);
  upload(0);
  other.join();
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(status[i], Status::kOk);
    files.expect_all(assets[i], Contents::exact_queries);
  }
}

TEST_F(Gpu, AnyThreadsAndChunksCopyTheSame) {
  constexpr std::uint64_t kGuard = 4096;
  std::mt19937_64 random(6);
  std::vector<unsigned char> bytes(3'000'000);
  for (unsigned char& byte : bytes) byte = static_cast<unsigned char>(random());
  GpuStream stream;
  ASSERT_EQ(stream.create(), cudaSuccess);
  for (const std::vector<std::uint64_t>& sizes : {std::vector<std::uint64_t>{},
                                                  {1},
                                                  {4096},
                                                  {4097},
                                                  {8 * 2 * 4096},
                                                  {1'000'000, 1, 256, 255, 1'234'567}}) {
    std::vector<Piece> pieces;
    const unsigned char* from = bytes.data();
    for (const std::uint64_t size : sizes) {
      pieces.push_back({from, size, 0});
      from += size;
    }
    const std::uint64_t size = place(pieces);
    for (const std::uint32_t threads : {0u, 1u, 2u, 5u, kMostStagingThreads}) {
      for (const std::uint64_t chunk : {1000u, 4096u, 1u << 20}) {
        const auto copy = on_gpu(std::vector<unsigned char>(size + kGuard, 0xEE));
        ASSERT_EQ(cudaDeviceSynchronize(), cudaSuccess);  // `stream` does not wait for the default stream
        ASSERT_EQ(copy_pieces(pieces, size, {threads, chunk}, copy.data(), stream.get()), cudaSuccess);
        const auto copied = download(copy.data(), size + kGuard);
        for (const Piece& piece : pieces)
          EXPECT_EQ(std::memcmp(copied.data() + piece.offset, piece.from, piece.bytes), 0);
        EXPECT_EQ(std::count(copied.begin() + size, copied.end(), 0xEE), kGuard);
      }
    }
  }
}

TEST_F(Gpu, ACopyThatFailsSaysSo) {
  const std::vector<unsigned char> bytes(100'000);
  Piece piece = {bytes.data(), bytes.size(), 0};
  for (const std::uint32_t threads : {0u, 1u, kMostStagingThreads}) {
    EXPECT_NE(copy_pieces({&piece, 1}, piece.bytes, {threads, 4096}, nullptr, nullptr), cudaSuccess);
    static_cast<void>(cudaGetLastError());
  }
}

TEST_F(Gpu, AssetsMoveAndUploadAgain) {
  Uploaded first(test::random_mesh(100, 1));
  DeviceAssets second = std::move(first.assets);
  EXPECT_EQ(first.assets.count(), 0u);
  EXPECT_EQ(second.count(), 1u);
  ASSERT_EQ(second.upload({&first.view, 1}, Contents::all, nullptr), Status::kOk);
  EXPECT_EQ(second.level(0).triangle_count, 100u);
  ASSERT_EQ(second.upload({}, Contents::all, nullptr), Status::kOk);
  EXPECT_EQ(second.count(), 0u);
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
  const Uploaded uploaded(test::random_mesh(5001, 2));
  const auto leaves = on_gpu(std::vector<unsigned>{0});
  const LevelView level = uploaded.assets.level(0);
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
  const Box imaginary = {{kImaginaryCentre, kImaginaryCentre, kImaginaryCentre},
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
      trial.other.centre[i] = pick();
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
