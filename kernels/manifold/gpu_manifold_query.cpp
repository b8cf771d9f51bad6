#include "tandem/kernels/gpu_manifold_query.h"

#include <algorithm>
#include <memory>
#include <new>

#include "kernels/manifold/manifold_data.h"
#include "kernels/manifold/shape.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

// Words of a tile's sum have 31 bits for manifolds and for points; pieces of a pair are found by 32 bits.
constexpr std::uint64_t kMost = std::uint64_t{1} << 31;

manifold::Shape shape_of(const GpuAsset& asset) {
  manifold::Shape shape;
  shape.triangles = asset.tree.triangles;
  shape.topology = asset.tree.topology;
  shape.blocks = asset.tree.blocks;
  shape.oriented_blocks = asset.tree.oriented_blocks;
  manifold::set_bounds(asset.lower, asset.upper, asset.origin, shape);
  shape.closed = asset.tree.closed;
  return shape;
}

}  // namespace

struct GpuManifoldQuery::State {
  GpuArray<manifold::Shape> shapes;
  gpu::DeviceLimits limits = {};
  GpuArray<gpu::ManifoldState> state;
  PinnedArray<GpuManifoldReport> report;

  GpuArray<manifold::Piece> pieces;
  GpuArray<float> normals;
  GpuArray<std::uint32_t> curve, order, start, words;
  GpuArray<gpu::PairPatches> of_pair;
  GpuArray<manifold::PieceSummary> summaries;
  GpuArray<gpu::PairCurve> curves;
  GpuArray<gpu::Counter> tile_sums;
  GpuArray<gpu::TableEntry> table;
  GpuArray<gpu::BegunPatch> begun;
  GpuArray<manifold::Patch> patches;
  GpuArray<std::uint32_t> next_of_pair;
  GpuArray<Manifold> manifolds, manifolds_before;
  GpuArray<gpu::PairEntry> entries;
  GpuArray<ManifoldPoint> points, points_before;
  GpuManifoldCapacity capacity;

  cudaError_t error = cudaSuccess;

  Status keep(cudaError_t result) {
    error = result;
    if (result != cudaSuccess) static_cast<void>(cudaGetLastError());  // later calls must not report it again
    return status_of(result);
  }
  Status set_assets(std::span<const GpuAsset> given, cudaStream_t stream);
  Status reserve_pairs(std::uint32_t wanted);
  Status reserve_contacts(std::uint64_t wanted);
  Status reserve_manifolds(std::uint32_t wanted);
  Status reserve_points(std::uint32_t wanted);
  gpu::ManifoldArgs args(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
                         const GpuManifoldOptions& options) const;
};

Status GpuManifoldQuery::State::set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
  for (const GpuAsset& asset : given) {
    if (asset.tree.topology == nullptr) return Status::kNoTopology;
  }
  Status status = keep(gpu::limits_of_device(limits));
  if (status == Status::kOk) status = keep(state.reserve(1));
  if (status == Status::kOk && report.data() == nullptr) {
    status = keep(report.reserve(1));
    if (status == Status::kOutOfGpuMemory) status = Status::kOutOfMemory;
    if (status == Status::kOk) *report = {};
  }
  if (status != Status::kOk) return status;
  std::unique_ptr<manifold::Shape[]> made(new (std::nothrow) manifold::Shape[given.size()]);
  if (made == nullptr) return Status::kOutOfMemory;
  std::transform(given.begin(), given.end(), made.get(), shape_of);
  gpu::ManifoldState initial = {};
  initial.step = 1;
  status = keep(shapes.upload({made.get(), given.size()}, stream));
  if (status == Status::kOk) status = keep(state.upload({&initial, 1}, stream));
  if (status == Status::kOk && table.room() != 0)
    status = keep(cudaMemsetAsync(table.data(), 0, table.bytes(), stream));
  return status == Status::kOk ? keep(cudaStreamSynchronize(stream)) : status;
}

Status GpuManifoldQuery::State::reserve_pairs(std::uint32_t wanted) {
  if (wanted <= capacity.pairs && table.room() != 0) return Status::kOk;
  Status status = keep(of_pair.grow(wanted));
  const std::size_t pairs = of_pair.room();
  if (status == Status::kOk) status = keep(summaries.reserve(pairs));
  if (status == Status::kOk) status = keep(tile_sums.reserve(pairs / gpu::kManifoldTile + 1));
  GpuArray<gpu::TableEntry> larger;
  if (status == Status::kOk) status = keep(larger.reserve(2 * pairs + 32));
  if (status == Status::kOk) status = keep(cudaMemset(larger.data(), 0, larger.bytes()));
  if (status == Status::kOk && table.room() != 0) {
    status = keep(gpu::move_entries(table.data(), static_cast<std::uint32_t>(table.room()), larger.data(),
                                    static_cast<std::uint32_t>(larger.room()), state.data()));
  }
  if (status == Status::kOk) status = keep(cudaDeviceSynchronize());
  if (status != Status::kOk) return status;
  table = std::move(larger);
  capacity.pairs = static_cast<std::uint32_t>(pairs);
  return status;
}

// The pieces of a call are not needed by the next.
Status GpuManifoldQuery::State::reserve_contacts(std::uint64_t wanted) {
  const std::uint64_t count = std::max(wanted, capacity.contacts);
  const std::uint64_t starts = count + capacity.pairs + 1;
  if (wanted <= capacity.contacts && start.room() >= starts) return Status::kOk;
  capacity.contacts = 0;
  Status status = keep(pieces.grow(count));
  const std::uint64_t room = pieces.room();
  if (status == Status::kOk) status = keep(normals.reserve(6 * room));
  if (status == Status::kOk) status = keep(curve.reserve(room));
  if (status == Status::kOk) status = keep(order.reserve(room));
  if (status == Status::kOk) status = keep(start.reserve(room + capacity.pairs + 1));
  if (status == Status::kOk) status = keep(curves.reserve(room));
  if (status == Status::kOk) status = keep(words.reserve(manifold::PieceMemory::kTableWords * room));
  if (status == Status::kOk) capacity.contacts = room;
  return status;
}

Status GpuManifoldQuery::State::reserve_manifolds(std::uint32_t wanted) {
  if (wanted <= capacity.manifolds) return Status::kOk;
  capacity.manifolds = 0;
  Status status = keep(manifolds.grow(wanted, manifolds.room()));
  const std::size_t room = manifolds.room();
  if (status == Status::kOk) status = keep(manifolds_before.grow(room, manifolds_before.room()));
  if (status == Status::kOk) status = keep(entries.grow(room, entries.room()));
  if (status == Status::kOk) status = keep(begun.reserve(room));
  if (status == Status::kOk) status = keep(patches.reserve(room));
  if (status == Status::kOk) status = keep(next_of_pair.reserve(room));
  if (status == Status::kOk) capacity.manifolds = static_cast<std::uint32_t>(room);
  return status;
}

Status GpuManifoldQuery::State::reserve_points(std::uint32_t wanted) {
  if (wanted <= capacity.points) return Status::kOk;
  capacity.points = 0;
  Status status = keep(points.grow(wanted, points.room()));
  if (status == Status::kOk) status = keep(points_before.grow(points.room(), points_before.room()));
  if (status == Status::kOk) capacity.points = static_cast<std::uint32_t>(points.room());
  return status;
}

gpu::ManifoldArgs GpuManifoldQuery::State::args(const GpuInstances& instances, const GpuPairs& pairs,
                                                const GpuContactQuery& query,
                                                const GpuManifoldOptions& options) const {
  gpu::ManifoldArgs args = {};
  args.shapes = shapes.data();
  args.instances = instances;
  args.pairs = pairs;
  args.groups = query.groups();
  args.query = query.device_report();
  args.capacity = capacity;
  args.match_previous = options.match_previous;
  args.most_points = static_cast<int>(std::clamp(options.most_points, 1u, kMostManifoldPoints));
  args.state = state.data();
  args.host_report = report.data();
  args.pieces = {pieces.data(), normals.data(), curve.data(), order.data(), start.data(), words.data()};
  args.begun = begun.data();
  args.patches = patches.data();
  args.next_of_pair = next_of_pair.data();
  args.of_pair = of_pair.data();
  args.summaries = summaries.data();
  args.curves = curves.data();
  args.tile_sums = tile_sums.data();
  args.manifolds = manifolds.data();
  args.points = points.data();
  args.entries = entries.data();
  args.manifolds_before = manifolds_before.data();
  args.points_before = points_before.data();
  args.table = table.data();
  args.table_size = static_cast<std::uint32_t>(table.room());
  args.limits = limits;
  return args;
}

GpuManifoldQuery::GpuManifoldQuery() : state_(new (std::nothrow) State) {}
GpuManifoldQuery::GpuManifoldQuery(GpuManifoldQuery&&) noexcept = default;
GpuManifoldQuery& GpuManifoldQuery::operator=(GpuManifoldQuery&&) noexcept = default;
GpuManifoldQuery::~GpuManifoldQuery() = default;

Status GpuManifoldQuery::set_assets(std::span<const GpuAsset> assets, cudaStream_t stream) {
  return state_ != nullptr ? state_->set_assets(assets, stream) : Status::kOutOfMemory;
}

Status GpuManifoldQuery::reserve(const GpuManifoldCapacity& wanted) {
  if (wanted.pairs >= kMost / 2 || wanted.contacts >= kMost || wanted.manifolds >= kMost ||
      wanted.points >= kMost)
    return Status::kOutOfRange;
  Status status = state_->reserve_pairs(wanted.pairs);
  if (status == Status::kOk) status = state_->reserve_contacts(wanted.contacts);
  if (status == Status::kOk) status = state_->reserve_manifolds(wanted.manifolds);
  return status == Status::kOk ? state_->reserve_points(wanted.points) : status;
}

Status GpuManifoldQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                                 const GpuContactQuery& query, const GpuManifoldOptions& options,
                                 cudaStream_t stream) {
  const gpu::ManifoldArgs args = state_->args(instances, pairs, query, options);
  cudaError_t error = gpu::remember_points(args, stream);
  if (error == cudaSuccess) error = gpu::make_patches(args, stream);
  if (error == cudaSuccess) error = gpu::place_manifolds(args, stream);
  return state_->keep(error);
}

Status GpuManifoldQuery::make(const GpuInstances& instances, const GpuPairs& pairs,
                              const GpuContactQuery& query, const GpuManifoldOptions& options,
                              cudaStream_t stream) {
  GpuManifoldCapacity wanted = capacity();
  wanted.pairs = std::max(wanted.pairs, pairs.capacity);
  wanted.contacts = std::max(wanted.contacts, query.report().contacts);
  for (;;) {
    Status status = reserve(wanted);
    if (status == Status::kOk) status = enqueue(instances, pairs, query, options, stream);
    if (status == Status::kOk) status = state_->keep(cudaStreamSynchronize(stream));
    if (status != Status::kOk) return status;
    if (report().status != Status::kOk) return report().status;
    if (report().complete != 0) return Status::kOk;
    if (query.report().complete == 0) return Status::kOutOfRange;
    wanted = report().needed;
  }
}

const Manifold* GpuManifoldQuery::manifolds() const {
  return state_->manifolds.data();
}

const ManifoldPoint* GpuManifoldQuery::points() const {
  return state_->points.data();
}

const GpuManifoldReport* GpuManifoldQuery::device_report() const {
  return &state_->state->report;
}

const GpuManifoldReport& GpuManifoldQuery::report() const {
  return *state_->report;
}

Status GpuManifoldQuery::forget_points(cudaStream_t stream) {
  return state_->keep(gpu::forget_last(state_->state.data(), stream));
}

GpuManifoldCapacity GpuManifoldQuery::capacity() const {
  return state_ != nullptr ? state_->capacity : GpuManifoldCapacity{};
}

std::size_t GpuManifoldQuery::bytes() const {
  if (state_ == nullptr) return 0;
  const State& s = *state_;
  return s.shapes.bytes() + s.state.bytes() + s.pieces.bytes() + s.normals.bytes() + s.curve.bytes() +
         s.order.bytes() + s.start.bytes() + s.curves.bytes() + s.summaries.bytes() + s.words.bytes() +
         s.of_pair.bytes() + s.tile_sums.bytes() + s.table.bytes() + s.begun.bytes() + s.patches.bytes() +
         s.next_of_pair.bytes() + s.manifolds.bytes() + s.manifolds_before.bytes() + s.entries.bytes() +
         s.points.bytes() + s.points_before.bytes();
}

cudaError_t GpuManifoldQuery::cuda_error() const {
  return state_ != nullptr ? state_->error : cudaSuccess;
}

}  // namespace tandem
