#include "tandem/kernels/gpu_tolerance_query.h"

#include <algorithm>

#include "kernels/common/check_options.h"
#include "kernels/common/gpu_host.h"
#include "kernels/contact/gpu_query_data.h"
#include "kernels/tolerance/tolerance_data.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem::gpu {
namespace {

static_assert(sizeof(ToleranceState) <=
              most_tolerance_bytes({}, 0) - most_query_bytes({}, kToleranceOptions, 0));
static_assert(sizeof(PairVerdict) == 3);
static_assert(sizeof(levels::LevelRange) == 8);

// Returns whether two levels in a row of a list are of one asset, the one behind the other.
bool follows(const GpuAsset& finer, const GpuAsset& coarser) {
  return coarser.tree.number == finer.tree.number + 1 && coarser.source_faces == finer.source_faces &&
         std::equal(coarser.origin, coarser.origin + 3, finer.origin) &&
         std::equal(coarser.lower, coarser.lower + 3, finer.lower) &&
         std::equal(coarser.upper, coarser.upper + 3, finer.upper);
}

}  // namespace

template <>
struct HostOf<GpuToleranceReport> : GpuHost<ToleranceState, GpuToleranceReport> {
  GpuContactQuery contacts;  // of which each level is an asset
  ArgArray<&ToleranceArgs::levels> levels{*this};
  ArgArray<&ToleranceArgs::assets> assets{*this};
  std::uint32_t asset_count = 0;

  Room<std::uint32_t> of_instances{*this};
  ArgArray<&ToleranceArgs::level> level{of_instances};
  ArgArray<&ToleranceArgs::asset> asset{of_instances};
  Room<std::uint32_t> of_pairs{*this};
  ArgArray<&ToleranceArgs::verdicts> verdicts{of_pairs};

  std::size_t bytes() const { return Memory::bytes() + contacts.bytes(); }
  GpuToleranceCapacity capacity() const {
    return {of_instances.count(), of_pairs.count(), contacts.capacity().undecided};
  }

  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    Buffer<levels::LevelRange> ranges;
    std::uint32_t most = 1;
    for (std::size_t i = 0; i < given.size(); ++i) {
      if (given[i].tree.oriented_blocks == nullptr) return Status::kNoOrientedBlocks;
      const bool begins = given[i].tree.number == 0;
      if (!begins && (i == 0 || !follows(given[i - 1], given[i]))) return Status::kNoFinestLevel;
      if (begins && !ranges.push({static_cast<std::uint32_t>(i), 0})) return Status::kOutOfMemory;
      most = std::max(most, ++ranges[ranges.size() - 1].count);
    }
    if (most > kMaxLevels) return Status::kOutOfRange;
    asset_count = 0;
    Status status = provide_fixed_memory();
    if (status == Status::kOk) status = keep(contacts.set_assets(given, stream), contacts);
    if (status == Status::kOk) status = keep(levels.upload(given, stream));
    if (status == Status::kOk) status = keep(assets.upload(ranges.view(), stream));
    if (status == Status::kOk) status = keep(cudaStreamSynchronize(stream));
    if (status != Status::kOk) return status;
    asset_count = static_cast<std::uint32_t>(ranges.size());
    return Status::kOk;
  }

  Status follow(const GpuAssetRecords& of_list) {
    return of_list.assets == nullptr ? Status::kOk : Status::kDeformed;
  }

  // There is room for as many pairs as the contact query has room for.
  Status reserve(const GpuToleranceCapacity& wanted, const GpuNoOptions&) {
    const GpuContactCapacity of_contacts = {wanted.pairs, wanted.pairs, wanted.undecided};
    Status status = keep(of_instances.grow(wanted.instances));
    if (status == Status::kOk) status = keep(contacts.reserve(of_contacts, kToleranceOptions), contacts);
    if (status != Status::kOk) return status;
    const GpuContactCapacity room = contacts.capacity();
    return keep(of_pairs.fit(static_cast<std::uint32_t>(std::min<std::uint64_t>(room.pairs, room.contacts))));
  }

  ToleranceArgs args(const GpuInstances& instances, const GpuPairs& pairs, double tolerance) const {
    ToleranceArgs args = {};
    fill(args, instances);
    args.asset_count = asset_count;
    args.given = pairs;
    args.tolerance = tolerance;
    args.pair_capacity = of_pairs.count();
    args.met = contacts.met();
    args.query = contacts.device_report();
    return args;
  }

  Status enqueue(const ToleranceArgs& args, cudaStream_t stream) {
    const GpuInstances posed = {args.asset, args.instances.pose, args.instances.count};
    GpuContactOptions options = kToleranceOptions;
    options.add_error_bounds = args.tolerance > 0;  // else all stand for their finest levels
    Status status = keep(choose_levels(args, stream));
    if (status == Status::kOk) status = keep(contacts.enqueue(posed, args.given, options, stream), contacts);
    return status == Status::kOk ? keep(judge_pairs(args, stream)) : status;
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuToleranceCapacity, GpuToleranceReport>;
template class GpuAssetQuestion<GpuToleranceCapacity, GpuToleranceReport>;

Status GpuToleranceQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs, double tolerance,
                                  cudaStream_t stream) {
  if (const Status status = check_level_tolerance(tolerance); status != Status::kOk) return status;
  if (instances.count > host_->of_instances.count()) return Status::kOutOfRange;
  return host_->enqueue(host_->args(instances, pairs, tolerance), stream);
}

Status GpuToleranceQuery::decide(const GpuInstances& instances, const GpuPairs& pairs, double tolerance,
                                 cudaStream_t stream) {
  GpuToleranceCapacity first = capacity();
  first.instances = std::max(first.instances, instances.count);
  return gpu::find_until_complete(
      *host_, first, GpuNoOptions{}, stream, [&] { return enqueue(instances, pairs, tolerance, stream); },
      [&](const GpuToleranceReport& report, GpuToleranceCapacity& wanted) {
        wanted = report.needed;
        wanted.undecided = gpu::with_spare(wanted.undecided);
        return wanted.pairs > pairs.capacity ? Status::kOutOfRange : Status::kOk;
      });
}

const PairVerdict* GpuToleranceQuery::verdicts() const {
  return host_->verdicts.data();
}

}  // namespace tandem
