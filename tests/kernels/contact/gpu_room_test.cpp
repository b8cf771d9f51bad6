// GPU memory: how much is taken, and what becomes of those who ask when there is none.
#include <gtest/gtest.h>

#include "gpu/gpu_scene_fixture.h"
#include "tandem/kernels/gpu_broad_phase.h"

namespace tandem {
namespace {

using test::AskedContacts;
using test::BodyScene;
using test::GpuScene;

/// Takes all GPU memory that is left.
class FullGpu {
 public:
  FullGpu() {
    for (std::size_t bytes = std::size_t{1} << 34; bytes >= 4096; bytes /= 2) {
      void* memory = nullptr;
      while (cudaMalloc(&memory, bytes) == cudaSuccess) taken_.push_back(memory);
    }
    static_cast<void>(cudaGetLastError());
  }
  FullGpu(const FullGpu&) = delete;
  FullGpu& operator=(const FullGpu&) = delete;
  ~FullGpu() {
    for (void* memory : taken_) cudaFree(memory);
  }

 private:
  std::vector<void*> taken_;
};

class GpuRoom : public test::GpuTest {};

std::vector<ObjectPair> every_pair(const BodyScene& scene) {
  test::RandomPoses random(1);
  return test::all_pairs(scene.instances, false, random);
}

TEST_F(GpuRoom, AFullGpuIsToldByItsNameAndIsNoEnd) {
  const BodyScene scene = test::pile(100, 3000, 1, 31);
  const std::vector<ObjectPair> pairs = every_pair(scene);
  const build::Image large = test::make_file(test::random_mesh(100000, 1));
  const AssetView large_view = check(large.data(), large.size()).asset;
  AskedContacts gpu(scene, pairs);
  GpuContactQuery another;
  ASSERT_EQ(gpu.query.reserve({1, 1, 1}), Status::kOk);
  GpuBroadPhase broad;
  DeviceAssets assets;
  const std::vector<AssetView> many(50, large_view);  // by threads
  {
    const FullGpu full;
    EXPECT_EQ(assets.upload(many, Contents::all, nullptr), Status::kOutOfGpuMemory);
    EXPECT_EQ(assets.cuda_error(), cudaErrorMemoryAllocation);
    EXPECT_EQ(assets.bytes(), 0u);
    EXPECT_EQ(assets.count(), 0u);
    EXPECT_EQ(broad.reserve({1'000'000, 1'000'000, 1'000'000}), Status::kOutOfGpuMemory);
    EXPECT_EQ(broad.cuda_error(), cudaErrorMemoryAllocation);
    EXPECT_EQ(another.set_assets(gpu.scene.assets(), nullptr), Status::kOutOfGpuMemory);
    EXPECT_EQ(gpu.query.reserve({1'000'000, 1'000'000, 1'000'000}), Status::kOutOfGpuMemory);
    EXPECT_EQ(gpu.find({.sorted = true}), Status::kOutOfGpuMemory);
    EXPECT_EQ(gpu.query.cuda_error(), cudaErrorMemoryAllocation);
    EXPECT_EQ(cudaGetLastError(), cudaSuccess);  // nothing that failed is left behind
  }
  EXPECT_EQ(assets.upload(many, Contents::all, nullptr), Status::kOk);
  EXPECT_EQ(assets.bytes(), 50 * large.size());
  EXPECT_EQ(broad.reserve({1'000'000, 1'000'000, 1'000'000}), Status::kOk);
  for (GpuContactQuery* each : {&gpu.query, &another}) {
    ASSERT_EQ(each->set_assets(gpu.scene.assets(), nullptr), Status::kOk);
    EXPECT_EQ(each->find_contacts(gpu.scene.instances(), gpu.scene.pairs(), {.sorted = true}, nullptr),
              Status::kOk);
    EXPECT_GT(each->report().contacts, 100000u);
  }
}

/// GPU memory taken since then, by the driver's count. It gives out 2 MiB at a time, to small arrays
/// together.
class Taken {
 public:
  std::size_t bytes() const { return before_ - free(); }
  static constexpr std::size_t kSlack = std::size_t{40} << 20;

 private:
  static std::size_t free() {
    std::size_t free = 0, total = 0;
    EXPECT_EQ(cudaMemGetInfo(&free, &total), cudaSuccess);
    return free;
  }
  std::size_t before_ = free();
};

TEST_F(GpuRoom, AQueryHoldsNoMoreThanItsRuleSays) {
  const BodyScene scene = test::pile(4, 100, 1, 32);
  const GpuScene on_gpu(scene.assets, scene.instances, every_pair(scene));
  for (const GpuContactOptions& options :
       {GpuContactOptions{}, {.sorted = true}, {.grouped = true}, {.sorted = true, .grouped = true}}) {
    for (const GpuContactCapacity wanted :
         {GpuContactCapacity{}, GpuContactCapacity{1, 1, 1}, GpuContactCapacity{3, 70, 9},
          GpuContactCapacity{1'000'000, 100, 100}, GpuContactCapacity{100, 50'000'000, 100},
          GpuContactCapacity{10'000, 2'000'000, 5'000'000}}) {
      const Taken taken;
      GpuContactQuery query;
      ASSERT_EQ(query.set_assets(on_gpu.assets(), nullptr), Status::kOk);
      ASSERT_EQ(query.reserve(wanted, options), Status::kOk);
      const std::size_t most = most_query_bytes(query.capacity(), options, on_gpu.assets().size());
      EXPECT_LE(query.bytes(), most) << wanted.contacts << " contacts, sorted " << options.sorted
                                     << ", grouped " << options.grouped;
      EXPECT_LE(taken.bytes(), query.bytes() + Taken::kSlack);
      EXPECT_LE(most, query.bytes() + query.bytes() / 5 + (9 << 20));  // a rule, not just something large
    }
  }
}

TEST_F(GpuRoom, AQueryThatGrewHoldsNoMoreThanItsRuleSays) {
  const BodyScene scene = test::pile(100, 3000, 1, 33);
  AskedContacts gpu(scene, every_pair(scene));
  ASSERT_EQ(gpu.find({.sorted = true}), Status::kOk);
  EXPECT_LE(gpu.query.bytes(), most_query_bytes(gpu.query.capacity(), {.sorted = true}, scene.assets.size()));
}

/// Queries keep nothing of trees.
TEST_F(GpuRoom, AQueryOfLargeTreesHoldsNoMoreThanItsRuleSays) {
  test::RandomPoses random(34);
  BodyScene scene;
  scene.assets.add(test::soup(random, 600'000, 0.01));
  scene.instances = {{0, kIdentityPose}};
  const AskedContacts gpu(scene, {});
  const std::size_t most = most_query_bytes(gpu.query.capacity(), {}, scene.assets.size());
  EXPECT_LE(gpu.query.bytes(), most);
  EXPECT_LE(most, gpu.query.bytes() + gpu.query.bytes() / 5 + (9 << 20));
}

TEST_F(GpuRoom, ABroadPhaseHoldsNoMoreThanItsRuleSays) {
  for (const bool sorted : {false, true}) {
    for (const GpuBroadPhaseCapacity wanted :
         {GpuBroadPhaseCapacity{}, GpuBroadPhaseCapacity{1, 1, 1}, GpuBroadPhaseCapacity{1000, 10, 1000},
          GpuBroadPhaseCapacity{10, 5'000'000, 10}, GpuBroadPhaseCapacity{3'000'000, 7'000'000, 3'000'000}}) {
      const Taken taken;
      GpuBroadPhase broad;
      ASSERT_EQ(broad.reserve(wanted, {sorted}), Status::kOk);
      const std::size_t most = most_broad_phase_bytes(broad.capacity(), sorted);
      EXPECT_LE(broad.bytes(), most) << wanted.boxes << " boxes, " << wanted.pairs << " pairs, sorted "
                                     << sorted;
      EXPECT_LE(taken.bytes(), broad.bytes() + Taken::kSlack);
      EXPECT_LE(most, broad.bytes() + broad.bytes() / 5 + (2 << 20));
    }
  }
}

}  // namespace
}  // namespace tandem
