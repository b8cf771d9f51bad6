#include "tandem/kernels/gpu_distance_query.h"

#include <algorithm>
#include <cstddef>

#include "kernels/common/check_options.h"
#include "kernels/common/gpu_host.h"
#include "kernels/distance/distance_data.h"

namespace tandem::gpu {
namespace {

static_assert(most_distance_bytes({1, 0, 0, 0, 0}, 0) - most_distance_bytes({}, 0) ==
              sizeof(DistanceRecord) + sizeof(NearState) + sizeof(Narrowing) + sizeof(ObjectDistance) +
                  sizeof(std::uint32_t));
static_assert(most_distance_bytes({0, 1, 1, 1, 0}, 0) - most_distance_bytes({}, 0) ==
              2 * sizeof(BlockPairEntry) + sizeof(TrianglePairEntry) + sizeof(FrameBounds) +
                  sizeof(TrianglePairEntry) + sizeof(TriangleDistance));

static_assert(sizeof(DistanceState) <= most_distance_bytes({}, 0));

/// The room that is there before a query tells what it needs.
constexpr std::uint32_t kFirstRoom = 1u << 16;

/// The most of anything: threads that share out so many, each a step beyond its last one, still count in 32
/// bits, and a number that is too large for the report, kNoIndex, is no room.
constexpr std::uint32_t kMostRoom = kNoIndex - (1u << 24);

// Room that is too small hides what would have followed from what it has no room for.
std::uint32_t with_growth(std::uint32_t needed, std::uint32_t present) {
  if (needed <= present || needed > kMostRoom) return std::max(needed, present);
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(std::uint64_t{needed} + needed / 2, kMostRoom));
}

}  // namespace

template <>
struct HostOf<GpuDistanceReport> : GpuHost<DistanceState, GpuDistanceReport> {
  AssetList assets{*this};

  Room<std::uint32_t> of_pairs{*this};
  ArgArray<&DistanceArgs::records> records{of_pairs};
  ArgArray<&DistanceArgs::near_states> near_states{of_pairs};
  ArgArray<&DistanceArgs::narrowings> narrowings{of_pairs};
  ArgArray<&DistanceArgs::distances> distances{of_pairs};
  RoomArray<std::uint32_t> walked{of_pairs};
  Room<std::uint32_t> of_block_pairs{*this};
  RoomArray<BlockPairEntry> frontier{of_block_pairs, times<2>};  // two rounds
  Room<std::uint32_t> of_triangle_pairs{*this};
  RoomArray<TrianglePairEntry> near{of_triangle_pairs};
  ArgArray<&DistanceArgs::bounds> bounds{of_triangle_pairs};
  Room<std::uint32_t> of_settled{*this};
  RoomArray<TrianglePairEntry> rest{of_settled};
  ArgArray<&DistanceArgs::rest_distances> rest_distances{of_settled};
  std::uint32_t words = 0;

  GpuDistanceCapacity capacity() const {
    return {of_pairs.count(), of_block_pairs.count(), of_triangle_pairs.count(), of_settled.count(), words};
  }

  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    const AssetSummary all = summary_of(given);
    if (!all.axis_aligned) return Status::kNoAxisAlignedBlocks;
    const Status status = provide_fixed_memory();
    return status == Status::kOk ? assets.set(given, all, *this, stream) : status;
  }

  Status follow(const GpuAssetRecords& of_list) {
    assets.records = of_list.assets;
    return Status::kOk;
  }

  Status reserve(const GpuDistanceCapacity& wanted, const GpuNoOptions&) {
    if (std::max({wanted.pairs, wanted.block_pairs, wanted.triangle_pairs, wanted.settled}) > kMostRoom)
      return Status::kOutOfGpuMemory;
    words = std::max({words, wanted.words, kFewWords});
    Status status = keep(of_pairs.grow(wanted.pairs, kMostRoom));
    if (status == Status::kOk) status = keep(of_block_pairs.fit(wanted.block_pairs));
    if (status == Status::kOk) status = keep(of_triangle_pairs.grow(wanted.triangle_pairs, kMostRoom));
    return status == Status::kOk ? keep(of_settled.grow(wanted.settled, kMostRoom)) : status;
  }

  DistanceArgs args(const GpuInstances& instances, const GpuPairs& pairs,
                    const GpuDistanceOptions& options) const {
    DistanceState* const s = state.data();
    DistanceArgs args = {};
    fill(args, instances);
    assets.fill(args);
    args.given = pairs;
    args.tolerance = options.tolerance;
    args.reach = options.reach;
    args.reach_of_pair = options.reach_of_pair;
    args.former = options.former;
    args.capacity = capacity();
    args.walked = {walked.data(), &s->walked, of_pairs.count()};
    args.narrow = {frontier.data(), s->narrow_rounds, of_block_pairs.count()};
    args.frontier = {frontier.data(), s->rounds, of_block_pairs.count()};
    args.seeds = {near.data(), &s->seeds, of_triangle_pairs.count()};
    args.near = {near.data(), &s->near, of_triangle_pairs.count()};
    args.rest = {rest.data(), &s->rest, of_settled.count()};
    args.rounds = rounds_of(assets.all.depth, assets.all.depth);
    return args;
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuDistanceCapacity, GpuDistanceReport>;
template class GpuAssetQuestion<GpuDistanceCapacity, GpuDistanceReport>;

Status GpuDistanceQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                                 const GpuDistanceOptions& options, cudaStream_t stream) {
  const Status status = check_distance_options(options.tolerance, options.reach);
  if (status != Status::kOk) return status;
  const gpu::DistanceArgs args = host_->args(instances, pairs, options);
  cudaError_t error = cudaMemsetAsync(args.state, 0, offsetof(gpu::DistanceState, report), stream);
  if (error == cudaSuccess)
    error = gpu::queue(args, stream, gpu::prepare_distances, gpu::walk_distances, gpu::settle_distances);
  return host_->keep(error);
}

Status GpuDistanceQuery::find_distances(const GpuInstances& instances, const GpuPairs& pairs,
                                        const GpuDistanceOptions& options, cudaStream_t stream) {
  GpuDistanceCapacity first = capacity();
  first.block_pairs = std::max(first.block_pairs, gpu::kFirstRoom);
  first.triangle_pairs = std::max(first.triangle_pairs, gpu::kFirstRoom);
  first.settled = std::max(first.settled, gpu::kFirstRoom / 16);
  GpuDistanceOptions own = options;
  return gpu::find_until_complete(
      *host_, first, GpuNoOptions{}, stream, [&] { return enqueue(instances, pairs, own, stream); },
      [&](const GpuDistanceReport& report, GpuDistanceCapacity& wanted) {
        const GpuDistanceCapacity &needed = report.needed, present = capacity();
        if (needed.pairs > pairs.capacity) return Status::kOutOfRange;
        // The rows of the step before are lost, and these are of a query that was not complete.
        if (own.former == distances()) own.former = nullptr;
        wanted = {needed.pairs, gpu::with_growth(needed.block_pairs, present.block_pairs),
                  gpu::with_growth(needed.triangle_pairs, present.triangle_pairs),
                  gpu::with_growth(needed.settled, present.settled), needed.words};
        return Status::kOk;
      });
}

const ObjectDistance* GpuDistanceQuery::distances() const {
  return host_->distances.data();
}

}  // namespace tandem
