#pragma once
#include <cuda_runtime_api.h>

#include <algorithm>
#include <vector>

#include "kernels/random_scenes.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_containment_query.h"
#include "tandem/kernels/gpu_manifold_query.h"
#include "tandem/runtime/upload.h"

namespace tandem::test {

/// Does on the GPU all that CpuDetection does. Functions throw std::runtime_error where a call fails.
class GpuDetection {
 public:
  explicit GpuDetection(std::span<const AssetView> meshes) {
    require(uploaded_.upload(meshes, Contents::manifolds, nullptr), "upload");
    std::vector<GpuAsset> assets;
    std::vector<AssetBounds> bounds;
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      assets.push_back(gpu_asset(uploaded_.level(i), meshes[i]));
      bounds.push_back(asset_bounds(*meshes[i].header));
    }
    bounds_ = copied(bounds);
    mesh_count_ = static_cast<std::uint32_t>(meshes.size());
    require(query_.set_assets(assets, nullptr), "contacts");
    require(manifolds_.set_assets(assets, nullptr), "manifolds");
    require(containment_.set_assets(assets, nullptr), "containment");
  }

  Detected step(std::span<const Instance> instances) {
    std::vector<std::uint32_t> assets;
    std::vector<Pose> poses;
    for (const Instance& instance : instances)
      assets.push_back(instance.asset), poses.push_back(instance.pose);
    const GpuArray<std::uint32_t> asset = copied(assets);
    const GpuArray<Pose> pose = copied(poses);
    const GpuInstances scene = {asset.data(), pose.data(), static_cast<std::uint32_t>(instances.size())};
    require(broad_.find_pairs(scene, {bounds_.data(), mesh_count_}, {.sorted = true}, nullptr),
            "broad phase");
    const GpuPairs pairs = broad_.pairs();
    require(query_.find_contacts(scene, pairs, {.grouped = true}, nullptr), "contacts");
    require(manifolds_.make(scene, pairs, query_, {}, nullptr), "manifolds");
    require(containment_.find(scene, pairs, query_, nullptr), "containment");
    Detected out = {copied_back(pairs.pairs, broad_.report().count),
                    copied_back(query_.contacts(), query_.report().contacts),
                    copied_back(manifolds_.manifolds(), manifolds_.report().manifolds),
                    copied_back(manifolds_.points(), manifolds_.report().points),
                    manifolds_.report().counters,
                    copied_back(containment_.contained(), containment_.report().contained)};
    sort(out.contacts);
    return out;
  }

 private:
  template <typename Element>
  static GpuArray<Element> copied(const std::vector<Element>& host) {
    GpuArray<Element> array;
    require(status_of(array.upload(host, nullptr)), "a copy");
    return array;
  }
  template <typename Element>
  static std::vector<Element> copied_back(const Element* device, std::uint64_t count) {
    std::vector<Element> host(count);
    require(status_of(tandem::download<Element>(device, host, nullptr)), "a copy");
    return host;
  }

  DeviceAssets uploaded_;
  GpuArray<AssetBounds> bounds_;
  std::uint32_t mesh_count_ = 0;
  GpuBroadPhase broad_;
  GpuContactQuery query_;
  GpuManifoldQuery manifolds_;
  GpuContainmentQuery containment_;
};

}  // namespace tandem::test
