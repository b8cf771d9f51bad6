#include "tandem/kernels/gpu_impact_query.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <new>

#include "kernels/impact/impact_data.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

// Parts are numbered in keys of 32 bits beside their number in the piece.
constexpr std::uint32_t kMostParts = (1u << 25) - 1;

// Trees with fewer levels have few block pairs whatever is looked for.
constexpr std::uint32_t kFewestLevelsToSample = 4;

// What most_impact_bytes() counts with; a hash table has fewer than four places for each part.
static_assert(sizeof(impact::MovingBody) + sizeof(WorldBox) == 264);
static_assert(sizeof(gpu::ImpactPair) + sizeof(Impact) + 3 * sizeof(double) + 2 * sizeof(std::uint32_t) ==
              240);
static_assert(sizeof(gpu::PairRecord) + 2 * sizeof(std::uint32_t) == 168);
static_assert(sizeof(gpu::ImpactPart) + 4 * 2 * sizeof(std::uint32_t) == 656);
static_assert(2 * sizeof(gpu::ImpactBlockPair) == 48);
static_assert(sizeof(gpu::ImpactTrianglePair) + sizeof(gpu::AdvancedPair) == 56);

template <typename Number>
Number grown(Number wanted, Number present) {
  return wanted <= present ? present : std::max(wanted, present + present / 2);
}

GpuImpactCapacity larger(const GpuImpactCapacity& x, const GpuImpactCapacity& y) {
  return {std::max(x.instances, y.instances),
          std::max(x.pairs, y.pairs),
          std::max(x.contacts, y.contacts),
          std::max(x.undecided, y.undecided),
          std::max(x.parts, y.parts),
          std::max(x.block_pairs, y.block_pairs),
          std::max(x.triangle_pairs, y.triangle_pairs)};
}

}  // namespace

struct GpuImpactQuery::State {
  GpuArray<GpuAsset> assets;
  std::uint32_t asset_count = 0, depth = 1;
  gpu::DeviceLimits limits = {};
  GpuArray<gpu::ImpactState> state;
  PinnedArray<GpuImpactReport> report;
  GpuBroadPhase broad_phase;
  GpuContactQuery contacts;  // at the start

  GpuArray<impact::MovingBody> bodies;
  GpuArray<WorldBox> boxes;
  GpuArray<gpu::ImpactPair> pairs;
  GpuArray<double> sought;
  GpuArray<gpu::Counter> stops, triangles;
  GpuArray<Impact> impacts;
  GpuArray<gpu::ImpactPart> parts;
  GpuArray<std::uint32_t> part_keys, part_of_key;
  GpuArray<gpu::ImpactBlockPair> block_pairs;
  GpuArray<gpu::ImpactTrianglePair> triangle_pairs;
  GpuArray<gpu::AdvancedPair> advanced;

  GpuArray<std::uint32_t> is_sampled, sampled_pairs, met;
  GpuArray<gpu::PairRecord> samples;
  GpuArray<gpu::QueryState> walk_state;  // of the walk of samples
  GpuArray<gpu::Chunk> chunks;

  GpuImpactCapacity capacity;
  cudaError_t error = cudaSuccess;

  // Keeps what CUDA says of a call.
  Status keep(cudaError_t result) {
    error = result;
    if (result != cudaSuccess) static_cast<void>(cudaGetLastError());  // later calls must not report it again
    return status_of(result);
  }
  template <typename... Arrays>
  Status reserve_all(std::size_t count, Arrays&... arrays) {
    Status status = Status::kOk;
    const auto reserve_one = [&](auto& array) {
      if (status == Status::kOk) status = keep(array.reserve(count));
    };
    (reserve_one(arrays), ...);
    return status;
  }

  std::uint32_t most_samples() const { return static_cast<std::uint32_t>(samples.room()); }
  Status provide_fixed_memory(cudaStream_t stream);
  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream);
  Status reserve_instances(std::uint32_t wanted);
  Status reserve_pairs(std::uint32_t wanted);
  Status reserve_parts(std::uint32_t wanted);
  Status reserve_block_pairs(std::uint32_t wanted);
  Status reserve_triangle_pairs(std::uint32_t wanted);
  Status reserve(const GpuImpactCapacity& wanted, const GpuImpactOptions& options);

  gpu::ImpactArgs args(const GpuInstances& instances, const RigidMotion* motion, double duration,
                       const GpuPairs& given, const GpuImpactOptions& options);
  gpu::QueryArgs sample_args(const gpu::ImpactArgs& args, std::uint32_t which,
                             std::uint32_t most_blocks) const;
  cudaError_t clear(const gpu::ImpactArgs& args, cudaStream_t stream);
  cudaError_t end_at_samples(const gpu::ImpactArgs& args, std::uint32_t most_blocks, cudaStream_t stream);
  cudaError_t walk(const gpu::ImpactArgs& args, std::uint32_t most_blocks, cudaStream_t stream);
  Status enqueue(const gpu::ImpactArgs& args, const GpuImpactOptions& options, cudaStream_t stream);
};

Status GpuImpactQuery::State::provide_fixed_memory(cudaStream_t stream) {
  if (report.data() != nullptr) return Status::kOk;
  Status status = keep(gpu::limits_of_device(limits));
  if (status == Status::kOk) status = reserve_all(1, state, walk_state);
  if (status == Status::kOk) status = keep(chunks.reserve(gpu::most_mailboxes(limits)));
  if (status == Status::kOk) status = keep(cudaMemsetAsync(chunks.data(), 0, chunks.bytes(), stream));
  if (status != Status::kOk) return status;
  status = keep(report.reserve(1));
  if (status == Status::kOk) *report = {};
  return status == Status::kOutOfGpuMemory ? Status::kOutOfMemory : status;
}

Status GpuImpactQuery::State::set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
  std::uint32_t deepest = 1;
  for (const GpuAsset& asset : given) {
    if (asset.tree.blocks == nullptr) return Status::kNoAxisAlignedBlocks;
    if (asset.tree.oriented_blocks == nullptr) return Status::kNoOrientedBlocks;
    deepest = std::max(deepest, asset.tree.depth);
  }
  asset_count = 0;
  Status status = provide_fixed_memory(stream);
  if (status == Status::kOk) status = contacts.set_assets(given, stream);
  if (status == Status::kOk) status = keep(assets.upload(given, stream));
  if (status == Status::kOk) status = keep(cudaStreamSynchronize(stream));
  if (status != Status::kOk) return status;
  asset_count = static_cast<std::uint32_t>(given.size());
  depth = deepest;
  return Status::kOk;
}

Status GpuImpactQuery::State::reserve_instances(std::uint32_t wanted) {
  if (wanted <= capacity.instances) return Status::kOk;
  const std::uint32_t count = grown(wanted, capacity.instances);
  capacity.instances = 0;
  const Status status = reserve_all(count, bodies, boxes);
  if (status == Status::kOk) capacity.instances = count;
  return status;
}

Status GpuImpactQuery::State::reserve_pairs(std::uint32_t wanted) {
  if (wanted <= capacity.pairs && samples.room() != 0) return Status::kOk;
  const std::uint32_t count = grown(wanted, capacity.pairs);
  const std::size_t poses = kImpactSamplesPerPair * std::size_t{count} + kFewestImpactSamples;
  if (poses >= kNoIndex) return Status::kOutOfGpuMemory;
  capacity.pairs = 0;
  Status status = reserve_all(count, pairs, sought, stops, triangles, impacts, is_sampled, sampled_pairs);
  if (status == Status::kOk) status = keep(met.reserve(2 * poses));
  if (status == Status::kOk) status = keep(samples.reserve(poses));
  if (status == Status::kOk) capacity.pairs = count;
  return status;
}

// There is always one, which lanes without a block pair may look at.
Status GpuImpactQuery::State::reserve_parts(std::uint32_t wanted) {
  if (wanted <= capacity.parts && capacity.parts != 0) return Status::kOk;
  if (wanted > kMostParts) return Status::kOutOfRange;
  const std::uint32_t count = std::clamp(grown(wanted, capacity.parts), 1u, kMostParts);
  capacity.parts = 0;
  Status status = keep(parts.reserve(count));
  if (status == Status::kOk) status = reserve_all(std::bit_ceil(2 * count), part_keys, part_of_key);
  if (status == Status::kOk) capacity.parts = count;
  return status;
}

Status GpuImpactQuery::State::reserve_block_pairs(std::uint32_t wanted) {
  if (wanted <= capacity.block_pairs) return Status::kOk;
  const std::uint32_t count = grown(wanted, capacity.block_pairs);
  capacity.block_pairs = 0;
  const Status status = keep(block_pairs.reserve(2 * std::size_t{count}));
  if (status == Status::kOk) capacity.block_pairs = count;
  return status;
}

Status GpuImpactQuery::State::reserve_triangle_pairs(std::uint32_t wanted) {
  if (wanted <= capacity.triangle_pairs) return Status::kOk;
  const std::uint32_t count = grown(wanted, capacity.triangle_pairs);
  capacity.triangle_pairs = 0;
  const Status status = reserve_all(count, triangle_pairs, advanced);
  if (status == Status::kOk) capacity.triangle_pairs = count;
  return status;
}

Status GpuImpactQuery::State::reserve(const GpuImpactCapacity& wanted, const GpuImpactOptions& options) {
  Status status = reserve_instances(wanted.instances);
  if (status == Status::kOk) status = reserve_pairs(wanted.pairs);
  if (status == Status::kOk) status = reserve_parts(wanted.parts);
  if (status == Status::kOk) status = reserve_block_pairs(wanted.block_pairs);
  if (status == Status::kOk) status = reserve_triangle_pairs(wanted.triangle_pairs);
  if (status == Status::kOk)
    status = broad_phase.reserve({capacity.instances, capacity.pairs}, {.sorted = options.sorted});
  if (status == Status::kOk) status = contacts.reserve({capacity.pairs, wanted.contacts, wanted.undecided});
  capacity.contacts = contacts.capacity().contacts;
  capacity.undecided = contacts.capacity().undecided;
  return status;
}

gpu::ImpactArgs GpuImpactQuery::State::args(const GpuInstances& instances, const RigidMotion* motion,
                                            double duration, const GpuPairs& given,
                                            const GpuImpactOptions& options) {
  gpu::ImpactArgs args = {};
  args.assets = assets.data();
  args.asset_count = asset_count;
  args.instances = instances;
  args.motion = motion;
  args.duration = duration;
  args.tolerance = options.tolerance;
  args.given = given;
  args.capacity = capacity;
  args.state = state.data();
  args.host_report = report.data();
  args.query = contacts.device_report();
  args.contacts = contacts.contacts();
  args.bodies = bodies.data();
  args.boxes = boxes.data();
  args.pairs = pairs.data();
  args.sought = sought.data();
  args.stops = stops.data();
  args.triangles = triangles.data();
  args.impacts = impacts.data();
  args.parts = parts.data();
  args.part_keys = part_keys.data();
  args.part_of_key = part_of_key.data();
  args.most_keys = static_cast<std::uint32_t>(part_keys.room());
  args.frontier = {block_pairs.data(), state->waiting, capacity.block_pairs};
  args.triangle_pairs = {triangle_pairs.data(), &state->triangle_pairs, capacity.triangle_pairs};
  args.advanced = {advanced.data(), &state->advanced, capacity.triangle_pairs};
  args.is_sampled = is_sampled.data();
  args.sampled_pairs = sampled_pairs.data();
  args.met[0] = met.data();
  args.met[1] = met.data() + most_samples();
  args.samples = samples.data();
  args.most_samples = most_samples();
  args.limits = limits;
  return args;
}

// A walk that only marks which samples have a contact that float32 is sure of.
gpu::QueryArgs GpuImpactQuery::State::sample_args(const gpu::ImpactArgs& args, std::uint32_t which,
                                                  std::uint32_t most_blocks) const {
  gpu::QueryArgs walk = {};
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
  walk.shape = gpu::walk_shape(limits, depth, most_blocks);
  return walk;
}

cudaError_t GpuImpactQuery::State::clear(const gpu::ImpactArgs& args, cudaStream_t stream) {
  cudaError_t result = cudaMemsetAsync(args.state, 0, sizeof(gpu::ImpactState), stream);
  if (result == cudaSuccess) result = cudaMemsetAsync(args.part_keys, 0xFF, part_keys.bytes(), stream);
  if (result == cudaSuccess && triangles.bytes() != 0)
    result = cudaMemsetAsync(args.triangles, 0xFF, triangles.bytes(), stream);
  return result;
}

cudaError_t GpuImpactQuery::State::end_at_samples(const gpu::ImpactArgs& args, std::uint32_t most_blocks,
                                                  cudaStream_t stream) {
  cudaError_t result = gpu::list_sampled_pairs(args, stream);
  for (std::uint32_t which = 0; which < 2 && result == cudaSuccess; ++which) {
    result = cudaMemsetAsync(walk_state.data(), 0, sizeof(gpu::QueryState), stream);
    if (result == cudaSuccess) result = gpu::pose_samples(args, which, stream);
    if (result == cudaSuccess) result = gpu::walk_exact(sample_args(args, which, most_blocks), stream);
  }
  return result == cudaSuccess ? gpu::end_at_samples(args, stream) : result;
}

cudaError_t GpuImpactQuery::State::walk(const gpu::ImpactArgs& args, std::uint32_t most_blocks,
                                        cudaStream_t stream) {
  const std::uint32_t rounds = gpu::impact_rounds_of(depth);
  cudaError_t result = gpu::begin_impacts(args, stream);
  std::uint32_t first = 0;
  if (result == cudaSuccess && depth >= kFewestLevelsToSample) {
    first = gpu::kSampledRound;
    result = gpu::walk_impacts(args, 0, first, stream);
    if (result == cudaSuccess) result = end_at_samples(args, most_blocks, stream);
  }
  if (result == cudaSuccess) result = gpu::walk_impacts(args, first, rounds, stream);
  if (result == cudaSuccess) result = gpu::advance_impacts(args, stream);
  return result == cudaSuccess ? gpu::write_impacts(args, stream) : result;
}

// args.given: null where the pairs are to be found.
Status GpuImpactQuery::State::enqueue(const gpu::ImpactArgs& given, const GpuImpactOptions& options,
                                      cudaStream_t stream) {
  gpu::ImpactArgs args = given;
  const auto is_size = [](double x) { return x >= 0 && std::isfinite(x); };
  if (!is_size(args.duration) || !is_size(args.tolerance) || args.instances.count > capacity.instances)
    return Status::kOutOfRange;
  Status status = keep(clear(args, stream));
  if (status == Status::kOk) status = keep(gpu::move_bodies(args, stream));
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

GpuImpactQuery::GpuImpactQuery() : state_(new (std::nothrow) State) {}
GpuImpactQuery::GpuImpactQuery(GpuImpactQuery&&) noexcept = default;
GpuImpactQuery& GpuImpactQuery::operator=(GpuImpactQuery&&) noexcept = default;
GpuImpactQuery::~GpuImpactQuery() = default;

Status GpuImpactQuery::set_assets(std::span<const GpuAsset> assets, cudaStream_t stream) {
  return state_ != nullptr ? state_->set_assets(assets, stream) : Status::kOutOfMemory;
}

Status GpuImpactQuery::reserve(const GpuImpactCapacity& capacity, const GpuImpactOptions& options) {
  return state_->reserve(capacity, options);
}

Status GpuImpactQuery::enqueue(const GpuInstances& instances, const RigidMotion* motion, double duration,
                               const GpuImpactOptions& options, cudaStream_t stream) {
  return enqueue(instances, motion, duration, GpuPairs{}, options, stream);
}

Status GpuImpactQuery::enqueue(const GpuInstances& instances, const RigidMotion* motion, double duration,
                               const GpuPairs& pairs, const GpuImpactOptions& options, cudaStream_t stream) {
  State& s = *state_;
  return s.enqueue(s.args(instances, motion, duration, pairs, options), options, stream);
}

Status GpuImpactQuery::find(const GpuInstances& instances, const RigidMotion* motion, double duration,
                            const GpuImpactOptions& options, cudaStream_t stream) {
  return find(instances, motion, duration, GpuPairs{}, options, stream);
}

Status GpuImpactQuery::find(const GpuInstances& instances, const RigidMotion* motion, double duration,
                            const GpuPairs& pairs, const GpuImpactOptions& options, cudaStream_t stream) {
  GpuImpactCapacity wanted = capacity();
  wanted.instances = std::max(wanted.instances, instances.count);
  if (pairs.count != nullptr) wanted.pairs = std::max(wanted.pairs, pairs.capacity);
  for (;;) {
    Status status = reserve(wanted, options);
    if (status == Status::kOk) status = enqueue(instances, motion, duration, pairs, options, stream);
    if (status == Status::kOk) status = state_->keep(cudaStreamSynchronize(stream));
    if (status != Status::kOk) return status;
    if (report().status != Status::kOk) return report().status;
    if (report().complete != 0) return Status::kOk;
    if (pairs.count != nullptr && report().needed.pairs > pairs.capacity) return Status::kOutOfRange;
    if (report().needed.pairs == kNoIndex) return Status::kTooManyPairs;
    wanted = larger(capacity(), report().needed);
    wanted.parts = std::min(wanted.parts, kMostParts + 1);  // what is more is refused
  }
}

GpuPairs GpuImpactQuery::pairs() const {
  return state_->broad_phase.pairs();
}

const Impact* GpuImpactQuery::impacts() const {
  return state_->impacts.data();
}

const GpuImpactReport* GpuImpactQuery::device_report() const {
  return &state_->state->report;
}

const GpuImpactReport& GpuImpactQuery::report() const {
  return *state_->report;
}

GpuImpactCapacity GpuImpactQuery::capacity() const {
  return state_ != nullptr ? state_->capacity : GpuImpactCapacity{};
}

std::size_t GpuImpactQuery::bytes() const {
  if (state_ == nullptr) return 0;
  const State& s = *state_;
  return s.assets.bytes() + s.state.bytes() + s.broad_phase.bytes() + s.contacts.bytes() + s.bodies.bytes() +
         s.boxes.bytes() + s.pairs.bytes() + s.sought.bytes() + s.stops.bytes() + s.triangles.bytes() +
         s.impacts.bytes() + s.parts.bytes() + s.part_keys.bytes() + s.part_of_key.bytes() +
         s.block_pairs.bytes() + s.triangle_pairs.bytes() + s.advanced.bytes() + s.is_sampled.bytes() +
         s.sampled_pairs.bytes() + s.met.bytes() + s.samples.bytes() + s.walk_state.bytes() +
         s.chunks.bytes();
}

cudaError_t GpuImpactQuery::cuda_error() const {
  return state_ != nullptr ? state_->error : cudaSuccess;
}

}  // namespace tandem
