#pragma once
#include <cstdint>
#include <span>

#include "kernels/common/gpu_host.h"
#include "kernels/contact/gpu_query_data.h"
#include "kernels/contact/neighbour_lists.h"
#include "tandem/kernels/detail/buffer.h"

// Neighbourhoods of a query's assets in GPU memory. The CPU makes them from the topology that lies there.
namespace tandem::gpu {

class GpuNeighbours {
 public:
  explicit GpuNeighbours(Memory& memory) : first_(memory), higher_(memory), of_assets_(memory) {}

  /// Takes other assets, and forgets the neighbourhoods of those before. Result: kOk or kOutOfMemory.
  Status set_assets(std::span<const GpuAsset> assets) {
    forget();
    if (!levels_.resize(assets.size())) return Status::kOutOfMemory;
    for (std::size_t i = 0; i < assets.size(); ++i) levels_[i] = assets[i].tree;
    return Status::kOk;
  }

  /// Returns whether the neighbourhoods for so many rings are there. 0: none are needed.
  bool has(std::uint32_t rings) const { return rings == 0 || rings_ == rings; }

  /// Makes them where they are not there, waiting for the device. keep(): takes what CUDA says, and gives its
  /// status. Result: kOk, kOutOfMemory, kOutOfGpuMemory or kCudaFailed.
  template <typename Keep>
  Status provide(std::uint32_t rings, const Keep& keep) {
    if (has(rings)) return Status::kOk;
    forget();
    NeighbourLists lists;
    Status status = make_lists(rings, lists, keep);
    Buffer<Neighbourhood> of_assets;
    if (status == Status::kOk && !of_assets.resize(levels_.size())) status = Status::kOutOfMemory;
    if (status == Status::kOk) status = keep(first_.upload(lists.first(), nullptr));
    if (status == Status::kOk) status = keep(higher_.upload(lists.higher(), nullptr));
    if (status != Status::kOk) return status;
    for (std::size_t i = 0; i < levels_.size(); ++i) {
      const std::uint32_t mesh = lists.find(levels_[i].topology);
      of_assets[i] = mesh == kNoIndex ? Neighbourhood{} : lists.of(mesh, first_.data(), higher_.data());
    }
    status = keep(of_assets_.upload(of_assets.view(), nullptr));
    if (status == Status::kOk) status = keep(cudaDeviceSynchronize());
    if (status == Status::kOk) rings_ = rings;
    return status;
  }

 private:
  void forget() {
    rings_ = 0;
    first_.free();
    higher_.free();
    of_assets_.free();
  }

  template <typename Keep>
  Status make_lists(std::uint32_t rings, NeighbourLists& lists, const Keep& keep) {
    lists.restart(rings);
    Buffer<TriangleTopology> topology;
    for (const LevelView& level : levels_.view()) {
      if (level.topology == nullptr || lists.find(level.topology) != kNoIndex) continue;
      if (!topology.resize(level.triangle_count)) return Status::kOutOfMemory;
      const std::span<TriangleTopology> room(topology.data(), topology.size());
      const Status status = rings > 1 ? keep(download(level.topology, room, nullptr)) : Status::kOk;
      if (status != Status::kOk) return status;
      if (!lists.add(level, topology.data())) return Status::kOutOfMemory;
    }
    return Status::kOk;
  }

  Buffer<LevelView> levels_;
  std::uint32_t rings_ = 0;  // that the arrays are for
  RoomArray<std::uint32_t> first_, higher_;
  ArgArray<&QueryArgs::neighbourhoods> of_assets_;
};

}  // namespace tandem::gpu
