#include "tandem/kernels/gpu_manifold_query.h"

#include <algorithm>
#include <memory>

#include "kernels/common/check_options.h"
#include "kernels/common/gpu_host.h"
#include "kernels/manifold/follow_records.h"
#include "kernels/manifold/manifold_data.h"
#include "kernels/manifold/shape.h"

namespace tandem::gpu {
namespace {

// Words of a tile's sum have 31 bits for manifolds and for points; pieces of a pair are found by 32 bits.
constexpr std::uint64_t kMost = std::uint64_t{1} << 31;

}  // namespace

template <>
struct HostOf<GpuManifoldReport> : GpuHost<ManifoldState, GpuManifoldReport> {
  ArgArray<&ManifoldArgs::shapes> shapes{*this};
  std::uint32_t asset_count = 0;
  const GpuAsset* records = nullptr;  // to follow

  Room<std::uint32_t> of_pairs{*this};
  ArgArray<&ManifoldArgs::of_pair> of_pair{of_pairs};
  ArgArray<&ManifoldArgs::summaries> summaries{of_pairs};
  ArgArray<&ManifoldArgs::tile_sums> tile_sums{of_pairs,
                                               [](std::uint64_t pairs) { return pairs / kManifoldTile + 1; }};
  ArgArray<&ManifoldArgs::places> places{of_pairs, one_for_each, Growth::keeps};
  ArgArray<&ManifoldArgs::places_before> places_before{of_pairs, one_for_each, Growth::keeps};
  ArgArray<&ManifoldArgs::table> table{*this};  // of the pairs of the call before

  Room<std::uint64_t> of_contacts{*this};
  RoomArray<manifold::Piece> pieces{of_contacts};
  RoomArray<float> normals{of_contacts, times<6>};
  RoomArray<std::uint32_t> curve{of_contacts}, order{of_contacts};
  ArgArray<&ManifoldArgs::curves> curves{of_contacts};
  RoomArray<std::uint32_t> words{of_contacts, times<manifold::PieceMemory::kTableWords>};
  RoomArray<std::uint32_t> start{*this};  // of contacts and pairs

  Room<std::uint32_t> of_manifolds{*this};
  ArgArray<&ManifoldArgs::manifolds> manifolds{of_manifolds, one_for_each, Growth::keeps};
  ArgArray<&ManifoldArgs::manifolds_before> manifolds_before{of_manifolds, one_for_each, Growth::keeps};
  ArgArray<&ManifoldArgs::found_manifolds> found_manifolds{of_manifolds, one_for_each, Growth::keeps};
  ArgArray<&ManifoldArgs::found_manifolds_before> found_manifolds_before{of_manifolds, one_for_each,
                                                                         Growth::keeps};
  ArgArray<&ManifoldArgs::entries> entries{of_manifolds, one_for_each, Growth::keeps};
  ArgArray<&ManifoldArgs::begun> begun{of_manifolds};
  ArgArray<&ManifoldArgs::patches> patches{of_manifolds};
  ArgArray<&ManifoldArgs::next_of_pair> next_of_pair{of_manifolds};

  Room<std::uint32_t> of_points{*this};
  ArgArray<&ManifoldArgs::points> points{of_points, one_for_each, Growth::keeps};
  ArgArray<&ManifoldArgs::points_before> points_before{of_points, one_for_each, Growth::keeps};
  ArgArray<&ManifoldArgs::found_points> found_points{of_points, one_for_each, Growth::keeps};
  ArgArray<&ManifoldArgs::found_points_before> found_points_before{of_points, one_for_each, Growth::keeps};

  GpuManifoldCapacity capacity() const {
    return {of_pairs.count(), of_contacts.count(), of_manifolds.count(), of_points.count()};
  }

  static std::size_t table_size(std::uint32_t pairs) { return 2 * std::size_t{pairs} + 32; }
  static std::size_t starts(std::uint32_t pairs, std::uint64_t contacts) { return contacts + pairs + 1; }

  /// Returns the most that bytes() is with so much room.
  std::size_t most_bytes(const GpuManifoldCapacity& most, std::size_t assets) const {
    return sizeof(ManifoldState) + assets * sizeof(manifold::Shape) +
           table_size(most.pairs) * sizeof(TableEntry) +
           starts(most.pairs, most.contacts) * sizeof(std::uint32_t) + of_pairs.bytes_for(most.pairs) +
           of_contacts.bytes_for(most.contacts) + of_manifolds.bytes_for(most.manifolds) +
           of_points.bytes_for(most.points);
  }

  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
    asset_count = 0;
    records = nullptr;
    if (!summary_of(given).topology) return Status::kNoTopology;
    Status status = provide_fixed_memory();
    if (status != Status::kOk) return status;
    std::unique_ptr<manifold::Shape[]> made(new (std::nothrow) manifold::Shape[given.size()]);
    if (made == nullptr) return Status::kOutOfMemory;
    std::transform(given.begin(), given.end(), made.get(), [](const GpuAsset& asset) {
      return manifold::shape_of(asset.tree, asset.lower, asset.upper, asset.origin);
    });
    ManifoldState initial = {};
    initial.step = 1;
    status = keep(shapes.upload({made.get(), given.size()}, stream));
    if (status == Status::kOk) status = keep(state.upload({&initial, 1}, stream));
    if (status == Status::kOk && table.room() != 0)
      status = keep(cudaMemsetAsync(table.data(), 0, table.bytes(), stream));
    if (status == Status::kOk) status = keep(cudaStreamSynchronize(stream));
    if (status == Status::kOk) asset_count = static_cast<std::uint32_t>(given.size());
    return status;
  }

  Status follow(const GpuAssetRecords& of_list) {
    if (of_list.positions != PositionTypes::float32) return Status::kNotFloat32;
    records = of_list.assets;
    return Status::kOk;
  }
  cudaError_t take_shapes(cudaStream_t stream) const {
    return records != nullptr ? follow_records(records, asset_count, shapes.data(), stream) : cudaSuccess;
  }

  // Moves what the table holds to a larger one where there is room for more pairs than before.
  Status enlarge_table() {
    const std::size_t size = table_size(of_pairs.count());
    if (size <= table.room()) return Status::kOk;
    GpuArray<TableEntry> larger;
    Status status = keep(larger.reserve(size));
    if (status == Status::kOk) status = keep(cudaMemset(larger.data(), 0, larger.bytes()));
    if (status == Status::kOk && table.room() != 0) {
      status = keep(move_entries(table.data(), static_cast<std::uint32_t>(table.room()), larger.data(),
                                 static_cast<std::uint32_t>(larger.room()), state.data()));
    }
    if (status == Status::kOk) status = keep(cudaDeviceSynchronize());
    if (status == Status::kOk) table = std::move(larger);
    return status;
  }

  // The pieces of a call are not needed by the next; manifolds and points are, which it is to match.
  Status reserve(const GpuManifoldCapacity& wanted, const GpuNoOptions&) {
    if (wanted.pairs >= kMost / 2 || wanted.contacts >= kMost || wanted.manifolds >= kMost ||
        wanted.points >= kMost)
      return Status::kOutOfRange;
    Status status = Status::kOk;
    if (!of_pairs.has(wanted.pairs)) {
      status = keep(of_pairs.grow(wanted.pairs));
      if (status == Status::kOk) status = enlarge_table();
      if (status != Status::kOk) of_pairs.forget();
    }
    if (status == Status::kOk) status = keep(of_contacts.grow(wanted.contacts));
    if (status == Status::kOk) {
      status = keep(start.reserve(starts(of_pairs.count(), of_contacts.count())));
      if (status != Status::kOk) of_contacts.forget();
    }
    if (status == Status::kOk) status = keep(of_manifolds.grow(wanted.manifolds));
    return status == Status::kOk ? keep(of_points.grow(wanted.points)) : status;
  }

  ManifoldArgs args(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
                    const ManifoldOptions& options) const {
    ManifoldArgs args = {};
    fill(args, instances);
    args.pairs = pairs;
    args.groups = query.groups();
    args.query = query.device_report();
    args.capacity = capacity();
    args.match_previous = args.matches = options.match_previous;
    args.options = {static_cast<int>(options.most_points), options.quick_depths};
    args.pieces = {pieces.data(), normals.data(), curve.data(), order.data(), start.data(), words.data()};
    args.table_size = static_cast<std::uint32_t>(table.room());
    return args;
  }
};

}  // namespace tandem::gpu

namespace tandem {

template class GpuQuestion<GpuManifoldCapacity, GpuManifoldReport>;
template class GpuAssetQuestion<GpuManifoldCapacity, GpuManifoldReport>;

std::size_t most_manifold_bytes(const GpuManifoldCapacity& capacity, std::size_t assets) {
  return gpu::HostOf<GpuManifoldReport>().most_bytes(capacity, assets);
}

Status GpuManifoldQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                                 const GpuContactQuery& query, const ManifoldOptions& options,
                                 cudaStream_t stream) {
  if (const Status status = check_most_points(options.most_points); status != Status::kOk) return status;
  const gpu::ManifoldArgs args = host_->args(instances, pairs, query, options);
  const auto take_shapes = [&](const auto&, cudaStream_t on) { return host_->take_shapes(on); };
  return host_->keep(
      gpu::queue(args, stream, take_shapes, gpu::remember_points, gpu::make_patches, gpu::place_manifolds));
}

Status GpuManifoldQuery::enqueue(const GpuInstances& instances, const GpuMoved& moved,
                                 const GpuContactQuery& query, const ManifoldOptions& options,
                                 cudaStream_t stream) {
  if (const Status status = check_most_points(options.most_points); status != Status::kOk) return status;
  gpu::ManifoldArgs args = host_->args(instances, moved.moved, query, options);
  args.moved = moved;
  args.match_previous = true;
  const auto take_shapes = [&](const auto&, cudaStream_t on) { return host_->take_shapes(on); };
  return host_->keep(gpu::queue(args, stream, take_shapes, gpu::remember_kept, gpu::remember_points,
                                gpu::make_patches, gpu::count_kept_manifolds, gpu::place_manifolds,
                                gpu::move_kept_manifolds));
}

Status GpuManifoldQuery::make(const GpuInstances& instances, const GpuMoved& moved,
                              const GpuContactQuery& query, const ManifoldOptions& options,
                              cudaStream_t stream) {
  GpuManifoldCapacity first = capacity();
  first.pairs = std::max({first.pairs, moved.pairs.capacity, moved.moved.capacity});
  first.contacts = std::max(first.contacts, query.report().contacts);
  return gpu::find_behind(query, *host_, first, GpuNoOptions{}, stream,
                          [&] { return enqueue(instances, moved, query, options, stream); });
}

Status GpuManifoldQuery::make(const GpuInstances& instances, const GpuPairs& pairs,
                              const GpuContactQuery& query, const ManifoldOptions& options,
                              cudaStream_t stream) {
  GpuManifoldCapacity first = capacity();
  first.pairs = std::max(first.pairs, pairs.capacity);
  first.contacts = std::max(first.contacts, query.report().contacts);
  return gpu::find_behind(query, *host_, first, GpuNoOptions{}, stream,
                          [&] { return enqueue(instances, pairs, query, options, stream); });
}

const Manifold* GpuManifoldQuery::manifolds() const {
  return host_->manifolds.data();
}

const ManifoldPoint* GpuManifoldQuery::points() const {
  return host_->points.data();
}

Status GpuManifoldQuery::forget_points(cudaStream_t stream) {
  return host_->keep(gpu::forget_last(host_->state.data(), stream));
}

}  // namespace tandem
