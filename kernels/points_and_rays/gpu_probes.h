#pragma once
#include "kernels/common/gpu_host.h"
#include "kernels/points_and_rays/probe_data.h"

namespace tandem::gpu {

/// More probes cannot be numbered together with where they are sorted to.
inline constexpr std::uint32_t kMostProbes = kNoIndex - 1;

/// The CPU's side of what the questions about points and rays share.
template <typename Report>
struct ProbeHost : GpuHost<ProbeState<Report>, Report> {
  using Base = GpuHost<ProbeState<Report>, Report>;
  using Base::keep;

  AssetList assets{*this};
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
  ArgArray<&ProbeArgs::scratch> scratch{*this};
  std::uint32_t words = 0;

  Status take_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    const AssetSummary all = summary_of(given);
    if (!all.axis_aligned) return Status::kNoAxisAlignedBlocks;
    const Status status = this->provide_fixed_memory();
    return status == Status::kOk ? assets.set(given, all, *this, stream) : status;
  }

  Status follow(const GpuAssetRecords& of_list) {
    assets.records = of_list.assets;
    return Status::kOk;
  }

  Status reserve_probes(std::uint32_t instances, std::uint32_t probes, std::uint32_t wanted_words) {
    if (instances > kMostProbes || probes > kMostProbes) return Status::kOutOfGpuMemory;
    words = std::max({words, wanted_words, kFewWords});
    if (of_instances.has(instances) && of_probes.has(probes) && scratch.data() != nullptr) return Status::kOk;
    scratch.free();
    Status status = keep(of_instances.grow(instances, kMostProbes));
    if (status == Status::kOk) status = keep(of_probes.grow(probes, kMostProbes));
    std::size_t bytes = 0;
    if (status == Status::kOk)
      status = keep(probe_scratch_bytes(of_instances.count(), of_probes.count(), bytes));
    return status == Status::kOk ? keep(scratch.reserve(bytes + 1)) : status;
  }

  bool has_room(const GpuInstances& instances, std::uint32_t probes) const {
    return of_instances.has(instances.count) && of_probes.has(probes);
  }

  template <typename Args>
  void fill_probes(Args& args, const GpuInstances& instances, std::uint32_t probes,
                   const std::uint8_t* looked_at) const {
    this->fill(args, instances);
    assets.fill(args);
    args.probe_count = probes;
    args.looked_at = looked_at;
    args.counts = &this->state.data()->counts;
    args.scratch_bytes = scratch.bytes();
    set_levels(args);
  }

  cudaError_t clear_counts(cudaStream_t stream) const {
    return cudaMemsetAsync(&this->state.data()->counts, 0, sizeof(ProbeCounts), stream);
  }
};

}  // namespace tandem::gpu
