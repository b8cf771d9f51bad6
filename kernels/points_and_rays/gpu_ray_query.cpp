#include "tandem/kernels/gpu_ray_query.h"

#include "kernels/common/check_options.h"
#include "kernels/points_and_rays/gpu_probes.h"

namespace tandem::gpu {
namespace {

// The hits that there is room for before a query tells how many there are, for each ray.
constexpr std::uint32_t kFirstHits = 2;

constexpr std::uint64_t one_more(std::uint64_t count) {
  return count + 1;
}

}  // namespace

template <>
struct HostOf<GpuRayReport> : ProbeHost<GpuRayReport> {
  RoomArray<RayHit> first_rows{of_probes};
  Room<std::uint32_t> of_all{*this};  // rays
  ArgArray<&RayArgs::hits_of> hits_of{of_all, one_more};
  ArgArray<&RayArgs::first_hit> first_hit{of_all, one_more};
  ArgArray<&RayArgs::placed> placed{of_all};
  ArgArray<&RayArgs::by_exact> by_exact{of_all};
  Room<std::uint32_t> of_hits{*this};
  ArgArray<&RayArgs::listed> listed{of_hits};
  ArgArray<&RayArgs::ordered> ordered{of_hits};
  RoomArray<RayHit> all_rows{of_hits};
  bool all = false;  // what the last call asked for

  GpuRayCapacity capacity() const {
    return {of_instances.count(), of_probes.count(), of_hits.count(), words};
  }
  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    return take_assets(given, stream);
  }
  Status reserve(const GpuRayCapacity& wanted, const GpuNoOptions&) {
    Status status = reserve_probes(wanted.instances, wanted.rays, wanted.words);
    if (status != Status::kOk || wanted.hits == 0) return status;
    if (status == Status::kOk) status = keep(of_all.grow(of_probes.count()));
    return status == Status::kOk ? keep(of_hits.grow(wanted.hits, kMostProbes)) : status;
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuRayCapacity, GpuRayReport>;
template class GpuAssetQuestion<GpuRayCapacity, GpuRayReport>;

Status GpuRayQuery::enqueue(const GpuInstances& instances, const GpuRayOptions& options,
                            cudaStream_t stream) {
  if (const Status status = check_reach(options.reach); status != Status::kOk) return status;
  if (options.hits > RayHits::all) return Status::kBadOption;
  auto& host = *host_;
  const bool all = options.hits == RayHits::all;
  if (!host.has_room(instances, options.ray_count) || (all && !host.of_all.has(options.ray_count)))
    return Status::kOutOfRange;
  gpu::RayArgs args = {};
  host.fill_probes(args, instances, options.ray_count, options.looked_at);
  args.origins = options.origins;
  args.directions = options.directions;
  args.reach = options.reach;
  args.wanted = options.hits;
  args.capacity = host.capacity();
  args.rows = all ? host.all_rows.data() : host.first_rows.data();
  host.all = all;
  const auto clear = [&](const auto&, cudaStream_t on) { return host.clear_counts(on); };
  return host.keep(gpu::queue(args, stream, clear, gpu::prepare_rays, gpu::cast_rays, gpu::cast_rays_exactly,
                              gpu::order_hits));
}

Status GpuRayQuery::find(const GpuInstances& instances, const GpuRayOptions& options, cudaStream_t stream) {
  GpuRayCapacity first = {instances.count, options.ray_count, 0, capacity().words};
  if (options.hits == RayHits::all) {
    const std::uint64_t hits = std::uint64_t{gpu::kFirstHits} * std::max(options.ray_count, 1u);
    first.hits = static_cast<std::uint32_t>(std::min<std::uint64_t>(hits, gpu::kMostProbes));
  }
  return gpu::find_until_complete(
      *host_, first, GpuNoOptions{}, stream, [&] { return enqueue(instances, options, stream); },
      [](const GpuRayReport& report, GpuRayCapacity& wanted) {
        wanted = report.needed;
        return wanted.hits > gpu::kMostProbes ? Status::kTooManyPairs : Status::kOk;
      });
}

const RayHit* GpuRayQuery::rows() const {
  return host_->all ? host_->all_rows.data() : host_->first_rows.data();
}

}  // namespace tandem
