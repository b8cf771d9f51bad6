#include "tandem/kernels/gpu_containment_query.h"

#include <algorithm>

#include "kernels/common/gpu_host.h"
#include "kernels/common/surface_labels.h"
#include "kernels/containment/containment_data.h"
#include "kernels/containment/follow_records.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem::gpu {

using containment::Surface;

template <>
struct HostOf<GpuContainmentReport> : GpuHost<ContainmentState, GpuContainmentReport> {
  ArgArray<&ContainmentArgs::surfaces> surfaces{*this};
  RoomArray<std::uint32_t> labels{*this};
  std::uint32_t asset_count = 0;
  const GpuAsset* records = nullptr;  // to follow

  Room<std::uint32_t> of_pairs{*this};
  ArgArray<&ContainmentArgs::rows_of_pair> rows_of_pair{of_pairs};
  ArgArray<&ContainmentArgs::sums> sums{of_pairs,
                                        [](std::uint64_t pairs) { return pairs / kPairsPerSum + 1; }};
  Room<std::uint32_t> of_rows{*this};
  ArgArray<&ContainmentArgs::found> found{of_rows};
  ArgArray<&ContainmentArgs::contained> contained{of_rows};

  GpuContainmentCapacity capacity() const { return {of_pairs.count(), of_rows.count()}; }
  Status reserve(const GpuContainmentCapacity& wanted, const GpuNoOptions&) {
    const Status status = keep(of_pairs.grow(wanted.pairs));
    return status == Status::kOk ? keep(of_rows.grow(wanted.contained)) : status;
  }

  // labels_of_it: in CPU memory, to be filled where there is more than one component.
  Status make_surface(const GpuAsset& asset, std::uint32_t* labels_of_it, cudaStream_t stream, Surface& out) {
    const LevelView& level = asset.tree;
    out = {};
    take_shape(asset, out);
    out.components = level.components;
    out.triangle_count = level.triangle_count;
    out.component_count = level.component_count;
    out.closed = out.any_closed = level.closed;
    return level.component_count == 1 ? Status::kOk
                                      : label_surface(asset, labels_of_it, out.any_closed, *this, stream);
  }

  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream) {
    asset_count = 0;
    records = nullptr;
    std::size_t labelled = 0;
    for (const GpuAsset& asset : assets) {
      if (asset.tree.topology == nullptr) return Status::kNoTopology;
      if (asset.tree.component_count != 1) labelled += asset.tree.triangle_count;
    }
    Buffer<Surface> made;
    Buffer<std::uint32_t> made_labels;
    if (!made.resize(assets.size()) || !made_labels.resize(labelled)) return Status::kOutOfMemory;
    Status status = provide_fixed_memory();
    if (status == Status::kOk) status = keep(labels.reserve(labelled));
    std::size_t next = 0;
    for (std::size_t i = 0; i < assets.size() && status == Status::kOk; ++i) {
      status = make_surface(assets[i], made_labels.data() + next, stream, made[i]);
      if (assets[i].tree.component_count == 1) continue;
      made[i].labels = labels.data() + next;
      next += assets[i].tree.triangle_count;
    }
    if (status == Status::kOk) status = keep(labels.upload(made_labels.view(), stream));
    if (status == Status::kOk) status = keep(surfaces.upload(made.view(), stream));
    if (status == Status::kOk) status = keep(cudaStreamSynchronize(stream));
    if (status == Status::kOk) asset_count = static_cast<std::uint32_t>(assets.size());
    return status;
  }

  Status follow(const GpuAssetRecords& of_list) {
    if (of_list.positions != PositionTypes::float32) return Status::kNotFloat32;
    records = of_list.assets;
    return Status::kOk;
  }
  cudaError_t take_surfaces(cudaStream_t stream) const {
    return records != nullptr ? follow_records(records, asset_count, surfaces.data(), stream) : cudaSuccess;
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuContainmentCapacity, GpuContainmentReport>;
template class GpuAssetQuestion<GpuContainmentCapacity, GpuContainmentReport>;

Status GpuContainmentQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                                    const GpuContactQuery& query, cudaStream_t stream) {
  const auto& host = *host_;
  gpu::ContainmentArgs args = {};
  host.fill(args, instances);
  args.pairs = pairs;
  args.groups = query.groups();
  args.query = query.device_report();
  args.capacity = host.capacity();
  const auto take_surfaces = [&](const auto&, cudaStream_t on) { return host.take_surfaces(on); };
  return host_->keep(gpu::queue(args, stream, take_surfaces, gpu::find_contained));
}

Status GpuContainmentQuery::find(const GpuInstances& instances, const GpuPairs& pairs,
                                 const GpuContactQuery& query, cudaStream_t stream) {
  GpuContainmentCapacity first = capacity();
  first.pairs = std::max(first.pairs, pairs.capacity);
  return gpu::find_behind(query, *host_, first, GpuNoOptions{}, stream,
                          [&] { return enqueue(instances, pairs, query, stream); });
}

const Containment* GpuContainmentQuery::contained() const {
  return host_->contained.data();
}

}  // namespace tandem
