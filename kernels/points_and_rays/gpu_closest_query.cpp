#include "tandem/kernels/gpu_closest_query.h"

#include "kernels/common/check_options.h"
#include "kernels/common/surface_labels.h"
#include "kernels/points_and_rays/closest_search.h"
#include "kernels/points_and_rays/gpu_probes.h"

namespace tandem::gpu {

template <>
struct HostOf<GpuClosestReport> : ProbeHost<GpuClosestReport> {
  ArgArray<&ClosestArgs::rows> rows{of_probes};
  ArgArray<&ClosestArgs::surfaces> surfaces{*this};
  RoomArray<std::uint32_t> labels{*this};

  GpuClosestCapacity capacity() const { return {of_instances.count(), of_probes.count(), words}; }
  Status reserve(const GpuClosestCapacity& wanted, const GpuNoOptions&) {
    return reserve_probes(wanted.instances, wanted.points, wanted.words);
  }

  // Returns whether triangles have to be told apart by their components.
  static bool is_labelled(const GpuAsset& asset) {
    return asset.tree.topology != nullptr && !asset.tree.closed && asset.tree.component_count > 1;
  }

  Status make_surfaces(std::span<const GpuAsset> given, cudaStream_t stream) {
    std::size_t labelled = 0;
    for (const GpuAsset& asset : given) labelled += is_labelled(asset) ? asset.tree.triangle_count : 0;
    Buffer<ProbedSurface> made;
    Buffer<std::uint32_t> made_labels;
    if (!made.resize(given.size()) || !made_labels.resize(labelled)) return Status::kOutOfMemory;
    Status status = keep(labels.reserve(labelled));
    std::size_t next = 0;
    for (std::size_t i = 0; i < given.size() && status == Status::kOk; ++i) {
      bool any_closed = given[i].tree.closed;
      made[i] = {nullptr, 0, 0};
      if (is_labelled(given[i])) {
        made[i].labels = labels.data() + next;
        status = label_surface(given[i], made_labels.data() + next, any_closed, *this, stream);
        next += given[i].tree.triangle_count;
      }
      made[i].any_closed = any_closed;
    }
    if (status == Status::kOk) status = keep(labels.upload(made_labels.view(), stream));
    if (status == Status::kOk) status = keep(surfaces.upload(made.view(), stream));
    return status == Status::kOk ? keep(cudaStreamSynchronize(stream)) : status;
  }

  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    const Status status = take_assets(given, stream);
    return status == Status::kOk ? make_surfaces(given, stream) : status;
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuClosestCapacity, GpuClosestReport>;
template class GpuAssetQuestion<GpuClosestCapacity, GpuClosestReport>;

Status GpuClosestQuery::enqueue(const GpuInstances& instances, const GpuClosestOptions& options,
                                cudaStream_t stream) {
  const Status status = check_distance_options(options.tolerance, options.reach);
  if (status != Status::kOk) return status;
  const auto& host = *host_;
  if (!host.has_room(instances, options.point_count)) return Status::kOutOfRange;
  if (options.sides && !host.assets.all.topology) return Status::kNoTopology;
  gpu::ClosestArgs args = {};
  host.fill_probes(args, instances, options.point_count, options.looked_at);
  args.points = options.points;
  args.tolerance = options.tolerance;
  args.reach = options.reach;
  args.beyond_reach = beyond(options.reach);
  args.sides = options.sides;
  args.capacity = host.capacity();
  const auto clear = [&](const auto&, cudaStream_t on) { return host.clear_counts(on); };
  return host_->keep(gpu::queue(args, stream, clear, gpu::prepare_points, gpu::find_closest,
                                gpu::find_closest_exactly, gpu::find_sides, gpu::report_closest));
}

Status GpuClosestQuery::find(const GpuInstances& instances, const GpuClosestOptions& options,
                             cudaStream_t stream) {
  const GpuClosestCapacity first = {instances.count, options.point_count, capacity().words};
  return gpu::find_until_complete(
      *host_, first, GpuNoOptions{}, stream, [&] { return enqueue(instances, options, stream); },
      [](const GpuClosestReport& report, GpuClosestCapacity& wanted) {
        wanted = report.needed;
        return Status::kOk;
      });
}

const ClosestPoint* GpuClosestQuery::rows() const {
  return host_->rows.data();
}

}  // namespace tandem
