#include "tandem/kernels/gpu_containment_query.h"

#include <algorithm>
#include <new>

#include "kernels/containment/component_labels.h"
#include "kernels/containment/containment_data.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {

using containment::Surface;

struct GpuContainmentQuery::State {
  GpuArray<Surface> surfaces;
  GpuArray<std::uint32_t> labels;
  gpu::DeviceLimits limits = {};
  GpuArray<gpu::ContainmentState> state;
  PinnedArray<GpuContainmentReport> report;
  GpuArray<std::uint32_t> rows_of_pair, sums;
  GpuArray<gpu::FoundContainment> found;
  GpuArray<Containment> contained;
  GpuContainmentCapacity capacity;
  cudaError_t error = cudaSuccess;

  Status keep(cudaError_t result) {
    error = result;
    if (result != cudaSuccess) static_cast<void>(cudaGetLastError());  // later calls must not report it again
    return status_of(result);
  }
  Status provide_reports();
  Status make_surface(const GpuAsset& asset, std::uint32_t* labels_of_it, cudaStream_t stream, Surface& out);
  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream);
  Status reserve(const GpuContainmentCapacity& wanted);
};

Status GpuContainmentQuery::State::provide_reports() {
  Status status = keep(gpu::limits_of_device(limits));
  if (status == Status::kOk) status = keep(state.reserve(1));
  if (status != Status::kOk || report.data() != nullptr) return status;
  status = keep(report.reserve(1));
  if (status == Status::kOutOfGpuMemory) status = Status::kOutOfMemory;
  if (status == Status::kOk) *report = {};
  return status;
}

// labels_of_it: in CPU memory, to be filled where there is more than one component.
Status GpuContainmentQuery::State::make_surface(const GpuAsset& asset, std::uint32_t* labels_of_it,
                                                cudaStream_t stream, Surface& out) {
  LevelView level = asset.tree;
  out = {};
  out.triangles = level.triangles;
  out.blocks = level.blocks;
  out.oriented_blocks = level.oriented_blocks;
  out.components = level.components;
  out.triangle_count = level.triangle_count;
  out.component_count = level.component_count;
  out.closed = out.any_closed = level.closed;
  std::copy_n(asset.origin, 3, out.origin);
  std::copy_n(asset.lower, 3, out.lower);
  std::copy_n(asset.upper, 3, out.upper);
  out.farthest = farthest_of(asset.extent);
  if (level.component_count == 1) return Status::kOk;
  Buffer<TriangleTopology> topology;
  Buffer<SurfaceComponent> components;
  if (!topology.resize(level.triangle_count) || !components.resize(level.component_count))
    return Status::kOutOfMemory;
  Status status =
      keep(download<TriangleTopology>(level.topology, {topology.data(), topology.size()}, stream));
  if (status == Status::kOk)
    status =
        keep(download<SurfaceComponent>(level.components, {components.data(), components.size()}, stream));
  if (status != Status::kOk) return status;
  level.topology = topology.data(), level.components = components.data();
  for (const SurfaceComponent& component : components.view())
    out.any_closed = out.any_closed || is_closed(component);
  return containment::label_triangles(level, labels_of_it) ? Status::kOk : Status::kOutOfMemory;
}

Status GpuContainmentQuery::State::set_assets(std::span<const GpuAsset> assets, cudaStream_t stream) {
  std::size_t labelled = 0;
  for (const GpuAsset& asset : assets) {
    if (asset.tree.topology == nullptr) return Status::kNoTopology;
    if (asset.tree.component_count != 1) labelled += asset.tree.triangle_count;
  }
  Buffer<Surface> made;
  Buffer<std::uint32_t> made_labels;
  if (!made.resize(assets.size()) || !made_labels.resize(labelled)) return Status::kOutOfMemory;
  Status status = provide_reports();
  if (status == Status::kOk) status = keep(labels.reserve(labelled));
  std::size_t next = 0;
  for (std::size_t i = 0; i < assets.size() && status == Status::kOk; ++i) {
    status = make_surface(assets[i], made_labels.data() + next, stream, made[i]);
    if (assets[i].tree.component_count == 1) continue;
    made[i].labels = labels.data() + next;
    next += assets[i].tree.triangle_count;
  }
  if (status == Status::kOk) status = keep(labels.upload(made_labels.view(), stream));
  if (status == Status::kOk) status = keep(surfaces.upload(made.view(), stream));
  return status == Status::kOk ? keep(cudaStreamSynchronize(stream)) : status;
}

Status GpuContainmentQuery::State::reserve(const GpuContainmentCapacity& wanted) {
  Status status = Status::kOk;
  if (wanted.pairs > capacity.pairs || sums.room() == 0) {
    capacity.pairs = 0;
    status = keep(rows_of_pair.grow(wanted.pairs));
    if (status == Status::kOk) status = keep(sums.reserve(rows_of_pair.room() / gpu::kPairsPerSum + 1));
    if (status == Status::kOk) capacity.pairs = static_cast<std::uint32_t>(rows_of_pair.room());
  }
  if (status == Status::kOk && wanted.contained > capacity.contained) {
    capacity.contained = 0;
    status = keep(found.grow(wanted.contained));
    if (status == Status::kOk) status = keep(contained.reserve(found.room()));
    if (status == Status::kOk) capacity.contained = static_cast<std::uint32_t>(found.room());
  }
  return status;
}

GpuContainmentQuery::GpuContainmentQuery() : state_(new (std::nothrow) State) {}
GpuContainmentQuery::GpuContainmentQuery(GpuContainmentQuery&&) noexcept = default;
GpuContainmentQuery& GpuContainmentQuery::operator=(GpuContainmentQuery&&) noexcept = default;
GpuContainmentQuery::~GpuContainmentQuery() = default;

Status GpuContainmentQuery::set_assets(std::span<const GpuAsset> assets, cudaStream_t stream) {
  return state_ != nullptr ? state_->set_assets(assets, stream) : Status::kOutOfMemory;
}

Status GpuContainmentQuery::reserve(const GpuContainmentCapacity& capacity) {
  return state_->reserve(capacity);
}

Status GpuContainmentQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                                    const GpuContactQuery& query, cudaStream_t stream) {
  const State& s = *state_;
  const gpu::ContainmentArgs args = {
      s.surfaces.data(), instances,          pairs,           query.groups(),        query.device_report(),
      s.capacity,        s.state.data(),     s.report.data(), s.rows_of_pair.data(), s.sums.data(),
      s.found.data(),    s.contained.data(), s.limits};
  return state_->keep(gpu::find_contained(args, stream));
}

Status GpuContainmentQuery::find(const GpuInstances& instances, const GpuPairs& pairs,
                                 const GpuContactQuery& query, cudaStream_t stream) {
  GpuContainmentCapacity wanted = capacity();
  wanted.pairs = std::max(wanted.pairs, pairs.capacity);
  for (;;) {
    Status status = reserve(wanted);
    if (status == Status::kOk) status = enqueue(instances, pairs, query, stream);
    if (status == Status::kOk) status = state_->keep(cudaStreamSynchronize(stream));
    if (status != Status::kOk) return status;
    if (report().status != Status::kOk) return report().status;
    if (report().complete != 0) return Status::kOk;
    if (query.report().complete == 0) return Status::kOutOfRange;
    wanted = report().needed;
  }
}

const Containment* GpuContainmentQuery::contained() const {
  return state_->contained.data();
}

const GpuContainmentReport* GpuContainmentQuery::device_report() const {
  return &state_->state->report;
}

const GpuContainmentReport& GpuContainmentQuery::report() const {
  return *state_->report;
}

GpuContainmentCapacity GpuContainmentQuery::capacity() const {
  return state_ != nullptr ? state_->capacity : GpuContainmentCapacity{};
}

std::size_t GpuContainmentQuery::bytes() const {
  if (state_ == nullptr) return 0;
  const State& s = *state_;
  return s.surfaces.bytes() + s.labels.bytes() + s.state.bytes() + s.rows_of_pair.bytes() + s.sums.bytes() +
         s.found.bytes() + s.contained.bytes();
}

cudaError_t GpuContainmentQuery::cuda_error() const {
  return state_ != nullptr ? state_->error : cudaSuccess;
}

}  // namespace tandem
