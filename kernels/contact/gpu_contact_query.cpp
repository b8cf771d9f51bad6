#include "tandem/kernels/gpu_contact_query.h"

#include <algorithm>
#include <memory>
#include <new>

#include "kernels/contact/gpu_query_data.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

// Blocks of a tree that an entry of the walk's stack can name.
constexpr std::uint32_t kMostBlocks = (1u << gpu::kNumberBits) - 1;

template <typename Number>
Number grown(Number wanted, Number present) {
  return wanted <= present ? present : std::max(wanted, present + present / 2);
}

// A candidate that lies beyond 32 bits could not be numbered.
constexpr std::uint64_t kMostUndecided = 0xFFFFFFFEu;

// Pairs whose contacts can be grouped: a sum over them has 31 bits for each kind of pair.
constexpr std::uint32_t kMostGroupedPairs = 1u << 31;

}  // namespace

struct GpuContactQuery::State {
  GpuArray<GpuAsset> assets;
  std::uint32_t asset_count = 0, depth = 1, most_triangles = 0;
  std::uint64_t most_faces = 0;
  bool all_oriented = true, all_axis_aligned = true;  // whether each asset has these blocks

  gpu::DeviceLimits limits = {};
  GpuArray<gpu::QueryState> query;
  bool query_is_clear = false;  // a query that ends leaves it so
  GpuArray<gpu::Chunk> chunks;
  PinnedArray<GpuContactReport> report;

  GpuArray<gpu::PairRecord> pairs;
  GpuArray<std::uint32_t> world_pairs, met;
  GpuArray<Contact> contacts;
  GpuArray<gpu::Candidate> undecided;  // what float32 leaves
  GpuContactCapacity capacity;
  GpuArray<distance::FrameClearance> clearances;  // of clearance
  GpuArray<gpu::WideRoom> wide_rooms;

  GpuArray<Contact> ungrouped;  // contacts as they are found, where they are sorted or grouped then
  GpuArray<std::uint32_t> order;
  GpuArray<unsigned char> sorting;  // CUB's
  GpuArray<std::uint32_t> first_contact, next, few, many;
  GpuArray<gpu::Counter> tile_sums;

  cudaError_t error = cudaSuccess;

  // Keeps what CUDA says of a call.
  Status keep(cudaError_t result) {
    error = result;
    if (result != cudaSuccess) static_cast<void>(cudaGetLastError());  // later calls must not report it again
    return status_of(result);
  }
  template <typename Element>
  Status reserve(GpuArray<Element>& array, std::uint64_t count) {
    return keep(array.reserve(count));
  }

  Status provide_fixed_memory(cudaStream_t stream);
  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream);
  Status reserve_pairs(std::uint32_t wanted);
  Status reserve_contacts(std::uint64_t wanted);
  Status reserve_undecided(std::uint64_t wanted);
  Status reserve_clearance();
  Status reserve_ungrouped();
  Status reserve_sorting();
  Status reserve_grouping();
  gpu::Grouping grouping(const GpuContactOptions& options) const;
  Status check_mode(QueryMode mode) const;
  bool can_clear() const { return clearances.room() >= capacity.pairs && wide_rooms.room() != 0; }
  bool can_sort() const { return order.room() / 2 >= capacity.contacts && sorting.room() != 0; }
  bool can_group() const {
    return ungrouped.room() >= capacity.contacts && first_contact.room() > capacity.pairs;
  }
  gpu::QueryArgs args(const GpuInstances& instances, const GpuPairs& given, const GpuContactOptions& options);
  cudaError_t launch(const gpu::QueryArgs& args, cudaStream_t stream);
};

Status GpuContactQuery::State::provide_fixed_memory(cudaStream_t stream) {
  if (report.data() != nullptr) return Status::kOk;
  Status status = keep(gpu::limits_of_device(limits));
  if (status == Status::kOk) status = reserve(query, 1);
  if (status == Status::kOk) status = reserve(chunks, gpu::most_mailboxes(limits));
  if (status == Status::kOk) status = keep(cudaMemsetAsync(query.data(), 0, query.bytes(), stream));
  if (status == Status::kOk) status = keep(cudaMemsetAsync(chunks.data(), 0, chunks.bytes(), stream));
  if (status == Status::kOk) status = keep(cudaStreamSynchronize(stream));
  if (status != Status::kOk) return status;
  query_is_clear = true;
  status = keep(report.reserve(1));
  if (status == Status::kOk) *report = {};
  return status == Status::kOutOfGpuMemory ? Status::kOutOfMemory : status;
}

Status GpuContactQuery::State::set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
  Status status = provide_fixed_memory(stream);
  if (status != Status::kOk) return status;
  std::uint32_t deepest = 1, triangles = 0, blocks = 0;
  std::uint64_t faces = 0;
  bool oriented = true, axis_aligned = true;
  for (const GpuAsset& asset : given) {
    oriented = oriented && asset.tree.oriented_blocks != nullptr;
    axis_aligned = axis_aligned && asset.tree.blocks != nullptr;
    blocks = std::max(blocks, asset.tree.block_count);
    deepest = std::max(deepest, asset.tree.depth);
    triangles = std::max(triangles, asset.tree.triangle_count);
    faces = std::max(faces, asset.source_faces);
  }
  if (given.size() >= kNoIndex || blocks >= kMostBlocks) return Status::kOutOfRange;
  asset_count = 0;
  status = keep(assets.upload(given, stream));
  if (status == Status::kOk) status = keep(cudaStreamSynchronize(stream));
  if (status != Status::kOk) return status;
  asset_count = static_cast<std::uint32_t>(given.size());
  depth = deepest;
  most_triangles = triangles;
  most_faces = faces;
  all_oriented = oriented;
  all_axis_aligned = axis_aligned;
  return Status::kOk;
}

Status GpuContactQuery::State::check_mode(QueryMode mode) const {
  if (gpu::walked_kind(mode) == gpu::BlockKind::oriented)
    return all_oriented ? Status::kOk : Status::kNoOrientedBlocks;
  return all_axis_aligned ? Status::kOk : Status::kNoAxisAlignedBlocks;
}

Status GpuContactQuery::State::reserve_pairs(std::uint32_t wanted) {
  if (wanted <= capacity.pairs) return Status::kOk;
  const std::uint32_t count = grown(wanted, capacity.pairs);
  capacity.pairs = 0;
  pairs.free();
  world_pairs.free();
  met.free();
  Status status = reserve(pairs, count);
  if (status == Status::kOk) status = reserve(world_pairs, count);
  if (status == Status::kOk) status = reserve(met, count);
  if (status == Status::kOk) capacity.pairs = count;
  return status;
}

Status GpuContactQuery::State::reserve_contacts(std::uint64_t wanted) {
  if (wanted <= capacity.contacts && contacts.room() != 0) return Status::kOk;
  const std::uint64_t count = grown(wanted, capacity.contacts);
  capacity.contacts = 0;
  const Status status = reserve(contacts, count + gpu::kContactsForKeys);
  if (status == Status::kOk) capacity.contacts = count;
  return status;
}

Status GpuContactQuery::State::reserve_undecided(std::uint64_t wanted) {
  if (wanted <= capacity.undecided) return Status::kOk;
  const std::uint64_t count = std::min(grown(wanted, capacity.undecided), kMostUndecided);
  capacity.undecided = 0;
  const Status status = reserve(undecided, count);
  if (status == Status::kOk) capacity.undecided = count;
  return status;
}

Status GpuContactQuery::State::reserve_clearance() {
  Status status = reserve(clearances, capacity.pairs);
  if (status != Status::kOk || wide_rooms.room() != 0) return status;
  status = reserve(wide_rooms, gpu::kWideRooms);
  if (status == Status::kOk) status = keep(cudaMemset(wide_rooms.data(), 0, wide_rooms.bytes()));
  if (status == Status::kOk) status = keep(cudaDeviceSynchronize());
  if (status != Status::kOk) wide_rooms.free();
  return status;
}

Status GpuContactQuery::State::reserve_ungrouped() {
  return capacity.contacts < kNoIndex ? reserve(ungrouped, capacity.contacts) : Status::kOutOfRange;
}

Status GpuContactQuery::State::reserve_sorting() {
  if (can_sort()) return Status::kOk;
  order.free();
  sorting.free();
  std::size_t bytes = 0;
  Status status = reserve_ungrouped();
  if (status == Status::kOk) status = keep(gpu::sorting_bytes(capacity.contacts, bytes));
  if (status == Status::kOk) status = reserve(order, 2 * capacity.contacts);
  if (status == Status::kOk) status = reserve(sorting, std::max<std::size_t>(bytes, 1));
  return status;
}

Status GpuContactQuery::State::reserve_grouping() {
  if (can_group()) return Status::kOk;
  if (capacity.pairs >= kMostGroupedPairs) return Status::kOutOfRange;
  first_contact.free();  // the last that is there again: can_group() looks at it
  Status status = reserve_ungrouped();
  const std::uint32_t counts =
      std::max(capacity.pairs, gpu::kSpread * std::min(capacity.pairs, gpu::kMostSpreadPairs));
  if (status == Status::kOk) status = reserve(next, counts);
  if (status == Status::kOk) status = reserve(few, capacity.pairs);
  if (status == Status::kOk) status = reserve(many, capacity.pairs);
  if (status == Status::kOk) status = reserve(tile_sums, 2 * std::size_t{gpu::tiles_of(capacity.pairs)});
  if (status == Status::kOk) status = reserve(first_contact, std::size_t{capacity.pairs} + 1);
  return status;
}

gpu::Grouping GpuContactQuery::State::grouping(const GpuContactOptions& options) const {
  if (!options.grouped) return {};
  return {next.data(),
          first_contact.data(),
          few.data(),
          many.data(),
          tile_sums.data(),
          tile_sums.data() + gpu::tiles_of(capacity.pairs),
          options.sorted ? nullptr : contacts.data()};
}

gpu::QueryArgs GpuContactQuery::State::args(const GpuInstances& instances, const GpuPairs& given,
                                            const GpuContactOptions& options) {
  gpu::QueryArgs args = {};
  args.assets = assets.data();
  args.asset_count = asset_count;
  args.instances = instances;
  args.given = given;
  args.mode = options.mode;
  args.first_contact_only = options.first_contact_only;
  args.walk_only = options.walk_only && options.mode == QueryMode::exact;
  args.capacity = capacity;
  args.state = query.data();
  args.host_report = report.data();
  args.chunks = chunks.data();
  args.pairs = pairs.data();
  args.world_pairs = world_pairs.data();
  args.met = met.data();
  args.contacts = options.sorted || options.grouped ? ungrouped.data() : contacts.data();
  args.grouping = grouping(options);
  args.undecided = undecided.data();
  args.limits = limits;
  args.shape = gpu::walk_shape(limits, depth, options.most_blocks);
  args.within = options.within;
  args.adds_errors = options.add_error_bounds;
  args.near = options.of_clearance();
  args.clearances = clearances.data();
  args.wide_rooms = wide_rooms.data();
  return args;
}

// All kernels of a query but those that group and sort.
cudaError_t GpuContactQuery::State::launch(const gpu::QueryArgs& args, cudaStream_t stream) {
  cudaError_t result = cudaSuccess;
  if (!query_is_clear) result = cudaMemsetAsync(args.state, 0, sizeof(gpu::QueryState), stream);
  cudaStreamCaptureStatus capture = cudaStreamCaptureStatusNone;
  if (result == cudaSuccess) result = cudaStreamIsCapturing(stream, &capture);
  if (result == cudaSuccess) result = gpu::prepare_pairs(args, stream);
  if (result == cudaSuccess)
    result = (args.mode == QueryMode::exact ? gpu::walk_exact : gpu::walk_unfused)(args, stream);
  if (result == cudaSuccess) result = gpu::decide_rest(args, stream);
  // What is captured has not run: the state is as before.
  if (capture == cudaStreamCaptureStatusNone) query_is_clear = result == cudaSuccess;
  return result;
}

GpuContactQuery::GpuContactQuery() : state_(new (std::nothrow) State) {}
GpuContactQuery::GpuContactQuery(GpuContactQuery&&) noexcept = default;
GpuContactQuery& GpuContactQuery::operator=(GpuContactQuery&&) noexcept = default;
GpuContactQuery::~GpuContactQuery() = default;

Status GpuContactQuery::set_assets(std::span<const GpuAsset> assets, cudaStream_t stream) {
  return state_ != nullptr ? state_->set_assets(assets, stream) : Status::kOutOfMemory;
}

Status GpuContactQuery::reserve(const GpuContactCapacity& wanted, const GpuContactOptions& options) {
  if (wanted.undecided > kMostUndecided) return Status::kOutOfGpuMemory;
  Status status = state_->reserve_pairs(wanted.pairs);
  if (status == Status::kOk) status = state_->reserve_contacts(wanted.contacts);
  if (status == Status::kOk) status = state_->reserve_undecided(wanted.undecided);
  if (status == Status::kOk && options.of_clearance()) status = state_->reserve_clearance();
  if (status == Status::kOk && options.sorted) status = state_->reserve_sorting();
  return status == Status::kOk && options.grouped ? state_->reserve_grouping() : status;
}

Status GpuContactQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                                const GpuContactOptions& options, cudaStream_t stream) {
  State& s = *state_;
  if (const Status status = s.check_mode(options.mode); status != Status::kOk) return status;
  if (!(options.within >= 0 && options.within <= kLargestWorldCoordinate)) return Status::kOutOfRange;
  if ((options.sorted && !s.can_sort()) || (options.grouped && !s.can_group()) ||
      (options.of_clearance() && !s.can_clear()))
    return Status::kOutOfRange;
  const gpu::QueryArgs args = s.args(instances, pairs, options);
  cudaError_t error = s.launch(args, stream);
  if (error == cudaSuccess && options.grouped) error = gpu::group_contacts(args, stream);
  if (error == cudaSuccess && options.sorted) {
    error = gpu::sort_contacts(args,
                               {s.contacts.data(), s.order.data(), s.sorting.data(), s.sorting.bytes(),
                                s.most_triangles, s.most_faces},
                               stream);
  }
  return s.keep(error);
}

Status GpuContactQuery::find_contacts(const GpuInstances& instances, const GpuPairs& pairs,
                                      const GpuContactOptions& options, cudaStream_t stream) {
  for (;;) {
    Status status = reserve(capacity(), options);  // where nothing was reserved yet
    if (status == Status::kOk) status = enqueue(instances, pairs, options, stream);
    if (status == Status::kOk) status = state_->keep(cudaStreamSynchronize(stream));
    if (status != Status::kOk) return status;
    if (report().status != Status::kOk) return report().status;
    if (report().complete != 0) return Status::kOk;
    GpuContactCapacity needed = report().needed;
    // What is looked at before a pair's first contact is found differs from run to run.
    if (options.first_contact_only) needed.undecided += needed.undecided / 2 + 1024;
    if (needed.pairs > pairs.capacity) return Status::kOutOfRange;
    status = reserve(needed, options);
    if (status != Status::kOk) return status;
  }
}

const Contact* GpuContactQuery::contacts() const {
  return state_->contacts.data();
}

GpuContactGroups GpuContactQuery::groups() const {
  const State& s = *state_;
  return {s.contacts.data(), s.first_contact.data(), s.few.data(), s.many.data(), &s.query->groups};
}

const std::uint32_t* GpuContactQuery::met() const {
  return state_->met.data();
}

const GpuContactReport* GpuContactQuery::device_report() const {
  return &state_->query->report;
}

const GpuContactReport& GpuContactQuery::report() const {
  return *state_->report;
}

GpuContactCapacity GpuContactQuery::capacity() const {
  return state_ != nullptr ? state_->capacity : GpuContactCapacity{};
}

std::size_t GpuContactQuery::bytes() const {
  if (state_ == nullptr) return 0;
  const State& s = *state_;
  return s.assets.bytes() + s.query.bytes() + s.chunks.bytes() + s.pairs.bytes() + s.world_pairs.bytes() +
         s.met.bytes() + s.contacts.bytes() + s.undecided.bytes() + s.clearances.bytes() +
         s.wide_rooms.bytes() + s.ungrouped.bytes() + s.order.bytes() + s.sorting.bytes() +
         s.first_contact.bytes() + s.next.bytes() + s.few.bytes() + s.many.bytes() + s.tile_sums.bytes();
}

cudaError_t GpuContactQuery::cuda_error() const {
  return state_ != nullptr ? state_->error : cudaSuccess;
}

}  // namespace tandem
