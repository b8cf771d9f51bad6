#include "tandem/kernels/gpu_contact_query.h"

#include <algorithm>

#include "kernels/common/check_options.h"
#include "kernels/common/gpu_host.h"
#include "kernels/contact/gpu_neighbours.h"
#include "kernels/contact/gpu_query_data.h"
#include "kernels/contact/only_walk.h"

namespace tandem::gpu {
namespace {

// Blocks of a tree that an entry of the walk's stack can name.
constexpr std::uint32_t kMostBlocks = (1u << kNumberBits) - 1;

// A candidate that lies beyond 32 bits could not be numbered.
constexpr std::uint64_t kMostUndecided = 0xFFFFFFFEu;

// Pairs whose contacts can be grouped: a sum over them has 31 bits for each kind of pair.
constexpr std::uint32_t kMostGroupedPairs = 1u << 31;

std::uint64_t spread_counts(std::uint64_t pairs) {
  return std::max(pairs, kSpread * std::min<std::uint64_t>(pairs, kMostSpreadPairs));
}
std::uint64_t sums_of_tiles(std::uint64_t pairs) {
  return 2 * std::uint64_t{tiles_of(static_cast<std::uint32_t>(pairs))};
}

}  // namespace

template <>
struct HostOf<GpuContactReport> : GpuHost<QueryState, GpuContactReport> {
  AssetList assets{*this};
  GpuNeighbours neighbours{*this};
  bool state_is_clear = false;  // a query that ends leaves it so
  bool walks_only = false;
  ArgArray<&QueryArgs::chunks> chunks{*this};

  Room<std::uint32_t> of_pairs{*this};
  ArgArray<&QueryArgs::pairs> pairs{of_pairs};
  ArgArray<&QueryArgs::world_pairs> world_pairs{of_pairs};
  ArgArray<&QueryArgs::met> met{of_pairs};
  Room<std::uint64_t> of_contacts{*this};
  RoomArray<Contact> contacts{of_contacts, [](std::uint64_t count) { return count + kContactsForKeys; }};
  Room<std::uint64_t> of_undecided{*this};
  ArgArray<&QueryArgs::undecided> undecided{of_undecided};  // what float32 leaves

  Room<std::uint32_t> of_clearance{*this};
  ArgArray<&QueryArgs::clearances> clearances{of_clearance};
  ArgArray<&QueryArgs::wide_rooms> wide_rooms{*this};

  // Contacts as they are found, where they are sorted or grouped then.
  Room<std::uint64_t> of_ungrouped{*this};
  RoomArray<Contact> ungrouped{of_ungrouped};
  Room<std::uint64_t> of_sorted{*this};
  RoomArray<std::uint32_t> order{of_sorted, times<2>};
  RoomArray<unsigned char> sorting{*this};  // CUB's
  Room<std::uint32_t> of_grouped{*this};
  RoomArray<std::uint32_t> next{of_grouped, spread_counts};
  RoomArray<std::uint32_t> few{of_grouped}, many{of_grouped};
  RoomArray<Counter> tile_sums{of_grouped, sums_of_tiles};
  RoomArray<std::uint32_t> first_contact{of_grouped, [](std::uint64_t count) { return count + 1; }};

  GpuContactCapacity capacity() const {
    return {of_pairs.count(), of_contacts.count(), of_undecided.count()};
  }
  bool can_clear() const { return of_clearance.has(of_pairs.count()) && wide_rooms.room() != 0; }
  bool can_sort() const { return of_sorted.has(of_contacts.count()) && sorting.room() != 0; }
  bool can_group() const { return of_ungrouped.has(of_contacts.count()) && of_grouped.has(of_pairs.count()); }

  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    const AssetSummary all = summary_of(given);
    if (all.blocks >= kMostBlocks) return Status::kOutOfRange;
    const Status status = provide_fixed_memory([&] {
      Status made = keep(chunks.reserve(most_mailboxes(limits)));
      if (made == Status::kOk) made = keep(cudaMemsetAsync(state.data(), 0, state.bytes(), stream));
      if (made == Status::kOk) made = keep(cudaMemsetAsync(chunks.data(), 0, chunks.bytes(), stream));
      if (made == Status::kOk) made = keep(cudaStreamSynchronize(stream));
      state_is_clear = made == Status::kOk;
      return made;
    });
    if (status != Status::kOk) return status;
    const Status known = neighbours.set_assets(given);
    return known == Status::kOk ? assets.set(given, all, *this, stream) : known;
  }

  Status follow(const GpuAssetRecords& of_list) {
    assets.records = of_list.assets;
    return Status::kOk;
  }

  Status reserve(const GpuContactCapacity& wanted, const GpuContactOptions& options) {
    if (wanted.undecided > kMostUndecided) return Status::kOutOfGpuMemory;
    Status status = keep(of_pairs.grow(wanted.pairs));
    if (status == Status::kOk) status = keep(of_contacts.grow(wanted.contacts));
    if (status == Status::kOk) status = keep(of_undecided.grow(wanted.undecided, kMostUndecided));
    if (status == Status::kOk && options.of_clearance()) status = reserve_clearance();
    if (status == Status::kOk && options.leave_out_rings <= kMostRings)
      status =
          neighbours.provide(options.leave_out_rings, [this](cudaError_t result) { return keep(result); });
    if (status == Status::kOk && options.sorted) status = reserve_sorting();
    return status == Status::kOk && options.grouped ? reserve_grouping() : status;
  }

  Status reserve_clearance() {
    Status status = keep(of_clearance.fit(of_pairs.count()));
    if (status != Status::kOk || wide_rooms.room() != 0) return status;
    status = keep(wide_rooms.reserve(kWideRooms));
    if (status == Status::kOk) status = keep(cudaMemset(wide_rooms.data(), 0, wide_rooms.bytes()));
    if (status == Status::kOk) status = keep(cudaDeviceSynchronize());
    if (status != Status::kOk) wide_rooms.free();
    return status;
  }

  Status reserve_ungrouped() {
    return of_contacts.count() < kNoIndex ? keep(of_ungrouped.fit(of_contacts.count())) : Status::kOutOfRange;
  }

  Status reserve_sorting() {
    if (can_sort()) return Status::kOk;
    of_sorted.give_back();
    sorting.free();
    std::size_t bytes = 0;
    Status status = reserve_ungrouped();
    if (status == Status::kOk) status = keep(sorting_bytes(of_contacts.count(), bytes));
    if (status == Status::kOk) status = keep(of_sorted.fit(of_contacts.count()));
    return status == Status::kOk ? keep(sorting.reserve(std::max<std::size_t>(bytes, 1))) : status;
  }

  Status reserve_grouping() {
    if (can_group()) return Status::kOk;
    if (of_pairs.count() >= kMostGroupedPairs) return Status::kOutOfRange;
    const Status status = reserve_ungrouped();
    return status == Status::kOk ? keep(of_grouped.fit(of_pairs.count())) : status;
  }

  Grouping grouping(const GpuContactOptions& options) const {
    if (!options.grouped) return {};
    return {next.data(),
            first_contact.data(),
            few.data(),
            many.data(),
            tile_sums.data(),
            tile_sums.data() + tiles_of(of_pairs.count()),
            options.sorted ? nullptr : contacts.data()};
  }

  // Returns why a query with these options cannot be queued.
  Status refusal(const GpuContactOptions& options) const {
    if (const Status status = check_within(options.within); status != Status::kOk) return status;
    if (const Status status = check_rings(options.leave_out_rings); status != Status::kOk) return status;
    const bool oriented = walked_kind(options.mode) == BlockKind::oriented;
    if (oriented && !assets.all.oriented) return Status::kNoOrientedBlocks;
    if (!oriented && !assets.all.axis_aligned) return Status::kNoAxisAlignedBlocks;
    const bool has_room = (!options.sorted || can_sort()) && (!options.grouped || can_group()) &&
                          (!options.of_clearance() || can_clear()) && neighbours.has(options.leave_out_rings);
    return has_room ? Status::kOk : Status::kOutOfRange;
  }

  QueryArgs args(const GpuInstances& instances, const GpuPairs& given, const GpuContactOptions& options) {
    QueryArgs args = {};
    fill(args, instances);
    assets.fill(args);
    args.given = given;
    args.mode = options.mode;
    args.first_contact_only = options.first_contact_only;
    args.walk_only = walks_only && options.mode == QueryMode::exact;
    args.capacity = capacity();
    args.contacts = options.sorted || options.grouped ? ungrouped.data() : contacts.data();
    args.grouping = grouping(options);
    args.shape = walk_shape(limits, assets.all.depth, options.most_blocks);
    args.within = options.within;
    args.adds_errors = options.add_error_bounds;
    args.near = options.of_clearance();
    if (options.leave_out_rings == 0) args.neighbourhoods = nullptr;
    return args;
  }

  // Launches all kernels of a query but those that group and sort.
  cudaError_t launch(const QueryArgs& args, cudaStream_t stream) {
    cudaError_t result = cudaSuccess;
    if (!state_is_clear) result = cudaMemsetAsync(args.state, 0, sizeof(QueryState), stream);
    cudaStreamCaptureStatus capture = cudaStreamCaptureStatusNone;
    if (result == cudaSuccess) result = cudaStreamIsCapturing(stream, &capture);
    const auto walk = args.mode == QueryMode::exact ? walk_exact : walk_unfused;
    if (result == cudaSuccess) result = queue(args, stream, prepare_pairs, walk, decide_rest);
    // A captured call has not run: the state is as before.
    if (capture == cudaStreamCaptureStatusNone) state_is_clear = result == cudaSuccess;
    return result;
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuContactCapacity, GpuContactReport, GpuContactOptions>;
template class GpuAssetQuestion<GpuContactCapacity, GpuContactReport, GpuContactOptions>;

Status GpuContactQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                                const GpuContactOptions& options, cudaStream_t stream) {
  auto& host = *host_;
  if (const Status status = host.refusal(options); status != Status::kOk) return status;
  const gpu::QueryArgs args = host.args(instances, pairs, options);
  cudaError_t error = host.launch(args, stream);
  if (error == cudaSuccess && options.grouped) error = gpu::group_contacts(args, stream);
  if (error == cudaSuccess && options.sorted) {
    error = gpu::sort_contacts(args,
                               {host.contacts.data(), host.order.data(), host.sorting.data(),
                                host.sorting.bytes(), host.assets.all.triangles, host.assets.all.faces},
                               stream);
  }
  return host.keep(error);
}

Status GpuContactQuery::find_contacts(const GpuInstances& instances, const GpuPairs& pairs,
                                      const GpuContactOptions& options, cudaStream_t stream) {
  return gpu::find_until_complete(
      *host_, capacity(), options, stream, [&] { return enqueue(instances, pairs, options, stream); },
      [&](const GpuContactReport& report, GpuContactCapacity& wanted) {
        wanted = report.needed;
        if (options.first_contact_only) wanted.undecided = gpu::with_spare(wanted.undecided);
        return wanted.pairs > pairs.capacity ? Status::kOutOfRange : Status::kOk;
      });
}

const Contact* GpuContactQuery::contacts() const {
  return host_->contacts.data();
}

GpuContactGroups GpuContactQuery::groups() const {
  const auto& host = *host_;
  return {host.contacts.data(), host.first_contact.data(), host.few.data(), host.many.data(),
          &host.state->groups};
}

const std::uint32_t* GpuContactQuery::met() const {
  return host_->met.data();
}

void only_walk(GpuContactQuery& query, bool only) {
  query.host_->walks_only = only;
}

}  // namespace tandem
