#include "tandem/kernels/gpu_moved_query.h"

#include <algorithm>
#include <memory>

#include "kernels/common/gpu_host.h"
#include "kernels/scene/moved_call.h"
#include "kernels/scene/moved_data.h"

namespace tandem::gpu {

template <>
struct HostOf<GpuMovedReport> : GpuHost<MovedState, GpuMovedReport> {
  ArgArray<&MovedArgs::boxes> boxes{*this};
  std::uint32_t asset_count = 0;
  GpuPairs pairs = {};  // of the last call

  Room<std::uint32_t> of_pairs{*this};
  ArgArray<&MovedArgs::posed> posed{of_pairs, one_for_each, Growth::keeps};
  ArgArray<&MovedArgs::posed_before> posed_before{of_pairs, one_for_each, Growth::keeps};
  ArgArray<&MovedArgs::kept_rows> kept_rows{of_pairs};
  ArgArray<&MovedArgs::moved_rows> moved_rows{of_pairs};
  ArgArray<&MovedArgs::row_of_moved> row_of_moved{of_pairs};
  ArgArray<&MovedArgs::moved> moved{of_pairs};
  ArgArray<&MovedArgs::tile_sums> tile_sums{of_pairs,
                                            [](std::uint64_t count) { return count / kMovedTile + 1; }};
  ArgArray<&MovedArgs::table> table{of_pairs, [](std::uint64_t count) { return 2 * count + 32; }};

  GpuMovedCapacity capacity() const { return {of_pairs.count()}; }

  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    asset_count = 0;
    if (given.size() >= kNoIndex) return Status::kOutOfRange;
    Status status = provide_fixed_memory();
    if (status != Status::kOk) return status;
    std::unique_ptr<AssetBox[]> made(new (std::nothrow) AssetBox[given.size()]);
    if (made == nullptr) return Status::kOutOfMemory;
    std::transform(given.begin(), given.end(), made.get(),
                   [](const GpuAsset& asset) { return asset_box(asset.lower, asset.upper, asset.origin); });
    MovedState initial = {};
    initial.next_call = take_moved_calls(std::uint64_t{1} << 32);
    status = keep(boxes.upload({made.get(), given.size()}, stream));
    if (status == Status::kOk) status = keep(state.upload({&initial, 1}, stream));
    if (status == Status::kOk) status = empty_table();
    if (status == Status::kOk) status = keep(cudaStreamSynchronize(stream));
    if (status == Status::kOk) asset_count = static_cast<std::uint32_t>(given.size());
    return status;
  }

  Status follow(const GpuAssetRecords& of_list) {
    return of_list.assets == nullptr ? Status::kOk : Status::kDeformed;
  }

  // The next call enters its pairs anew.
  Status empty_table() {
    if (table.room() == 0) return Status::kOk;
    const Status status = keep(cudaMemset(table.data(), 0, table.bytes()));
    return status == Status::kOk ? keep(cudaDeviceSynchronize()) : status;
  }

  Status reserve(const GpuMovedCapacity& wanted, const GpuNoOptions&) {
    if (wanted.pairs >= std::uint32_t{1} << 30) return Status::kOutOfRange;
    if (of_pairs.has(wanted.pairs)) return Status::kOk;
    Status status = keep(of_pairs.grow(wanted.pairs));
    if (status == Status::kOk) status = empty_table();
    if (status != Status::kOk) of_pairs.forget();
    return status;
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuMovedCapacity, GpuMovedReport>;
template class GpuAssetQuestion<GpuMovedCapacity, GpuMovedReport>;

Status GpuMovedQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                              const GpuMovedOptions& options, cudaStream_t stream) {
  if (!(options.tolerance >= 0)) return Status::kBadTolerance;
  auto& host = *host_;
  gpu::MovedArgs args = {};
  host.fill(args, instances);
  args.asset_count = host.asset_count;
  args.pairs = host.pairs = pairs;
  args.tolerance = options.tolerance;
  args.tolerance_of_pair = options.tolerance_of_pair;
  args.capacity = host.of_pairs.count();
  args.table_size = static_cast<std::uint32_t>(host.table.room());
  return host.keep(gpu::queue(args, stream, gpu::remember_poses, gpu::find_moved));
}

Status GpuMovedQuery::find(const GpuInstances& instances, const GpuPairs& pairs,
                           const GpuMovedOptions& options, cudaStream_t stream) {
  GpuMovedCapacity first = capacity();
  first.pairs = std::max(first.pairs, pairs.capacity);
  return gpu::find_until_complete(
      *host_, first, GpuNoOptions{}, stream, [&] { return enqueue(instances, pairs, options, stream); },
      [](const GpuMovedReport& report, GpuMovedCapacity& more) {
        more = report.needed;
        return Status::kOk;
      });
}

GpuMoved GpuMovedQuery::moved() const {
  const auto& host = *host_;
  const gpu::MovedState* const state = host.state.data();
  return {host.pairs,
          {host.moved.data(), &state->moved, host.of_pairs.count()},
          host.kept_rows.data(),
          host.moved_rows.data(),
          host.row_of_moved.data(),
          host.posed.data(),
          host.boxes.data(),
          &state->call};
}

Status GpuMovedQuery::forget_poses(cudaStream_t stream) {
  return host_->keep(gpu::forget_poses(host_->state.data(), stream));
}

}  // namespace tandem
