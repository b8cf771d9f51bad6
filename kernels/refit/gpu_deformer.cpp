#include "tandem/kernels/gpu_deformer.h"

#include <algorithm>

#include "kernels/common/gpu_host.h"
#include "kernels/refit/refit_data.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem::gpu {
namespace {

// A thread block checks so many vertices at least; a body has no more checks than that, since each of its
// clusters looks at all.
constexpr std::uint64_t kVerticesAtLeast = 1024, kMostChecks = 64;

std::uint32_t checks_of(std::uint64_t vertices) {
  const std::uint64_t parts = (vertices + kVerticesAtLeast - 1) / kVerticesAtLeast;
  return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(parts, 1, kMostChecks));
}

/// The place of a plan among those of other trees.
struct PlannedTree {
  const Triangle* triangles;
  RefitPlan plan;
};

/// This is a level in CPU memory, as far as plans need it.
struct DownloadedLevel {
  LevelView level;
  Buffer<Triangle> triangles;
  Buffer<TriangleTopology> topology;
  Buffer<std::uint32_t> source_vertices;
  Buffer<OrientedBlock> oriented;
  Buffer<Block> blocks;
};

}  // namespace

template <>
struct HostOf<GpuDeformReport> : GpuHost<DeformState, GpuDeformReport> {
  RoomArray<Triangle> triangles{*this};
  RoomArray<PreciseCorners> precise{*this};
  RoomArray<Block> blocks{*this};
  RoomArray<OrientedBlock> oriented{*this};
  RoomArray<Box> roots{*this};
  RoomArray<PositionCheck> checks{*this};
  RoomArray<CornerSource> corners{*this};
  RoomArray<RefitBlock> refit_blocks{*this};
  RoomArray<RefitCluster> clusters{*this};
  RoomArray<std::uint16_t> height_ends{*this};
  RoomArray<std::uint32_t> inputs{*this};
  RoomArray<RefitWork> work{*this};
  RoomArray<DeformingBody> on_gpu{*this};
  Buffer<LevelView> levels;  // of the bodies
  DeformArgs args = {};

  // begin() makes these on the way.
  Buffer<DeformingBody> bodies;
  Buffer<PlannedTree> planned;  // each tree once
  Buffer<std::uint32_t> plan_of;
  RefitPlans plans;

  Status begin(std::span<const GpuAsset> assets, std::span<const std::uint32_t> deforming,
               const GpuAssetRecords& records, cudaStream_t stream) {
    args = {};
    levels.clear();
    Status status = provide_fixed_memory();
    for (const std::uint32_t number : deforming) {
      if (number >= assets.size() || number >= records.count) return Status::kUnknownAsset;
      if (assets[number].tree.source_vertices == nullptr) return Status::kNoSourceVertices;
    }
    if (status == Status::kOk) status = make_plans(assets, deforming, stream);
    const bool takes_float64 = records.positions == PositionTypes::float32_and_float64;
    if (status == Status::kOk) status = copy_trees(assets, deforming, takes_float64, stream);
    if (status == Status::kOk) status = upload_plans(stream);
    if (status == Status::kOk) status = list_work(stream);
    if (status == Status::kOk) status = write_records(assets, deforming, records, stream);
    if (status == Status::kOk) {
      args.records = records;
      args.body_count = static_cast<std::uint32_t>(deforming.size());
      args.state = state.data();
      args.host_report = report.data();
      args.limits = limits;
    } else {
      levels.clear();
    }
    forget_plans();
    return status;
  }

  void forget_plans() {
    bodies = {}, planned = {}, plan_of = {};
    plans.corners = {}, plans.blocks = {}, plans.clusters = {}, plans.height_ends = {}, plans.inputs = {};
  }

  template <typename Element>
  Status take_back(const Element*& elements, std::size_t count, Buffer<Element>& copy, cudaStream_t stream) {
    if (!copy.resize(count)) return Status::kOutOfMemory;
    const Status status = keep(download<Element>(elements, {copy.data(), count}, stream));
    elements = copy.data();
    return status;
  }

  Status make_plan(const LevelView& on_gpu_level, RefitPlan& plan, cudaStream_t stream) {
    DownloadedLevel at;
    at.level = on_gpu_level;
    LevelView& level = at.level;
    Status status = take_back(level.triangles, level.triangle_count, at.triangles, stream);
    if (status == Status::kOk) status = take_back(level.topology, level.triangle_count, at.topology, stream);
    if (status == Status::kOk)
      status = take_back(level.source_vertices, level.vertex_count, at.source_vertices, stream);
    if (status == Status::kOk && level.oriented_blocks != nullptr)
      status = take_back(level.oriented_blocks, level.block_count, at.oriented, stream);
    if (status == Status::kOk && level.oriented_blocks == nullptr)
      status = take_back(level.blocks, level.block_count, at.blocks, stream);
    return status == Status::kOk ? plans.add(level, plan) : status;
  }

  // Bodies of one tree share its plan; they mostly follow each other.
  Status make_plans(std::span<const GpuAsset> assets, std::span<const std::uint32_t> deforming,
                    cudaStream_t stream) {
    for (const std::uint32_t number : deforming) {
      const LevelView& tree = assets[number].tree;
      std::uint32_t plan = static_cast<std::uint32_t>(planned.size());
      while (plan > 0 && planned[plan - 1].triangles != tree.triangles) --plan;
      if (plan == 0) {
        PlannedTree added = {tree.triangles, {}};
        const Status status = make_plan(tree, added.plan, stream);
        if (status != Status::kOk) return status;
        if (!planned.push(added)) return Status::kOutOfMemory;
        plan = static_cast<std::uint32_t>(planned.size());
      }
      if (!plan_of.push(plan - 1)) return Status::kOutOfMemory;
    }
    return Status::kOk;
  }

  Status reserve_trees(std::span<const GpuAsset> assets, std::span<const std::uint32_t> deforming,
                       bool takes_float64) {
    std::size_t triangle_count = 0, block_count = 0, oriented_count = 0, root_count = 0, check_count = 0;
    for (std::size_t i = 0; i < deforming.size(); ++i) {
      const GpuAsset& asset = assets[deforming[i]];
      triangle_count += asset.tree.triangle_count;
      block_count += asset.tree.blocks != nullptr ? asset.tree.block_count : 0;
      oriented_count += asset.tree.oriented_blocks != nullptr ? asset.tree.block_count : 0;
      root_count += planned[plan_of[i]].plan.roots;
      check_count += checks_of(asset.source_vertices);
    }
    Status status = keep(triangles.reserve(triangle_count));
    if (status == Status::kOk) status = keep(precise.reserve(takes_float64 ? triangle_count : 0));
    if (status == Status::kOk) status = keep(blocks.reserve(block_count));
    if (status == Status::kOk) status = keep(oriented.reserve(oriented_count));
    if (status == Status::kOk) status = keep(roots.reserve(root_count));
    return status == Status::kOk ? keep(checks.reserve(check_count)) : status;
  }

  // Copies some elements of a tree, if it has any, to the next place; result: that place, or null.
  template <typename Element>
  Element* copied(const Element* from, std::size_t count, Element*& next, Status& status,
                  cudaStream_t stream) {
    if (from == nullptr || status != Status::kOk) return nullptr;
    Element* const to = next;
    next += count;
    status = keep(cudaMemcpyAsync(to, from, count * sizeof(Element), cudaMemcpyDeviceToDevice, stream));
    return to;
  }

  Status copy_trees(std::span<const GpuAsset> assets, std::span<const std::uint32_t> deforming,
                    bool takes_float64, cudaStream_t stream) {
    Status status = reserve_trees(assets, deforming, takes_float64);
    if (status == Status::kOk && (!levels.resize(deforming.size()) || !bodies.resize(deforming.size())))
      status = Status::kOutOfMemory;
    Triangle* next_triangle = triangles.data();
    Block* next_block = blocks.data();
    OrientedBlock* next_oriented = oriented.data();
    Box* next_root = roots.data();
    PositionCheck* next_check = checks.data();
    for (std::size_t i = 0; i < deforming.size() && status == Status::kOk; ++i) {
      const GpuAsset& asset = assets[deforming[i]];
      const LevelView& rest = asset.tree;
      DeformingBody body = {};
      if (takes_float64) body.precise = precise.data() + (next_triangle - triangles.data());
      body.triangles = copied(rest.triangles, rest.triangle_count, next_triangle, status, stream);
      body.blocks = copied(rest.blocks, rest.block_count, next_block, status, stream);
      body.oriented = copied(rest.oriented_blocks, rest.block_count, next_oriented, status, stream);
      body.roots = next_root;
      body.checks = next_check;
      body.vertices = asset.source_vertices;
      body.check_count = checks_of(asset.source_vertices);
      body.asset = deforming[i];
      next_root += planned[plan_of[i]].plan.roots;
      next_check += body.check_count;
      bodies[i] = body;
      levels[i] = rest;
      levels[i].triangles = body.triangles;
      levels[i].precise = body.precise;
      levels[i].blocks = body.blocks;
      levels[i].oriented_blocks = body.oriented;
    }
    return status;
  }

  Status upload_plans(cudaStream_t stream) {
    Status status = keep(corners.upload(plans.corners.view(), stream));
    if (status == Status::kOk) status = keep(refit_blocks.upload(plans.blocks.view(), stream));
    if (status == Status::kOk) status = keep(clusters.upload(plans.clusters.view(), stream));
    if (status == Status::kOk) status = keep(height_ends.upload(plans.height_ends.view(), stream));
    if (status == Status::kOk) status = keep(inputs.upload(plans.inputs.view(), stream));
    for (std::size_t i = 0; i < bodies.size() && status == Status::kOk; ++i)
      bodies[i].corners = corners.data() + planned[plan_of[i]].plan.first_corner;
    if (status == Status::kOk) status = keep(on_gpu.upload(bodies.view(), stream));
    args.bodies = on_gpu.data();
    args.blocks = refit_blocks.data();
    args.clusters = clusters.data();
    args.height_ends = height_ends.data();
    args.inputs = inputs.data();
    return status == Status::kOk ? keep(cudaStreamSynchronize(stream)) : status;
  }

  // Lists what thread blocks do: the checks, then the clusters of each round, body by body.
  Status list_work(cudaStream_t stream) {
    Buffer<RefitWork> list;
    for (std::uint32_t i = 0; i < bodies.size(); ++i) {
      args.rounds = std::max(args.rounds, planned[plan_of[i]].plan.rounds);
      for (std::uint32_t check = 0; check < bodies[i].check_count; ++check) {
        if (!list.push({i, check})) return Status::kOutOfMemory;
      }
    }
    for (std::uint32_t round = 0; round <= args.rounds; ++round) {
      if (list.size() >= std::size_t{1} << 31) return Status::kOutOfRange;
      args.work_end[round] = static_cast<std::uint32_t>(list.size());
      for (std::uint32_t i = 0; i < bodies.size() && round < args.rounds; ++i) {
        const RefitPlan& plan = planned[plan_of[i]].plan;
        if (round >= plan.rounds) continue;
        for (std::uint32_t c = plan.first_cluster[round]; c < plan.first_cluster[round + 1]; ++c) {
          if (!list.push({i, c})) return Status::kOutOfMemory;
        }
      }
    }
    Status status = keep(work.upload(list.view(), stream));
    args.work = work.data();
    return status == Status::kOk ? keep(cudaStreamSynchronize(stream)) : status;
  }

  // Runs of bodies that follow each other in the list of assets are copied at once.
  Status write_records(std::span<const GpuAsset> assets, std::span<const std::uint32_t> deforming,
                       const GpuAssetRecords& records, cudaStream_t stream) {
    Buffer<GpuAsset> run;
    if (!run.resize(deforming.size())) return Status::kOutOfMemory;
    for (std::size_t i = 0; i < deforming.size(); ++i) {
      run[i] = assets[deforming[i]];
      run[i].tree = levels[i];
      run[i].tree.precise = nullptr;  // in the file's shape
    }
    for (std::size_t i = 0, end = 0; i < deforming.size(); i = end) {
      for (end = i + 1; end < deforming.size() && deforming[end] == deforming[end - 1] + 1;) ++end;
      const Status status =
          keep(cudaMemcpyAsync(records.assets + deforming[i], run.data() + i, (end - i) * sizeof(GpuAsset),
                               cudaMemcpyHostToDevice, stream));
      if (status != Status::kOk) return status;
    }
    return keep(cudaStreamSynchronize(stream));
  }
};

}  // namespace tandem::gpu

namespace tandem {

Status GpuAssetList::set(std::span<const GpuAsset> assets, PositionTypes positions, cudaStream_t stream) {
  records_ = {};
  if (assets.size() >= kNoIndex) return Status::kOutOfRange;
  Buffer<AssetBounds> bounds;
  if (!bounds.resize(assets.size())) return Status::kOutOfMemory;
  for (std::size_t i = 0; i < assets.size(); ++i) bounds[i] = asset_bounds(assets[i]);
  cudaError_t error = assets_.upload(assets, stream);
  if (error == cudaSuccess) error = bounds_.upload(bounds.view(), stream);
  if (error == cudaSuccess) error = cudaStreamSynchronize(stream);
  if (error != cudaSuccess) return status_of(error);
  records_ = {assets_.data(), bounds_.data(), static_cast<std::uint32_t>(assets.size()), positions};
  return Status::kOk;
}

GpuDeformer::GpuDeformer() : host_(new (std::nothrow) gpu::HostOf<GpuDeformReport>) {}
GpuDeformer::GpuDeformer(GpuDeformer&&) noexcept = default;
GpuDeformer& GpuDeformer::operator=(GpuDeformer&&) noexcept = default;
GpuDeformer::~GpuDeformer() = default;

Status GpuDeformer::begin(std::span<const GpuAsset> assets, std::span<const std::uint32_t> bodies,
                          const GpuAssetRecords& records, cudaStream_t stream) {
  return host_ != nullptr ? host_->begin(assets, bodies, records, stream) : Status::kOutOfMemory;
}

Status GpuDeformer::enqueue(const GpuPositions& positions, cudaStream_t stream) {
  if (host_ == nullptr) return Status::kOutOfMemory;
  if (host_->args.body_count == 0) return Status::kOk;
  if (positions.in_float64 != nullptr && host_->args.records.positions == PositionTypes::float32)
    return Status::kNotFloat32;
  gpu::DeformArgs args = host_->args;
  args.positions = positions;
  return host_->keep(gpu::refit_bodies(args, stream));
}

Status GpuDeformer::deform(const GpuPositions& positions, cudaStream_t stream) {
  Status status = enqueue(positions, stream);
  if (status == Status::kOk) status = host_->keep(cudaStreamSynchronize(stream));
  return status == Status::kOk && bodies() != 0 ? report().status : status;
}

std::uint32_t GpuDeformer::bodies() const {
  return host_ != nullptr ? host_->args.body_count : 0;
}

LevelView GpuDeformer::level(std::uint32_t body) const {
  return host_->levels[body];
}

const GpuDeformReport* GpuDeformer::device_report() const {
  return host_->device_report();
}

const GpuDeformReport& GpuDeformer::report() const {
  return *host_->report;
}

std::size_t GpuDeformer::bytes() const {
  return host_ != nullptr ? host_->bytes() : 0;
}

cudaError_t GpuDeformer::cuda_error() const {
  return host_ != nullptr ? host_->error : cudaSuccess;
}

}  // namespace tandem
