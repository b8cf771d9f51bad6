#include "tandem/kernels/gpu_impact_query.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "kernels/common/check_options.h"
#include "kernels/common/gpu_host.h"
#include "kernels/impact/impact_data.h"

namespace tandem::gpu {
namespace {

// Parts are numbered in keys of 32 bits beside their number in the piece.
constexpr std::uint32_t kMostParts = (1u << 25) - 1;

// Poses of pairs are numbered in 32 bits too.
constexpr std::uint32_t kMostPairs = (kNoIndex - 1 - kFewestImpactSamples) / kImpactSamplesPerPair;

// Trees with fewer levels have few block pairs whatever is looked for.
constexpr std::uint32_t kFewestLevelsToSample = 4;

// most_impact_bytes() counts with these; a hash table has fewer than four places for each part.
static_assert(sizeof(impact::MovingBody) + sizeof(WorldBox) == 272);
static_assert(sizeof(ImpactPair) + sizeof(Impact) + 3 * sizeof(double) + 2 * sizeof(std::uint32_t) == 240);
static_assert(sizeof(PairRecord) + 2 * sizeof(std::uint32_t) == 168);
static_assert(sizeof(ImpactPart) + 4 * 2 * sizeof(std::uint32_t) == 656);
static_assert(2 * sizeof(ImpactBlockPair) == 48);
static_assert(sizeof(ImpactTrianglePair) + sizeof(AdvancedPair) == 56);

std::uint64_t samples_of(std::uint64_t pairs) {
  return kImpactSamplesPerPair * pairs + kFewestImpactSamples;
}
std::uint64_t keys_of(std::uint64_t parts) {
  return std::bit_ceil(2 * parts);
}

}  // namespace

template <>
struct HostOf<GpuImpactReport> : GpuHost<ImpactState, GpuImpactReport> {
  AssetList assets{*this};
  GpuBroadPhase broad_phase;
  GpuContactQuery contacts;  // at the start

  Room<std::uint32_t> of_instances{*this};
  ArgArray<&ImpactArgs::bodies> bodies{of_instances};
  ArgArray<&ImpactArgs::boxes> boxes{of_instances};

  Room<std::uint32_t> of_pairs{*this};
  ArgArray<&ImpactArgs::pairs> pairs{of_pairs};
  ArgArray<&ImpactArgs::sought> sought{of_pairs};
  ArgArray<&ImpactArgs::stops> stops{of_pairs};
  ArgArray<&ImpactArgs::triangles> triangles{of_pairs};
  ArgArray<&ImpactArgs::impacts> impacts{of_pairs};
  ArgArray<&ImpactArgs::is_sampled> is_sampled{of_pairs};
  ArgArray<&ImpactArgs::sampled_pairs> sampled_pairs{of_pairs};
  RoomArray<std::uint32_t> met{of_pairs, [](std::uint64_t count) { return 2 * samples_of(count); }};
  ArgArray<&ImpactArgs::samples> samples{of_pairs, samples_of};

  Room<std::uint32_t> of_parts{*this};
  ArgArray<&ImpactArgs::parts> parts{of_parts};
  ArgArray<&ImpactArgs::part_keys> part_keys{of_parts, keys_of};
  ArgArray<&ImpactArgs::part_of_key> part_of_key{of_parts, keys_of};
  Room<std::uint32_t> of_block_pairs{*this};
  RoomArray<ImpactBlockPair> block_pairs{of_block_pairs, times<2>};  // two rounds
  Room<std::uint32_t> of_triangle_pairs{*this};
  RoomArray<ImpactTrianglePair> triangle_pairs{of_triangle_pairs};
  RoomArray<AdvancedPair> advanced{of_triangle_pairs};

  RoomArray<QueryState> walk_state{*this};  // of the walk of samples
  RoomArray<Chunk> chunks{*this};

  std::size_t bytes() const { return Memory::bytes() + broad_phase.bytes() + contacts.bytes(); }
  GpuImpactCapacity capacity() const {
    const GpuContactCapacity at_start = contacts.capacity();
    return {of_instances.count(), of_pairs.count(),       at_start.contacts,        at_start.undecided,
            of_parts.count(),     of_block_pairs.count(), of_triangle_pairs.count()};
  }
  std::uint32_t most_samples() const { return static_cast<std::uint32_t>(samples.room()); }

  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    const AssetSummary all = summary_of(given);
    if (!all.axis_aligned) return Status::kNoAxisAlignedBlocks;
    if (!all.oriented) return Status::kNoOrientedBlocks;
    assets.count = 0;
    Status status = provide_fixed_memory([&] {
      Status made = keep(walk_state.reserve(1));
      if (made == Status::kOk) made = keep(chunks.reserve(most_mailboxes(limits)));
      return made == Status::kOk ? keep(cudaMemsetAsync(chunks.data(), 0, chunks.bytes(), stream)) : made;
    });
    if (status == Status::kOk) status = keep(contacts.set_assets(given, stream), contacts);
    return status == Status::kOk ? assets.set(given, all, *this, stream) : status;
  }

  Status follow(const GpuAssetRecords& of_list) {
    if (of_list.positions != PositionTypes::float32) return Status::kNotFloat32;
    assets.records = of_list.assets;
    return keep(contacts.follow(of_list), contacts);
  }

  // There is always a part, which lanes without a block pair may look at.
  Status reserve(const GpuImpactCapacity& wanted, const GpuImpactOptions& options) {
    if (wanted.pairs > kMostPairs) return Status::kOutOfGpuMemory;
    if (wanted.parts > kMostParts) return Status::kOutOfRange;
    Status status = keep(of_instances.grow(wanted.instances));
    if (status == Status::kOk) status = keep(of_pairs.grow(wanted.pairs, kMostPairs));
    if (status == Status::kOk) status = keep(of_parts.grow(std::max(wanted.parts, 1u), kMostParts));
    if (status == Status::kOk) status = keep(of_block_pairs.grow(wanted.block_pairs));
    if (status == Status::kOk) status = keep(of_triangle_pairs.grow(wanted.triangle_pairs));
    if (status == Status::kOk) {
      status = keep(broad_phase.reserve({of_instances.count(), of_pairs.count()}, {.sorted = options.sorted}),
                    broad_phase);
    }
    if (status != Status::kOk) return status;
    return keep(contacts.reserve({of_pairs.count(), wanted.contacts, wanted.undecided}), contacts);
  }

  ImpactArgs args(const GpuInstances& instances, const RigidMotion* motion, double duration,
                  const GpuPairs& given, const GpuImpactOptions& options) {
    ImpactArgs args = {};
    fill(args, instances);
    assets.fill(args);
    args.motion = motion;
    args.duration = duration;
    args.tolerance = options.tolerance;
    args.given = given;
    args.capacity = capacity();
    args.query = contacts.device_report();
    args.contacts = contacts.contacts();
    args.most_keys = static_cast<std::uint32_t>(part_keys.room());
    args.frontier = {block_pairs.data(), state->waiting, of_block_pairs.count()};
    args.triangle_pairs = {triangle_pairs.data(), &state->triangle_pairs, of_triangle_pairs.count()};
    args.advanced = {advanced.data(), &state->advanced, of_triangle_pairs.count()};
    args.met[0] = met.data();
    args.met[1] = met.data() + most_samples();
    args.most_samples = most_samples();
    return args;
  }

  // A walk that only marks which samples have a contact that float32 is sure of.
  QueryArgs sample_args(const ImpactArgs& args, std::uint32_t which, std::uint32_t most_blocks) const {
    QueryArgs walk = {};
    walk.assets = args.assets;
    walk.asset_count = args.asset_count;
    walk.instances = args.instances;
    walk.given = {nullptr, &args.state->samples, args.most_samples};
    walk.mode = QueryMode::exact;
    walk.first_contact_only = true;
    walk.capacity.pairs = args.most_samples;
    walk.state = walk_state.data();
    walk.chunks = chunks.data();
    walk.pairs = args.samples;
    walk.met = args.met[which];
    walk.limits = limits;
    walk.shape = walk_shape(limits, assets.all.depth, most_blocks);
    return walk;
  }

  cudaError_t clear(const ImpactArgs& args, cudaStream_t stream) {
    cudaError_t result = cudaMemsetAsync(args.state, 0, sizeof(ImpactState), stream);
    if (result == cudaSuccess) result = cudaMemsetAsync(args.part_keys, 0xFF, part_keys.bytes(), stream);
    if (result == cudaSuccess && triangles.bytes() != 0)
      result = cudaMemsetAsync(args.triangles, 0xFF, triangles.bytes(), stream);
    return result;
  }

  cudaError_t end_at_samples(const ImpactArgs& args, std::uint32_t most_blocks, cudaStream_t stream) {
    cudaError_t result = list_sampled_pairs(args, stream);
    for (std::uint32_t which = 0; which < 2 && result == cudaSuccess; ++which) {
      result = cudaMemsetAsync(walk_state.data(), 0, sizeof(QueryState), stream);
      if (result == cudaSuccess) result = pose_samples(args, which, stream);
      if (result == cudaSuccess) result = walk_exact(sample_args(args, which, most_blocks), stream);
    }
    return result == cudaSuccess ? gpu::end_at_samples(args, stream) : result;
  }

  cudaError_t walk(const ImpactArgs& args, std::uint32_t most_blocks, cudaStream_t stream) {
    const std::uint32_t depth = assets.all.depth, rounds = impact_rounds_of(depth);
    cudaError_t result = begin_impacts(args, stream);
    std::uint32_t first = 0;
    if (result == cudaSuccess && depth >= kFewestLevelsToSample) {
      first = kSampledRound;
      result = walk_impacts(args, 0, first, stream);
      if (result == cudaSuccess) result = end_at_samples(args, most_blocks, stream);
    }
    if (result == cudaSuccess) result = walk_impacts(args, first, rounds, stream);
    return result == cudaSuccess ? queue(args, stream, advance_impacts, write_impacts) : result;
  }

  // args.given: null where the pairs are to be found.
  Status enqueue(const ImpactArgs& given, const GpuImpactOptions& options, cudaStream_t stream) {
    ImpactArgs args = given;
    Status status = check_impact_options(args.duration, args.tolerance);
    if (status != Status::kOk) return status;
    if (args.instances.count > of_instances.count()) return Status::kOutOfRange;
    status = keep(clear(args, stream));
    if (status == Status::kOk) status = keep(move_bodies(args, stream));
    if (status == Status::kOk && args.given.count == nullptr) {
      status = broad_phase.enqueue(boxes.data(), args.instances.count,
                                   {.sorted = options.sorted, .filter = options.filter}, stream);
      args.given = broad_phase.pairs();
      args.broad_phase = broad_phase.device_report();
    }
    if (status == Status::kOk)
      status = contacts.enqueue(args.instances, args.given, {.most_blocks = options.most_blocks}, stream);
    return status == Status::kOk ? keep(walk(args, options.most_blocks, stream)) : status;
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuImpactCapacity, GpuImpactReport, GpuImpactOptions>;
template class GpuAssetQuestion<GpuImpactCapacity, GpuImpactReport, GpuImpactOptions>;

Status GpuImpactQuery::enqueue(const GpuInstances& instances, const RigidMotion* motion, double duration,
                               const GpuImpactOptions& options, cudaStream_t stream) {
  return enqueue(instances, motion, duration, GpuPairs{}, options, stream);
}

Status GpuImpactQuery::enqueue(const GpuInstances& instances, const RigidMotion* motion, double duration,
                               const GpuPairs& pairs, const GpuImpactOptions& options, cudaStream_t stream) {
  return host_->enqueue(host_->args(instances, motion, duration, pairs, options), options, stream);
}

Status GpuImpactQuery::find(const GpuInstances& instances, const RigidMotion* motion, double duration,
                            const GpuImpactOptions& options, cudaStream_t stream) {
  return find(instances, motion, duration, GpuPairs{}, options, stream);
}

Status GpuImpactQuery::find(const GpuInstances& instances, const RigidMotion* motion, double duration,
                            const GpuPairs& pairs, const GpuImpactOptions& options, cudaStream_t stream) {
  const bool given = pairs.count != nullptr;
  GpuImpactCapacity first = capacity();
  first.instances = std::max(first.instances, instances.count);
  if (given) first.pairs = std::max(first.pairs, pairs.capacity);
  return gpu::find_until_complete(
      *host_, first, options, stream,
      [&] { return enqueue(instances, motion, duration, pairs, options, stream); },
      [&](const GpuImpactReport& report, GpuImpactCapacity& wanted) {
        wanted = report.needed;
        if (given && wanted.pairs > pairs.capacity) return Status::kOutOfRange;
        return wanted.pairs == kNoIndex ? Status::kTooManyPairs : Status::kOk;
      });
}

GpuPairs GpuImpactQuery::pairs() const {
  return host_->broad_phase.pairs();
}

const Impact* GpuImpactQuery::impacts() const {
  return host_->impacts.data();
}

}  // namespace tandem
