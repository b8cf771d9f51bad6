#pragma once
#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <vector>

#include "kernels/query_scenes.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/runtime/upload.h"

/// What tests of queries on a GPU share.
namespace tandem::test {

inline bool no_gpu() {
  int count = 0;
  if (cudaGetDeviceCount(&count) == cudaSuccess && count > 0) return false;
  static_cast<void>(cudaGetLastError());
  return true;
}

/// Tests that need a GPU.
class GpuTest : public testing::Test {
 protected:
  void SetUp() override {
    if (no_gpu()) GTEST_SKIP() << "no GPU here";
  }
};

/// With TANDEM_GPU_BLOCKS=N, queries take N blocks at most: for tools that are slow where warps wait.
inline GpuQueryOptions gpu_options(QueryMode mode, bool first_contact_only = false) {
  const char* blocks = std::getenv("TANDEM_GPU_BLOCKS");
  GpuQueryOptions options = {mode, first_contact_only};
  if (blocks != nullptr) options.most_blocks = static_cast<std::uint32_t>(std::atoi(blocks));
  return options;
}

/// An array in GPU memory.
template <typename Element>
class OnGpu {
 public:
  explicit OnGpu(const std::vector<Element>& host) : size_(host.size()) {
    void* memory = nullptr;
    EXPECT_EQ(cudaMalloc(&memory, std::max<std::size_t>(size_, 1) * sizeof(Element)), cudaSuccess);
    data_ = static_cast<Element*>(memory);
    EXPECT_EQ(cudaMemcpy(data_, host.data(), size_ * sizeof(Element), cudaMemcpyHostToDevice), cudaSuccess);
  }
  OnGpu(const OnGpu&) = delete;
  OnGpu& operator=(const OnGpu&) = delete;
  ~OnGpu() { cudaFree(data_); }

  Element* data() const { return data_; }

 private:
  Element* data_ = nullptr;
  std::size_t size_;
};

template <typename Value>
std::vector<Value> download(const Value* device, std::size_t count) {
  std::vector<Value> host(count);
  EXPECT_EQ(cudaMemcpy(host.data(), device, count * sizeof(Value), cudaMemcpyDeviceToHost), cudaSuccess);
  return host;
}

/// A scene, all of it in GPU memory, and its object pairs.
class GpuScene {
 public:
  GpuScene(const SampleAssets& assets, const std::vector<Instance>& instances,
           const std::vector<ObjectPair>& pairs)
      : asset_(assets_of(instances)),
        pose_(poses_of(instances)),
        pairs_(pairs),
        count_({static_cast<std::uint32_t>(pairs.size())}),
        instance_count_(static_cast<std::uint32_t>(instances.size())),
        pair_count_(static_cast<std::uint32_t>(pairs.size())) {
    for (const AssetView& view : assets.views()) {
      uploads_.push_back(std::make_unique<DeviceAsset>());
      EXPECT_EQ(uploads_.back()->upload(view, nullptr), Status::kOk);
      views_.push_back(gpu_asset(uploads_.back()->level(), *view.header));
    }
  }

  std::span<const GpuAsset> assets() const { return views_; }
  GpuInstances instances() const { return {asset_.data(), pose_.data(), instance_count_}; }
  GpuPairs pairs() const { return {pairs_.data(), count_.data(), pair_count_}; }

 private:
  static std::vector<std::uint32_t> assets_of(const std::vector<Instance>& instances) {
    std::vector<std::uint32_t> out;
    for (const Instance& instance : instances) out.push_back(instance.asset);
    return out;
  }
  static std::vector<Pose> poses_of(const std::vector<Instance>& instances) {
    std::vector<Pose> out;
    for (const Instance& instance : instances) out.push_back(instance.pose);
    return out;
  }

  std::vector<std::unique_ptr<DeviceAsset>> uploads_;
  std::vector<GpuAsset> views_;
  OnGpu<std::uint32_t> asset_;
  OnGpu<Pose> pose_;
  OnGpu<ObjectPair> pairs_;
  OnGpu<std::uint32_t> count_;
  std::uint32_t instance_count_, pair_count_;
};

/// Bodies at random places, close enough to meet.
inline Scene pile(std::uint32_t bodies, std::uint32_t triangles, double spread, std::uint64_t seed) {
  RandomPoses random(seed);
  Scene scene;
  scene.assets.add(soup(random, triangles, 0.1));
  scene.assets.add(cube(0.5f, 12));
  for (std::uint32_t i = 0; i < bodies; ++i) {
    scene.instances.push_back({i % 2, random.pose({1, 1, spread, 0, 4})});
  }
  return scene;
}

}  // namespace tandem::test
