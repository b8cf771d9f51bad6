#pragma once
#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <tuple>
#include <vector>

#include "kernels/query_scenes.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_stream.h"
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

/// Tests that need a GPU. Base: testing::Test or testing::TestWithParam.
template <typename Base>
class NeedsGpu : public Base {
 protected:
  void SetUp() override {
    if (no_gpu()) GTEST_SKIP() << "no GPU here";
  }
};
using GpuTest = NeedsGpu<testing::Test>;
template <typename Parameter>
using GpuTestOf = NeedsGpu<testing::TestWithParam<Parameter>>;

/// With TANDEM_GPU_BLOCKS=N, queries take N blocks at most: for tools that are slow where warps wait.
inline GpuContactOptions gpu_options(QueryMode mode, bool first_contact_only = false) {
  const char* blocks = std::getenv("TANDEM_GPU_BLOCKS");
  GpuContactOptions options = {mode, first_contact_only};
  if (blocks != nullptr) options.most_blocks = static_cast<std::uint32_t>(std::atoi(blocks));
  return options;
}

/// A copy in GPU memory.
template <typename Element>
GpuArray<Element> on_gpu(const std::vector<Element>& host) {
  GpuArray<Element> array;
  EXPECT_EQ(array.upload(host, nullptr), cudaSuccess);
  return array;
}

template <typename Element>
std::vector<Element> download(const Element* device, std::size_t count) {
  std::vector<Element> host(count);
  EXPECT_EQ(tandem::download<Element>(device, host, nullptr), cudaSuccess);
  return host;
}

/// An order of contacts: by pair, then triangles.
inline bool comes_before(const Contact& x, const Contact& y) {
  const auto key = [](const Contact& c) {
    return std::tie(c.pair, c.triangle_a, c.triangle_b, c.face_a, c.face_b);
  };
  return key(x) < key(y);
}

inline std::vector<Contact> sorted(std::vector<Contact> contacts) {
  std::sort(contacts.begin(), contacts.end(), comes_before);
  return contacts;
}

/// Every two instances, in either order, and with `selves` each with itself.
inline std::vector<ObjectPair> all_pairs(const std::vector<Instance>& instances, bool selves,
                                         RandomPoses& random) {
  std::vector<ObjectPair> pairs;
  const auto count = static_cast<std::uint32_t>(instances.size());
  for (std::uint32_t a = 0; a < count; ++a) {
    for (std::uint32_t b = selves ? a : a + 1; b < count; ++b) {
      pairs.push_back(random.below(2) == 0 ? ObjectPair{a, b} : ObjectPair{b, a});
    }
  }
  return pairs;
}

/// A scene, all of it in GPU memory, and its object pairs.
class GpuScene {
 public:
  GpuScene(const SampleAssets& assets, const std::vector<Instance>& instances,
           const std::vector<ObjectPair>& pairs, Contents contents = Contents::all)
      : GpuScene(assets.views(), instances, pairs, contents) {}
  GpuScene(std::span<const AssetView> files, const std::vector<Instance>& instances,
           const std::vector<ObjectPair>& pairs, Contents contents = Contents::all)
      : asset_(on_gpu(part(instances, &Instance::asset))),
        pose_(on_gpu(part(instances, &Instance::pose))),
        pairs_(on_gpu(pairs)),
        count_(on_gpu(std::vector<std::uint32_t>{static_cast<std::uint32_t>(pairs.size())})),
        instance_count_(static_cast<std::uint32_t>(instances.size())),
        pair_count_(static_cast<std::uint32_t>(pairs.size())) {
    EXPECT_EQ(uploaded_.upload(files, contents, nullptr), Status::kOk);
    for (std::size_t i = 0; i < uploaded_.count(); ++i) {
      views_.push_back(gpu_asset(uploaded_.level(i), files[i]));
      for (std::uint32_t level = 0; level < files[i].levels.size(); ++level)
        levels_.push_back(gpu_asset(uploaded_.level(i, level), files[i], level));
    }
  }

  std::span<const GpuAsset> assets() const { return views_; }
  std::span<const GpuAsset> levels() const { return levels_; }  ///< asset by asset
  std::size_t asset_bytes() const { return uploaded_.bytes(); }
  GpuInstances instances() const { return {asset_.data(), pose_.data(), instance_count_}; }
  GpuPairs pairs() const { return {pairs_.data(), count_.data(), pair_count_}; }

 private:
  template <typename Value>
  static std::vector<Value> part(const std::vector<Instance>& instances, Value Instance::*member) {
    std::vector<Value> out;
    for (const Instance& instance : instances) out.push_back(instance.*member);
    return out;
  }

  DeviceAssets uploaded_;
  std::vector<GpuAsset> views_, levels_;
  GpuArray<std::uint32_t> asset_;
  GpuArray<Pose> pose_;
  GpuArray<ObjectPair> pairs_;
  GpuArray<std::uint32_t> count_;
  std::uint32_t instance_count_, pair_count_;
};

/// Bodies at random places, close enough to meet.
inline BodyScene pile(std::uint32_t bodies, std::uint32_t triangles, double spread, std::uint64_t seed) {
  RandomPoses random(seed);
  BodyScene scene;
  scene.assets.add(soup(random, triangles, 0.1));
  scene.assets.add(cube(0.5f, 12));
  for (std::uint32_t i = 0; i < bodies; ++i) {
    scene.instances.push_back({i % 2, random.pose({1, 1, spread, 0, 4})});
  }
  return scene;
}

}  // namespace tandem::test
