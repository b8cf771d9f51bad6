#include "tandem/kernels/gpu_probe_query.h"

#include "kernels/common/check_options.h"
#include "kernels/common/gpu_host.h"
#include "kernels/common/surface_labels.h"
#include "kernels/points_and_rays/probe_data.h"

namespace tandem::gpu {
namespace {

/// More probes cannot be numbered together with where they are sorted to.
constexpr std::uint32_t kMostProbes = kNoIndex - 1;

/// The hits that there is room for before a query tells how many there are, for each ray.
constexpr std::uint32_t kFirstHits = 2;

constexpr std::uint64_t one_more(std::uint64_t count) {
  return count + 1;
}

// These tell what a question is about.
std::uint32_t probes_in(const GpuClosestOptions& options) {
  return options.point_count;
}
std::uint32_t probes_in(const GpuRayOptions& options) {
  return options.ray_count;
}
bool asks_for_all_hits(const GpuClosestOptions&) {
  return false;
}
bool asks_for_all_hits(const GpuRayOptions& options) {
  return options.hits == RayHits::all;
}

// Returns whether triangles have to be told apart by their components.
bool is_labelled(const GpuAsset& asset) {
  return asset.tree.topology != nullptr && !asset.tree.closed && asset.tree.component_count > 1;
}

// The last step before the report.
cudaError_t complete(const PointArgs& args, cudaStream_t stream) {
  return find_sides(args, stream);
}
cudaError_t complete(const RayArgs& args, cudaStream_t stream) {
  return order_hits(args, stream);
}

}  // namespace

template <>
struct HostOf<GpuProbeReport> : GpuHost<ProbeState, GpuProbeReport> {
  AssetList assets{*this};
  ArgArray<&ProbeArgs::surfaces> surfaces{*this};
  RoomArray<std::uint32_t> labels{*this};
  Room<std::uint32_t> of_instances{*this};
  ArgArray<&ProbeArgs::bodies> bodies{of_instances};
  ArgArray<&ProbeArgs::boxes> boxes{of_instances};
  ArgArray<&ProbeArgs::groups> groups{of_instances, groups_of};
  ArgArray<&ProbeArgs::body_keys> body_keys{of_instances, times<2>};
  ArgArray<&ProbeArgs::body_numbers> body_numbers{of_instances, times<2>};
  Room<std::uint32_t> of_probes{*this};
  ArgArray<&ProbeArgs::probe_keys> probe_keys{of_probes, times<2>};
  ArgArray<&ProbeArgs::probe_numbers> probe_numbers{of_probes, times<2>};
  ArgArray<&ProbeArgs::hard> hard{of_probes};
  RoomArray<ProbeRow> rows{of_probes};
  ArgArray<&ProbeArgs::scratch> scratch{*this};

  // These are for all hits of rays alone.
  Room<std::uint32_t> of_all{*this};  // rays
  ArgArray<&ProbeArgs::hits_of> hits_of{of_all, one_more};
  ArgArray<&ProbeArgs::first_hit> first_hit{of_all, one_more};
  ArgArray<&ProbeArgs::placed> placed{of_all};
  ArgArray<&ProbeArgs::by_exact> by_exact{of_all};
  Room<std::uint32_t> of_hits{*this};
  ArgArray<&ProbeArgs::listed> listed{of_hits};
  ArgArray<&ProbeArgs::ordered> ordered{of_hits};
  RoomArray<RayHit> all_rows{of_hits};

  std::uint32_t words = 0;
  bool all = false;  // whether the last call asked for all hits

  GpuProbeCapacity capacity() const {
    return {of_instances.count(), of_probes.count(), of_hits.count(), words};
  }

  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    const AssetSummary summary = summary_of(given);
    if (!summary.axis_aligned) return Status::kNoAxisAlignedBlocks;
    Status status = provide_fixed_memory();
    if (status == Status::kOk) status = assets.set(given, summary, *this, stream);
    return status == Status::kOk ? make_surfaces(given, stream) : status;
  }

  Status follow(const GpuAssetRecords& of_list) {
    assets.records = of_list.assets;
    return Status::kOk;
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

  Status reserve(const GpuProbeCapacity& wanted, const GpuNoOptions&) {
    if (wanted.instances > kMostProbes || wanted.probes > kMostProbes) return Status::kOutOfGpuMemory;
    words = std::max({words, wanted.words, kFewWords});
    Status status = reserve_probes(wanted.instances, wanted.probes);
    if (status != Status::kOk || wanted.hits == 0) return status;
    status = keep(of_all.grow(of_probes.count()));
    return status == Status::kOk ? keep(of_hits.grow(wanted.hits, kMostProbes)) : status;
  }

  Status reserve_probes(std::uint32_t instances, std::uint32_t probes) {
    if (of_instances.has(instances) && of_probes.has(probes) && scratch.data() != nullptr) return Status::kOk;
    scratch.free();
    Status status = keep(of_instances.grow(instances, kMostProbes));
    if (status == Status::kOk) status = keep(of_probes.grow(probes, kMostProbes));
    std::size_t bytes = 0;
    if (status == Status::kOk)
      status = keep(probe_scratch_bytes(of_instances.count(), of_probes.count(), bytes));
    return status == Status::kOk ? keep(scratch.reserve(bytes + 1)) : status;
  }

  // Returns why a question with these options cannot be queued.
  Status refusal(const GpuClosestOptions& options) const {
    const Status status = check_distance_options(options.tolerance, options.reach);
    return status == Status::kOk && options.sides && !assets.all.topology ? Status::kNoTopology : status;
  }
  Status refusal(const GpuRayOptions& options) const {
    const Status status = check_reach(options.reach);
    return status == Status::kOk && options.hits > RayHits::all ? Status::kBadOption : status;
  }

  template <typename Options>
  AskedArgs<Options> args_for(const GpuInstances& instances, const Options& options) const {
    AskedArgs<Options> args = {};
    ProbeArgs& shared = args;
    fill(shared, instances);
    assets.fill(shared);
    args.probe_count = probes_in(options);
    args.capacity = capacity();
    args.counts = &state.data()->counts;
    args.scratch_bytes = scratch.bytes();
    set_levels(args);
    args.asked = options;
    args.rows = rows_of<typename Options::Row>();
    return args;
  }

  template <typename Options>
  Status enqueue(const GpuInstances& instances, const Options& options, cudaStream_t stream) {
    if (const Status status = refusal(options); status != Status::kOk) return status;
    const std::uint32_t probes = probes_in(options);
    if (!of_instances.has(instances.count) || !of_probes.has(probes)) return Status::kOutOfRange;
    if (asks_for_all_hits(options) && !of_all.has(probes)) return Status::kOutOfRange;
    all = asks_for_all_hits(options);
    const auto clear = [](const ProbeArgs& args, cudaStream_t on) {
      return cudaMemsetAsync(args.counts, 0, sizeof(ProbeCounts), on);
    };
    const auto answer_exactly = [](const AskedArgs<Options>& args, cudaStream_t on) {
      return with_words(args, [&](auto count) { return answer_by_words<count>(args, on); });
    };
    const auto end = [&](const AskedArgs<Options>& args, cudaStream_t on) {
      const cudaError_t result = complete(args, on);
      return result == cudaSuccess ? report_probes(args, all ? kNoIndex : probes, on) : result;
    };
    return keep(queue(args_for(instances, options), stream, clear, prepare_probes<Options>,
                      answer_probes<Options>, answer_exactly, end));
  }

  template <typename Options>
  Status find(const GpuInstances& instances, const Options& options, cudaStream_t stream) {
    GpuProbeCapacity first = {instances.count, probes_in(options), 0, words};
    if (asks_for_all_hits(options)) {
      const std::uint64_t hits = std::uint64_t{kFirstHits} * std::max(first.probes, 1u);
      first.hits = static_cast<std::uint32_t>(std::min<std::uint64_t>(hits, kMostProbes));
    }
    return find_until_complete(
        *this, first, GpuNoOptions{}, stream, [&] { return enqueue(instances, options, stream); },
        [](const GpuProbeReport& told, GpuProbeCapacity& wanted) {
          wanted = told.needed;
          return wanted.hits > kMostProbes ? Status::kTooManyPairs : Status::kOk;
        });
  }

  // The rows of the last call. Each question has the room of the larger row.
  template <typename Row>
  Row* rows_of() const {
    if constexpr (std::is_same_v<Row, RayHit>) {
      if (all) return all_rows.data();
    }
    return reinterpret_cast<Row*>(rows.data());
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuProbeCapacity, GpuProbeReport>;
template class GpuAssetQuestion<GpuProbeCapacity, GpuProbeReport>;

Status GpuProbeQuery::enqueue(const GpuInstances& instances, const GpuClosestOptions& options,
                              cudaStream_t stream) {
  return host_->enqueue(instances, options, stream);
}

Status GpuProbeQuery::enqueue(const GpuInstances& instances, const GpuRayOptions& options,
                              cudaStream_t stream) {
  return host_->enqueue(instances, options, stream);
}

Status GpuProbeQuery::find(const GpuInstances& instances, const GpuClosestOptions& options,
                           cudaStream_t stream) {
  return host_->find(instances, options, stream);
}

Status GpuProbeQuery::find(const GpuInstances& instances, const GpuRayOptions& options, cudaStream_t stream) {
  return host_->find(instances, options, stream);
}

const ClosestPoint* GpuProbeQuery::closest() const {
  return host_->rows_of<ClosestPoint>();
}

const RayHit* GpuProbeQuery::hits() const {
  return host_->rows_of<RayHit>();
}

}  // namespace tandem
