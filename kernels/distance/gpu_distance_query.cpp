#include "tandem/kernels/gpu_distance_query.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <new>

#include "kernels/distance/distance_data.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

static_assert(most_distance_bytes({1, 0, 0, 0, 0}, 0) - most_distance_bytes({}, 0) ==
              sizeof(gpu::DistanceRecord) + sizeof(gpu::NearState) + sizeof(gpu::Narrowing) +
                  sizeof(ObjectDistance) + sizeof(std::uint32_t));
static_assert(most_distance_bytes({0, 1, 1, 1, 0}, 0) - most_distance_bytes({}, 0) ==
              2 * sizeof(gpu::BlockPairEntry) + sizeof(gpu::TrianglePairEntry) + sizeof(gpu::FrameBounds) +
                  sizeof(gpu::TrianglePairEntry) + sizeof(TriangleDistance));

static_assert(sizeof(gpu::DistanceState) <= most_distance_bytes({}, 0));

/// What is there before a query tells what it needs.
constexpr std::uint32_t kFirstRoom = 1u << 16;

/// The most of anything: threads that share out so many, each a step beyond its last one, still count in 32
/// bits, and a number that is too large for the report, kNoIndex, is no room.
constexpr std::uint32_t kMostRoom = kNoIndex - (1u << 24);

// Room that is too small hides what would have followed from what it has no room for.
std::uint32_t with_spare(std::uint32_t needed, std::uint32_t present) {
  if (needed <= present || needed > kMostRoom) return std::max(needed, present);
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(std::uint64_t{needed} + needed / 2, kMostRoom));
}

}  // namespace

struct GpuDistanceQuery::State {
  GpuArray<GpuAsset> assets;
  std::uint32_t asset_count = 0, depth = 1;
  gpu::DeviceLimits limits = {};
  GpuArray<gpu::DistanceState> state;
  PinnedArray<GpuDistanceReport> report;

  GpuArray<gpu::DistanceRecord> records;
  GpuArray<gpu::NearState> near_states;
  GpuArray<gpu::Narrowing> narrowings;
  GpuArray<ObjectDistance> distances;
  GpuArray<std::uint32_t> walked;
  GpuArray<gpu::BlockPairEntry> frontier;
  GpuArray<gpu::TrianglePairEntry> near, rest;
  GpuArray<gpu::FrameBounds> bounds;
  GpuArray<TriangleDistance> rest_distances;
  GpuDistanceCapacity capacity;
  cudaError_t error = cudaSuccess;

  Status keep(cudaError_t result) {
    error = result;
    if (result != cudaSuccess) static_cast<void>(cudaGetLastError());  // later calls must not report it again
    return status_of(result);
  }
  /// Makes room for `wanted` in all of the arrays, of which the last is times as large, and tells `room`.
  template <typename... Arrays>
  Status grow(std::uint32_t wanted, std::uint32_t& room, Arrays&... arrays);
  Status provide_fixed_memory();
  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream);
  Status reserve(const GpuDistanceCapacity& wanted);
  gpu::DistanceArgs args(const GpuInstances& instances, const GpuPairs& pairs,
                         const GpuDistanceOptions& options) const;
};

template <typename... Arrays>
Status GpuDistanceQuery::State::grow(std::uint32_t wanted, std::uint32_t& room, Arrays&... arrays) {
  if (wanted <= room) return Status::kOk;
  const std::uint64_t count =
      std::min<std::uint64_t>(std::max<std::uint64_t>(wanted, std::uint64_t{room} + room / 2), kMostRoom);
  room = 0;
  Status status = Status::kOk;
  const auto grow_one = [&](auto& array) {
    array.free();
    if (status == Status::kOk) status = keep(array.reserve(count));
  };
  (grow_one(arrays), ...);
  if (status == Status::kOk) room = static_cast<std::uint32_t>(count);
  return status;
}

Status GpuDistanceQuery::State::provide_fixed_memory() {
  Status status = keep(gpu::limits_of_device(limits));
  if (status == Status::kOk) status = keep(state.reserve(1));
  if (status != Status::kOk || report.data() != nullptr) return status;
  status = keep(report.reserve(1));
  if (status == Status::kOutOfGpuMemory) status = Status::kOutOfMemory;
  if (status == Status::kOk) *report = {};
  return status;
}

Status GpuDistanceQuery::State::set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
  Status status = provide_fixed_memory();
  if (status != Status::kOk) return status;
  if (given.size() >= kNoIndex) return Status::kOutOfRange;
  std::uint32_t deepest = 1;
  for (const GpuAsset& asset : given) {
    if (asset.tree.blocks == nullptr) return Status::kNoAxisAlignedBlocks;
    deepest = std::max(deepest, asset.tree.depth);
  }
  asset_count = 0;
  status = keep(assets.upload(given, stream));
  if (status == Status::kOk) status = keep(cudaStreamSynchronize(stream));
  if (status != Status::kOk) return status;
  asset_count = static_cast<std::uint32_t>(given.size());
  depth = deepest;
  return Status::kOk;
}

Status GpuDistanceQuery::State::reserve(const GpuDistanceCapacity& wanted) {
  if (std::max({wanted.pairs, wanted.block_pairs, wanted.triangle_pairs, wanted.settled}) > kMostRoom)
    return Status::kOutOfGpuMemory;
  Status status = grow(wanted.pairs, capacity.pairs, records, near_states, narrowings, distances, walked);
  if (status == Status::kOk && wanted.block_pairs > capacity.block_pairs) {
    // Two rounds lie there.
    capacity.block_pairs = 0;
    frontier.free();
    status = keep(frontier.reserve(2 * std::size_t{wanted.block_pairs}));
    if (status == Status::kOk) capacity.block_pairs = wanted.block_pairs;
  }
  if (status == Status::kOk) status = grow(wanted.triangle_pairs, capacity.triangle_pairs, near, bounds);
  if (status == Status::kOk) status = grow(wanted.settled, capacity.settled, rest, rest_distances);
  capacity.words = std::max({capacity.words, wanted.words, kFewWords});
  return status;
}

gpu::DistanceArgs GpuDistanceQuery::State::args(const GpuInstances& instances, const GpuPairs& pairs,
                                                const GpuDistanceOptions& options) const {
  gpu::DistanceState* const s = state.data();
  gpu::DistanceArgs args = {};
  args.assets = assets.data();
  args.asset_count = asset_count;
  args.instances = instances;
  args.given = pairs;
  args.tolerance = options.tolerance;
  args.beyond_reach = std::nextafter(options.reach, INFINITY);
  args.former = options.former;
  args.capacity = capacity;
  args.state = s;
  args.host_report = report.data();
  args.records = records.data();
  args.near_states = near_states.data();
  args.narrowings = narrowings.data();
  args.distances = distances.data();
  args.walked = {walked.data(), &s->walked, capacity.pairs};
  args.narrow = {frontier.data(), s->narrow_rounds, capacity.block_pairs};
  args.frontier = {frontier.data(), s->rounds, capacity.block_pairs};
  args.seeds = {near.data(), &s->seeds, capacity.triangle_pairs};
  args.near = {near.data(), &s->near, capacity.triangle_pairs};
  args.bounds = bounds.data();
  args.rest = {rest.data(), &s->rest, capacity.settled};
  args.rest_distances = rest_distances.data();
  args.rounds = gpu::rounds_of(depth, depth);
  args.limits = limits;
  return args;
}

GpuDistanceQuery::GpuDistanceQuery() : state_(new (std::nothrow) State) {}
GpuDistanceQuery::GpuDistanceQuery(GpuDistanceQuery&&) noexcept = default;
GpuDistanceQuery& GpuDistanceQuery::operator=(GpuDistanceQuery&&) noexcept = default;
GpuDistanceQuery::~GpuDistanceQuery() = default;

Status GpuDistanceQuery::set_assets(std::span<const GpuAsset> assets, cudaStream_t stream) {
  return state_ != nullptr ? state_->set_assets(assets, stream) : Status::kOutOfMemory;
}

Status GpuDistanceQuery::reserve(const GpuDistanceCapacity& capacity) {
  return state_->reserve(capacity);
}

Status GpuDistanceQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                                 const GpuDistanceOptions& options, cudaStream_t stream) {
  const DistanceTolerance& tolerance = options.tolerance;
  if (!(options.reach >= 0 && tolerance.absolute >= 0 && tolerance.relative >= 0)) return Status::kOutOfRange;
  const gpu::DistanceArgs args = state_->args(instances, pairs, options);
  cudaError_t error = cudaMemsetAsync(args.state, 0, offsetof(gpu::DistanceState, report), stream);
  if (error == cudaSuccess) error = gpu::prepare_distances(args, stream);
  if (error == cudaSuccess) error = gpu::walk_distances(args, stream);
  if (error == cudaSuccess) error = gpu::settle_distances(args, stream);
  return state_->keep(error);
}

Status GpuDistanceQuery::find_distances(const GpuInstances& instances, const GpuPairs& pairs,
                                        const GpuDistanceOptions& options, cudaStream_t stream) {
  GpuDistanceCapacity wanted = capacity();
  wanted.block_pairs = std::max(wanted.block_pairs, kFirstRoom);
  wanted.triangle_pairs = std::max(wanted.triangle_pairs, kFirstRoom);
  wanted.settled = std::max(wanted.settled, kFirstRoom / 16);
  GpuDistanceOptions own = options;
  for (;;) {
    Status status = reserve(wanted);
    if (status == Status::kOk) status = enqueue(instances, pairs, own, stream);
    if (status == Status::kOk) status = state_->keep(cudaStreamSynchronize(stream));
    if (status != Status::kOk) return status;
    if (report().status != Status::kOk) return report().status;
    if (report().complete != 0) return Status::kOk;
    const GpuDistanceCapacity &needed = report().needed, present = capacity();
    if (needed.pairs > pairs.capacity) return Status::kOutOfRange;
    // The rows of the step before are lost, and these are of a query that was not complete.
    if (own.former == distances()) own.former = nullptr;
    wanted = {needed.pairs, with_spare(needed.block_pairs, present.block_pairs),
              with_spare(needed.triangle_pairs, present.triangle_pairs),
              with_spare(needed.settled, present.settled), needed.words};
  }
}

const ObjectDistance* GpuDistanceQuery::distances() const {
  return state_->distances.data();
}

const GpuDistanceReport* GpuDistanceQuery::device_report() const {
  return &state_->state->report;
}

const GpuDistanceReport& GpuDistanceQuery::report() const {
  return *state_->report;
}

GpuDistanceCapacity GpuDistanceQuery::capacity() const {
  return state_ != nullptr ? state_->capacity : GpuDistanceCapacity{};
}

std::size_t GpuDistanceQuery::bytes() const {
  if (state_ == nullptr) return 0;
  const State& s = *state_;
  return s.assets.bytes() + s.state.bytes() + s.records.bytes() + s.near_states.bytes() +
         s.narrowings.bytes() + s.distances.bytes() + s.walked.bytes() + s.frontier.bytes() + s.near.bytes() +
         s.rest.bytes() + s.bounds.bytes() + s.rest_distances.bytes();
}

cudaError_t GpuDistanceQuery::cuda_error() const {
  return state_ != nullptr ? state_->error : cudaSuccess;
}

}  // namespace tandem
