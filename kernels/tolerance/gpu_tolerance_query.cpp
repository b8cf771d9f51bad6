#include "tandem/kernels/gpu_tolerance_query.h"

#include <algorithm>
#include <new>

#include "kernels/tolerance/tolerance_data.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {
namespace {

static_assert(sizeof(gpu::ToleranceState) <=
              most_tolerance_bytes({}, 0) - most_query_bytes({}, kToleranceOptions, 0));
static_assert(sizeof(PairVerdict) == 3);
static_assert(sizeof(levels::LevelRange) == 8);

// Whether two levels in a row of a list are of one asset, the one behind the other.
bool follows(const GpuAsset& finer, const GpuAsset& coarser) {
  return coarser.tree.number == finer.tree.number + 1 && coarser.source_faces == finer.source_faces &&
         std::equal(coarser.origin, coarser.origin + 3, finer.origin) &&
         std::equal(coarser.lower, coarser.lower + 3, finer.lower) &&
         std::equal(coarser.upper, coarser.upper + 3, finer.upper);
}

}  // namespace

struct GpuToleranceQuery::State {
  GpuContactQuery contacts;  // of which each level is an asset
  GpuArray<GpuAsset> levels;
  GpuArray<levels::LevelRange> assets;
  std::uint32_t asset_count = 0;
  gpu::DeviceLimits limits = {};
  GpuArray<gpu::ToleranceState> state;
  PinnedArray<GpuToleranceReport> report;
  GpuArray<std::uint32_t> level, asset;  // of each instance
  GpuArray<PairVerdict> verdicts;
  GpuToleranceCapacity capacity;
  cudaError_t error = cudaSuccess;

  Status keep(cudaError_t result) {
    error = result;
    if (result != cudaSuccess) static_cast<void>(cudaGetLastError());  // later calls must not report it again
    return status_of(result);
  }
  Status keep(Status status) {
    error = contacts.cuda_error();
    return status;
  }
  Status provide_fixed_memory();
  Status set_levels(std::span<const GpuAsset> given, cudaStream_t stream);
  Status reserve_instances(std::uint32_t wanted);
  Status reserve_pairs(std::uint32_t wanted);
  Status reserve(const GpuToleranceCapacity& wanted);
  gpu::ToleranceArgs args(const GpuInstances& instances, const GpuPairs& pairs, double tolerance) const;
  Status enqueue(const gpu::ToleranceArgs& args, cudaStream_t stream);
};

Status GpuToleranceQuery::State::provide_fixed_memory() {
  Status status = keep(gpu::limits_of_device(limits));
  if (status == Status::kOk) status = keep(state.reserve(1));
  if (status != Status::kOk || report.data() != nullptr) return status;
  status = keep(report.reserve(1));
  if (status == Status::kOutOfGpuMemory) status = Status::kOutOfMemory;
  if (status == Status::kOk) *report = {};
  return status;
}

Status GpuToleranceQuery::State::set_levels(std::span<const GpuAsset> given, cudaStream_t stream) {
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
  if (status == Status::kOk) status = keep(contacts.set_assets(given, stream));
  if (status == Status::kOk) status = keep(levels.upload(given, stream));
  if (status == Status::kOk) status = keep(assets.upload(ranges.view(), stream));
  if (status == Status::kOk) status = keep(cudaStreamSynchronize(stream));
  if (status != Status::kOk) return status;
  asset_count = static_cast<std::uint32_t>(ranges.size());
  return Status::kOk;
}

Status GpuToleranceQuery::State::reserve_instances(std::uint32_t wanted) {
  if (wanted <= capacity.instances) return Status::kOk;
  capacity.instances = 0;
  Status status = keep(level.grow(wanted));
  if (status == Status::kOk) status = keep(asset.grow(wanted));
  if (status == Status::kOk)
    capacity.instances = static_cast<std::uint32_t>(std::min(level.room(), asset.room()));
  return status;
}

// As much as the contact query has room for.
Status GpuToleranceQuery::State::reserve_pairs(std::uint32_t wanted) {
  if (wanted <= capacity.pairs) return Status::kOk;
  capacity.pairs = 0;
  const Status status = keep(verdicts.reserve(wanted));
  if (status == Status::kOk) capacity.pairs = wanted;
  return status;
}

Status GpuToleranceQuery::State::reserve(const GpuToleranceCapacity& wanted) {
  const std::uint32_t pairs = std::max(wanted.pairs, capacity.pairs);
  Status status = reserve_instances(wanted.instances);
  if (status == Status::kOk)
    status = keep(
        contacts.reserve({pairs, pairs, std::max(wanted.undecided, capacity.undecided)}, kToleranceOptions));
  const GpuContactCapacity room = contacts.capacity();
  capacity.undecided = room.undecided;
  if (status == Status::kOk)
    status = reserve_pairs(static_cast<std::uint32_t>(std::min<std::uint64_t>(room.pairs, room.contacts)));
  return status;
}

gpu::ToleranceArgs GpuToleranceQuery::State::args(const GpuInstances& instances, const GpuPairs& pairs,
                                                  double tolerance) const {
  gpu::ToleranceArgs args = {};
  args.levels = levels.data();
  args.assets = assets.data();
  args.asset_count = asset_count;
  args.instances = instances;
  args.given = pairs;
  args.tolerance = tolerance;
  args.pair_capacity = capacity.pairs;
  args.state = state.data();
  args.host_report = report.data();
  args.level = level.data();
  args.asset = asset.data();
  args.verdicts = verdicts.data();
  args.met = contacts.met();
  args.query = contacts.device_report();
  args.limits = limits;
  return args;
}

Status GpuToleranceQuery::State::enqueue(const gpu::ToleranceArgs& args, cudaStream_t stream) {
  const GpuInstances posed = {args.asset, args.instances.pose, args.instances.count};
  GpuContactOptions options = kToleranceOptions;
  options.add_error_bounds = args.tolerance > 0;  // else all stand for their finest levels
  Status status = keep(gpu::choose_levels(args, stream));
  if (status == Status::kOk) status = keep(contacts.enqueue(posed, args.given, options, stream));
  return status == Status::kOk ? keep(gpu::judge_pairs(args, stream)) : status;
}

GpuToleranceQuery::GpuToleranceQuery() : state_(new (std::nothrow) State) {}
GpuToleranceQuery::GpuToleranceQuery(GpuToleranceQuery&&) noexcept = default;
GpuToleranceQuery& GpuToleranceQuery::operator=(GpuToleranceQuery&&) noexcept = default;
GpuToleranceQuery::~GpuToleranceQuery() = default;

Status GpuToleranceQuery::set_levels(std::span<const GpuAsset> levels, cudaStream_t stream) {
  return state_ != nullptr ? state_->set_levels(levels, stream) : Status::kOutOfMemory;
}

Status GpuToleranceQuery::reserve(const GpuToleranceCapacity& capacity) {
  return state_->reserve(capacity);
}

Status GpuToleranceQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs, double tolerance,
                                  cudaStream_t stream) {
  const bool is_one = tolerance >= 0 && tolerance <= kLargestWorldCoordinate;
  if (!is_one || instances.count > state_->capacity.instances) return Status::kOutOfRange;
  return state_->enqueue(state_->args(instances, pairs, tolerance), stream);
}

Status GpuToleranceQuery::decide(const GpuInstances& instances, const GpuPairs& pairs, double tolerance,
                                 cudaStream_t stream) {
  GpuToleranceCapacity wanted = capacity();
  wanted.instances = std::max(wanted.instances, instances.count);
  for (;;) {
    Status status = reserve(wanted);
    if (status == Status::kOk) status = enqueue(instances, pairs, tolerance, stream);
    if (status == Status::kOk) status = state_->keep(cudaStreamSynchronize(stream));
    if (status != Status::kOk) return status;
    if (report().status != Status::kOk) return report().status;
    if (report().complete != 0) return Status::kOk;
    if (report().needed.pairs > pairs.capacity) return Status::kOutOfRange;
    wanted = report().needed;
    // What is looked at before a pair's first contact is found differs from run to run.
    wanted.undecided += wanted.undecided / 2 + 1024;
  }
}

const PairVerdict* GpuToleranceQuery::verdicts() const {
  return state_->verdicts.data();
}

const GpuToleranceReport* GpuToleranceQuery::device_report() const {
  return &state_->state->report;
}

const GpuToleranceReport& GpuToleranceQuery::report() const {
  return *state_->report;
}

GpuToleranceCapacity GpuToleranceQuery::capacity() const {
  return state_ != nullptr ? state_->capacity : GpuToleranceCapacity{};
}

std::size_t GpuToleranceQuery::bytes() const {
  if (state_ == nullptr) return 0;
  const State& s = *state_;
  return s.contacts.bytes() + s.levels.bytes() + s.assets.bytes() + s.state.bytes() + s.level.bytes() +
         s.asset.bytes() + s.verdicts.bytes();
}

cudaError_t GpuToleranceQuery::cuda_error() const {
  return state_ != nullptr ? state_->error : cudaSuccess;
}

}  // namespace tandem
