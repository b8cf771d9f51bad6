#include "tandem/kernels/gpu_scene.h"

#include <algorithm>
#include <array>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include "kernels/geometry/pair_motion.h"
#include "kernels/scene/scene_state.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_containment_query.h"
#include "tandem/kernels/gpu_deformer.h"
#include "tandem/kernels/gpu_distance_query.h"
#include "tandem/kernels/gpu_excluded_pairs.h"
#include "tandem/kernels/gpu_impact_query.h"
#include "tandem/kernels/gpu_manifold_query.h"
#include "tandem/kernels/gpu_probe_query.h"
#include "tandem/kernels/gpu_tolerance_query.h"
#include "tandem/runtime/upload.h"

namespace tandem {
namespace {

constexpr cudaStream_t kStream = nullptr;

/// The memory that a question of a scene keeps on the GPU.
template <typename Query>
struct QueryMemory : DeviceMemory {
  Query query;
};

/// An asset that deforms.
struct DeformingAsset {
  GpuDeformer deformer;
  PositionTypes positions;
};

/// Positions of an asset on the GPU.
template <typename Real>
struct PositionsOnGpu {
  GpuArray<Real> positions;
  GpuArray<const Real*> place;  // of the positions
};

GpuPositions gpu_positions(const float* const* places) {
  return {.in_float32 = places};
}
GpuPositions gpu_positions(const double* const* places) {
  return {.in_float64 = places};
}

/// While it lives, a GPU is the current one, and memory comes from an allocator.
class Here {
 public:
  Here(int gpu, const Allocator& allocator) : scope_(allocator) {
    error_ = cudaGetDevice(&before_);
    if (error_ == cudaSuccess && before_ != gpu) error_ = cudaSetDevice(gpu);
  }
  ~Here() { static_cast<void>(cudaSetDevice(before_)); }
  Here(const Here&) = delete;
  Here& operator=(const Here&) = delete;

  Status status() const { return status_of(error_); }

 private:
  AllocatorScope scope_;
  int before_ = 0;
  cudaError_t error_;
};

class Gpu final : public SceneDevice {
 public:
  Gpu() {
    found_gpu_ = status_of(cudaGetDevice(&gpu_));
    state_bytes = sizeof(SceneState);
  }

  Status set_assets(SceneState& scene) override {
    assets_id_ = 0;
    const Here here(gpu_, allocator);
    deforming_.reset();
    Status status = found_gpu_ == Status::kOk ? here.status() : found_gpu_;
    if (status == Status::kOk) status = upload_assets(scene);
    if (status != Status::kOk) return scene.fail(status, 0);
    assets_id_ = scene.assets_id;
    version_ = scene.version - 1;
    return status;
  }

  Status deform(SceneState&, std::uint32_t asset, std::span<const float> positions) override {
    return deform(asset, PositionTypes::float32, positions, in_float32_);
  }
  Status deform(SceneState&, std::uint32_t asset, std::span<const double> positions) override {
    return deform(asset, PositionTypes::float32_and_float64, positions, in_float64_);
  }

  Status find_pairs(SceneState& scene, double reach, bool& fixed_kept, Buffer<ObjectPair>& pairs) override {
    const Here here(gpu_, allocator);
    Status status = take_bodies(scene);
    if (status == Status::kOk) status = keep_fixed(scene, fixed_kept);
    const GpuBroadPhaseOptions options = {.sorted = true, .filter = filter_, .within = reach};
    if (status == Status::kOk) status = broad_phase_.find_pairs(instances_, bounds(), options, kStream);
    if (status == Status::kOk) status = copy(broad_phase_.pairs().pairs, broad_phase_.report().found, pairs);
    return status;
  }

  Status find(SceneState& scene, const ContactOptions& options,
              const DeviceAnswer<Contact, ContactCounters>& found) override {
    const bool is_exact = options.mode == QueryMode::exact;
    const Status has_blocks = is_exact ? require_oriented_blocks(scene) : Status::kOk;
    GpuContactOptions on_gpu = {.mode = options.mode, .first_contact_only = options.first_contact_only};
    on_gpu.sorted = on_gpu.grouped = true;
    on_gpu.within = options.within;
    on_gpu.add_error_bounds = options.add_error_bounds;
    on_gpu.leave_out_rings = options.leave_out_rings;
    const auto find_contacts = [&](auto& query) {
      Status status = query.find_contacts(instances_, pairs_, on_gpu, kStream);
      if (status == Status::kOk) status = copy(query.contacts(), query.report().contacts, found.rows);
      return status;
    };
    // The query is asked of no pairs, too: manifolds that are kept may be made of these contacts.
    return ask<GpuContactQuery>(scene, found, has_blocks, find_contacts, scene.bodies.size() == 0);
  }

  Status find(SceneState& scene, const DistanceOptions& options,
              const DeviceAnswer<ObjectDistance, DistanceCounters>& found) override {
    GpuDistanceOptions on_gpu = {options.tolerance, options.reach};
    return ask<GpuDistanceQuery>(scene, found, Status::kOk, [&](auto& query) {
      Status status = upload(options.reach_of_pair, reach_of_pair_);
      if (!options.reach_of_pair.empty()) on_gpu.reach_of_pair = reach_of_pair_.data();
      if (status == Status::kOk) status = query.find_distances(instances_, pairs_, on_gpu, kStream);
      if (status == Status::kOk) status = copy(query.distances(), found.pairs.size(), found.rows);
      return status;
    });
  }

  Status find(SceneState& scene, const ToleranceOptions& options,
              const DeviceAnswer<PairVerdict, ToleranceCounters>& found) override {
    return ask<GpuToleranceQuery>(scene, found, require_oriented_blocks(scene), [&](auto& query) {
      Status status = query.decide(instances_, pairs_, options.tolerance, kStream);
      if (status == Status::kOk) status = copy(query.verdicts(), found.pairs.size(), found.rows);
      return status;
    });
  }

  Status find(SceneState& scene, const ClosestOptions& options,
              const DeviceAnswer<ClosestPoint, ClosestCounters>& found) override {
    GpuClosestOptions on_gpu;
    on_gpu.point_count = static_cast<std::uint32_t>(options.points.size());
    on_gpu.tolerance = options.tolerance;
    on_gpu.reach = options.reach;
    on_gpu.sides = options.sides;
    const auto upload_points = [&] { return upload_triples(options.points, points_on_gpu_, on_gpu.points); };
    return ask_probes(scene, found, on_gpu, options.points.empty(), upload_points, &GpuProbeQuery::closest);
  }

  Status find(SceneState& scene, const RayOptions& options,
              const DeviceAnswer<RayHit, RayCounters>& found) override {
    GpuRayOptions on_gpu;
    on_gpu.ray_count = static_cast<std::uint32_t>(options.origins.size());
    on_gpu.reach = options.reach;
    on_gpu.hits = options.hits;
    const auto upload_rays = [&] {
      const Status status = upload_triples(options.origins, points_on_gpu_, on_gpu.origins);
      return status == Status::kOk ? upload_triples(options.directions, directions_on_gpu_, on_gpu.directions)
                                   : status;
    };
    return ask_probes(scene, found, on_gpu, options.origins.empty(), upload_rays, &GpuProbeQuery::hits);
  }

  Status find(SceneState& scene, const ImpactOptions& options, bool finds_pairs,
              const DeviceAnswer<Impact, ImpactCounters>& found) override {
    GpuImpactOptions on_gpu;
    on_gpu.tolerance = options.tolerance;
    on_gpu.sorted = true;
    const auto find_impacts = [&](auto& query) {
      Status status = upload_motions(scene, options.motion);
      on_gpu.filter = filter_;
      const RigidMotion* const motions = motions_on_gpu_.data();
      if (status != Status::kOk) return status;
      status = finds_pairs ? query.find(instances_, motions, options.duration, on_gpu, kStream)
                           : query.find(instances_, motions, options.duration, pairs_, on_gpu, kStream);
      const std::uint32_t count = query.report().impacts;
      if (status == Status::kOk) status = copy(query.impacts(), count, found.rows);
      if (status == Status::kOk && finds_pairs) status = copy(query.pairs().pairs, count, found.pairs);
      return status;
    };
    if (finds_pairs) found.pairs.clear();
    const bool is_empty = finds_pairs ? scene.bodies.size() == 0 : found.pairs.size() == 0;
    return ask<GpuImpactQuery>(scene, found, require_oriented_blocks(scene), find_impacts, is_empty);
  }

  Status find(SceneState& scene, const ManifoldOptions& options, const MovedQuery* moved,
              const DeviceMemory& contacts, Buffer<ManifoldPoint>& points,
              const DeviceAnswer<Manifold, ManifoldCounters>& found) override {
    if (found.pairs.size() == 0) found.memory.reset();  // no points of before are found again
    points.clear();
    return ask<GpuManifoldQuery>(scene, found, Status::kOk, [&](auto& query) {
      const auto& query_of_contacts = query_of<GpuContactQuery>(contacts);
      GpuMoved on_gpu_moved = {};
      Status status = moved != nullptr ? upload_moved(scene, *moved, on_gpu_moved) : Status::kOk;
      if (status == Status::kOk)
        status = moved != nullptr ? query.make(instances_, on_gpu_moved, query_of_contacts, options, kStream)
                                  : query.make(instances_, pairs_, query_of_contacts, options, kStream);
      if (status == Status::kOk) status = copy(query.manifolds(), query.report().manifolds, found.rows);
      if (status == Status::kOk) status = copy(query.points(), query.report().points, points);
      return status;
    });
  }

  Status find(SceneState& scene, const DeviceMemory& contacts,
              const DeviceAnswer<Containment, ContainmentCounters>& found) override {
    const Status status = ask<GpuContainmentQuery>(scene, found, Status::kOk, [&](auto& query) {
      Status done = query.find(instances_, pairs_, query_of<GpuContactQuery>(contacts), kStream);
      if (done == Status::kOk) done = copy(query.contained(), query.report().contained, found.rows);
      return done;
    });
    found.counters = {found.pairs.size(), 0, 0};
    for (const Containment& row : found.rows.view()) {
      found.counters.inside += (row.flags & kInside) != 0;
      found.counters.outer_open += (row.flags & kOuterOpen) != 0;
    }
    return status;
  }

 private:
  template <typename Query>
  static const Query& query_of(const DeviceMemory& memory) {
    return static_cast<const QueryMemory<Query>&>(memory).query;
  }

  GpuAssetBounds bounds() const { return list_.records().bounds_of_all(); }

  // The CPU's copy of a deformed tree has none, but the GPU's has.
  Status require_oriented_blocks(SceneState& scene) const {
    for (std::size_t i = 0; i < assets_.size(); ++i) {
      if (assets_[i].tree.oriented_blocks == nullptr) return scene.fail(Status::kNoOrientedBlocks, i);
    }
    return Status::kOk;
  }

  Status upload_assets(SceneState& scene) {
    const std::size_t count = scene.assets.size();
    Buffer<AssetView> views;
    levels_.clear();
    if (!views.resize(count) || !assets_.resize(count)) return Status::kOutOfMemory;
    for (std::size_t i = 0; i < count; ++i) views[i] = scene.assets[i].view;
    if (const Status status = files_.upload(views.view(), Contents::all, kStream); status != Status::kOk)
      return status;
    for (std::size_t i = 0; i < count; ++i) {
      assets_[i] = gpu_asset(files_.level(i), views[i]);
      for (std::uint32_t l = 0; l < views[i].levels.size(); ++l) {
        if (!levels_.push(gpu_asset(files_.level(i, l), views[i], l))) return Status::kOutOfMemory;
      }
    }
    return list_.set(assets_.view(), PositionTypes::float32, kStream);
  }

  // Memory is taken first, so that an error leaves the asset as it is.
  template <typename Real>
  Status deform(std::uint32_t asset, PositionTypes types, std::span<const Real> positions,
                PositionsOnGpu<Real>& room) {
    const Here here(gpu_, allocator);
    Status status = here.status();
    if (status == Status::kOk) status = upload(positions, room.positions);
    const Real* const place = room.positions.data();
    if (status == Status::kOk) status = upload(std::span(&place, 1), room.place);
    if (status == Status::kOk) status = begin_to_deform(asset, types);
    return status == Status::kOk
               ? deforming_[asset]->deformer.deform(gpu_positions(room.place.data()), kStream)
               : status;
  }

  Status begin_to_deform(std::uint32_t asset, PositionTypes positions) {
    if (deforming_ == nullptr)
      deforming_.reset(new (std::nothrow) std::unique_ptr<DeformingAsset>[assets_.size()]);
    if (deforming_ == nullptr) return Status::kOutOfMemory;
    if (deforming_[asset] != nullptr &&
        (positions == PositionTypes::float32 || deforming_[asset]->positions == positions))
      return Status::kOk;
    std::unique_ptr<DeformingAsset> made(new (std::nothrow) DeformingAsset{{}, positions});
    if (made == nullptr) return Status::kOutOfMemory;
    GpuAssetRecords records = list_.records();
    records.positions = positions;
    const Status status = made->deformer.begin(assets_.view(), std::span(&asset, 1), records, kStream);
    if (status == Status::kOk) deforming_[asset] = std::move(made);
    return status;
  }

  // Copies the bodies where they have changed. Removed ones are in no group, and so in no pair.
  Status take_bodies(SceneState& scene) {
    if (version_ == scene.version) return Status::kOk;
    const std::size_t count = scene.instances.size();
    const bool any_removed = std::any_of(scene.instances.data(), scene.instances.data() + count,
                                         [](const Instance& instance) { return instance.asset == kNoIndex; });
    if (!asset_.resize(count) || !pose_.resize(count) || !is_there_.resize(any_removed ? count : 0))
      return Status::kOutOfMemory;
    if (any_removed && (!group_.resize(count) || !mask_.resize(count))) return Status::kOutOfMemory;
    const PairFilter filter = scene.filter();
    for (std::uint32_t i = 0; i < count; ++i) {
      const bool is_there = scene.is_body(i);
      asset_[i] = is_there ? scene.instances[i].asset : 0;
      pose_[i] = is_there ? scene.instances[i].pose : kIdentityPose;
      if (!any_removed) continue;
      is_there_[i] = is_there;
      group_[i] = !is_there ? 0 : filter.group != nullptr ? filter.group[i] : ~0u;
      mask_[i] = !is_there ? 0 : filter.mask != nullptr ? filter.mask[i] : ~0u;
    }
    Status status = upload(asset_.view(), asset_on_gpu_);
    if (status == Status::kOk) status = upload(pose_.view(), pose_on_gpu_);
    if (status == Status::kOk) status = upload(is_there_.view(), is_there_on_gpu_);
    instances_ = {asset_on_gpu_.data(), pose_on_gpu_.data(), static_cast<std::uint32_t>(count)};
    if (status == Status::kOk) status = excluded_.upload(filter.excluded, kStream);
    filter_ = {};
    filter_.excluded = excluded_.view();
    if (status == Status::kOk) status = upload(scene.columns.motion, motion_on_gpu_, filter_.motion);
    if (status == Status::kOk)
      status = upload(any_removed ? group_ : scene.columns.group, group_on_gpu_, filter_.group);
    if (status == Status::kOk)
      status = upload(any_removed ? mask_ : scene.columns.mask, mask_on_gpu_, filter_.mask);
    if (status == Status::kOk) status = upload(scene.columns.world, world_on_gpu_, filter_.world);
    if (status == Status::kOk) status = wait();
    if (status == Status::kOk) version_ = scene.version;
    return status;
  }

  // Queues a copy; room grows by half at least, for bodies that are added one by one.
  template <typename Entry>
  static Status upload(std::span<const Entry> entries, GpuArray<Entry>& room) {
    const cudaError_t error = room.grow(entries.size());
    return status_of(error == cudaSuccess ? room.upload(entries, kStream) : error);
  }
  template <typename Entry>
  static Status upload(const Buffer<Entry>& entries, GpuArray<Entry>& room, const Entry*& on_gpu) {
    const Status status = upload(entries.view(), room);
    on_gpu = entries.size() != 0 ? room.data() : nullptr;
    return status;
  }
  Status upload_triples(std::span<const std::array<double, 3>> triples, GpuArray<double>& room,
                        const double*& on_gpu) {
    const Status status = upload(std::span(triples.data()->data(), 3 * triples.size()), room);
    on_gpu = room.data();
    return status;
  }
  static Status wait() { return status_of(cudaStreamSynchronize(kStream)); }

  Status upload_pairs(std::span<const ObjectPair> pairs) {
    const auto count = static_cast<std::uint32_t>(pairs.size());
    Status status = upload(pairs, pair_on_gpu_);
    if (status == Status::kOk) status = upload(std::span<const std::uint32_t>(&count, 1), pair_count_);
    pairs_ = {pair_on_gpu_.data(), pair_count_.data(), count};
    return status == Status::kOk ? wait() : status;
  }

  // Uploads what a question about moved pairs found on the CPU; pairs_ are all of them.
  Status upload_moved(const SceneState& scene, const MovedQuery& moved, GpuMoved& on_gpu) {
    const std::size_t pairs = moved.pairs().size(), rows = moved.rows().size();
    if (!boxes_.resize(scene.assets.size()) || !moved_rows_.resize(pairs) || !row_of_moved_.resize(rows))
      return Status::kOutOfMemory;
    for (std::size_t i = 0; i < boxes_.size(); ++i)
      boxes_[i] = asset_box(scene.assets[i].lower, scene.assets[i].upper, scene.assets[i].origin);
    std::uint32_t row = 0;
    for (std::uint32_t i = 0; i < pairs; ++i) {
      moved_rows_[i] = row;
      if (moved.kept_rows()[i] == kNoIndex) row_of_moved_[row++] = i;
    }
    const GpuMovedCall call = {moved.call(), moved.call_before(), static_cast<std::uint32_t>(pairs - rows)};
    Status status = upload(moved.rows(), moved_pair_on_gpu_);
    if (status == Status::kOk) status = upload(std::span<const std::uint32_t>(&row, 1), moved_count_);
    if (status == Status::kOk) status = upload(moved.kept_rows(), kept_rows_on_gpu_);
    if (status == Status::kOk) status = upload(moved_rows_.view(), moved_rows_on_gpu_);
    if (status == Status::kOk) status = upload(row_of_moved_.view(), row_of_moved_on_gpu_);
    if (status == Status::kOk) status = upload(moved.posed(), posed_on_gpu_);
    if (status == Status::kOk) status = upload(boxes_.view(), boxes_on_gpu_);
    if (status == Status::kOk) status = upload(std::span<const GpuMovedCall>(&call, 1), call_on_gpu_);
    on_gpu = {pairs_,
              {moved_pair_on_gpu_.data(), moved_count_.data(), row},
              kept_rows_on_gpu_.data(),
              moved_rows_on_gpu_.data(),
              row_of_moved_on_gpu_.data(),
              posed_on_gpu_.data(),
              boxes_on_gpu_.data(),
              call_on_gpu_.data()};
    return status == Status::kOk ? wait() : status;
  }

  // The motion of a removed body, which may be anything, is not looked at.
  Status upload_motions(const SceneState& scene, std::span<const RigidMotion> motions) {
    if (!motions_.resize(motions.size())) return Status::kOutOfMemory;
    for (std::uint32_t i = 0; i < motions.size(); ++i)
      motions_[i] = scene.is_body(i) ? motions[i] : RigidMotion{};
    const Status status = upload(motions_.view(), motions_on_gpu_);
    return status == Status::kOk ? wait() : status;
  }

  Status keep_fixed(SceneState& scene, bool& fixed_kept) {
    const Motion* const begin = scene.columns.motion.data();
    const bool any_fixed = std::find(begin, begin + scene.columns.motion.size(), Motion::fixed) !=
                           begin + scene.columns.motion.size();
    if (any_fixed ? fixed_kept : !keeps_fixed_) return Status::kOk;
    Buffer<Motion> all_moving;
    if (!any_fixed && !all_moving.resize(instances_.count)) return Status::kOutOfMemory;
    std::fill_n(all_moving.data(), all_moving.size(), Motion::moving);
    const Status status = broad_phase_.keep_fixed(
        instances_, bounds(), (any_fixed ? scene.columns.motion : all_moving).view(), filter_.world, kStream);
    keeps_fixed_ = any_fixed;
    fixed_kept = any_fixed && status == Status::kOk;
    return status;
  }

  template <typename Row>
  static Status copy(const Row* from, std::uint64_t count, Buffer<Row>& to) {
    if (!to.resize(count)) return Status::kOutOfMemory;
    return status_of(download(from, std::span(to.data(), count), kStream));
  }

  // Asks a question about found.pairs by call(query), which copies the rows. has_blocks: whether the assets
  // have what it walks.
  template <typename Query, typename Row, typename Counters, typename Call>
  Status ask(SceneState& scene, const DeviceAnswer<Row, Counters>& found, Status has_blocks,
             const Call& call) {
    return ask<Query>(scene, found, has_blocks, call, found.pairs.size() == 0);
  }

  template <typename Query, typename Row, typename Counters, typename Call>
  Status ask(SceneState& scene, const DeviceAnswer<Row, Counters>& found, Status has_blocks, const Call& call,
             bool is_empty) {
    found.rows.clear();
    found.counters = {};
    if (has_blocks != Status::kOk || is_empty) return has_blocks;
    const Here here(gpu_, allocator);
    Status status = here.status();
    if (status == Status::kOk) status = take_bodies(scene);
    if (status == Status::kOk) status = upload_pairs(found.pairs.view());
    Query* query = nullptr;
    if (status == Status::kOk) status = provide(found.memory, query);
    if (status != Status::kOk) return scene.fail(status, 0);
    status = call(*query);
    std::uint64_t where = 0;
    if constexpr (requires { query->report().where; }) {
      if (query->report().status == status) where = query->report().where;
    }
    if (status != Status::kOk) return scene.fail(status, where);
    if constexpr (requires { found.counters = query->report().counters; })
      found.counters = query->report().counters;
    return status;
  }

  // Asks about points or rays, which upload() copies to where `on_gpu` says they are. rows: those of the
  // query.
  template <typename Row, typename Counters, typename Options, typename Upload>
  Status ask_probes(SceneState& scene, const DeviceAnswer<Row, Counters>& found, Options& on_gpu,
                    bool is_empty, const Upload& upload, const Row* (GpuProbeQuery::*rows)() const) {
    const auto call = [&](GpuProbeQuery& query) {
      on_gpu.looked_at = is_there_.size() != 0 ? is_there_on_gpu_.data() : nullptr;
      Status status = upload();
      if (status == Status::kOk) status = query.find(instances_, on_gpu, kStream);
      if (status == Status::kOk) status = copy((query.*rows)(), query.report().rows, found.rows);
      return status;
    };
    return ask<GpuProbeQuery>(scene, found, Status::kOk, call, is_empty);
  }

  // The query of a question, which knows these assets.
  template <typename Query>
  Status provide(std::unique_ptr<DeviceMemory>& memory, Query*& query) {
    constexpr bool takes_levels = std::is_same_v<Query, GpuToleranceQuery>;
    if (memory == nullptr || memory->assets_id != assets_id_) {
      auto* const made = new (std::nothrow) QueryMemory<Query>;
      memory.reset(made);
      if (made == nullptr) return Status::kOutOfMemory;
      const Status status = made->query.set_assets((takes_levels ? levels_ : assets_).view(), kStream);
      if (status != Status::kOk) {
        memory.reset();
        return status;
      }
      made->assets_id = assets_id_;
    }
    query = &static_cast<QueryMemory<Query>&>(*memory).query;
    if constexpr (!takes_levels) {
      if (deforming_ != nullptr) return query->follow(list_.records());  // the scene refuses float64
    }
    return Status::kOk;
  }

  int gpu_ = 0;
  Status found_gpu_;
  std::uint64_t assets_id_ = 0;  // of the scene's assets that are on the GPU
  std::uint64_t version_ = 0;    // of its bodies
  DeviceAssets files_;
  Buffer<GpuAsset> assets_, levels_;                              // the first level of each, and all
  GpuAssetList list_;                                             // of the first levels
  std::unique_ptr<std::unique_ptr<DeformingAsset>[]> deforming_;  // by asset; null: none ever deformed
  PositionsOnGpu<float> in_float32_;
  PositionsOnGpu<double> in_float64_;

  // The arrays that are copied, and their copies.
  Buffer<std::uint32_t> asset_, group_, mask_;
  Buffer<std::uint8_t> is_there_;  // of each body: 0 where it was removed; none where no body was
  Buffer<Pose> pose_;
  Buffer<RigidMotion> motions_;
  GpuArray<std::uint32_t> asset_on_gpu_, group_on_gpu_, mask_on_gpu_, world_on_gpu_, pair_count_;
  GpuArray<std::uint8_t> is_there_on_gpu_;
  GpuArray<double> points_on_gpu_, directions_on_gpu_, reach_of_pair_;
  GpuArray<Pose> pose_on_gpu_;
  GpuArray<Motion> motion_on_gpu_;
  GpuArray<RigidMotion> motions_on_gpu_;
  GpuArray<ObjectPair> pair_on_gpu_, moved_pair_on_gpu_;
  Buffer<AssetBox> boxes_;
  Buffer<std::uint32_t> moved_rows_, row_of_moved_;
  GpuArray<std::uint32_t> moved_count_, kept_rows_on_gpu_, moved_rows_on_gpu_, row_of_moved_on_gpu_;
  GpuArray<PosedBodies> posed_on_gpu_;
  GpuArray<AssetBox> boxes_on_gpu_;
  GpuArray<GpuMovedCall> call_on_gpu_;
  GpuExcludedPairs excluded_;
  GpuInstances instances_ = {};
  GpuPairs pairs_ = {};
  PairFilter filter_;

  GpuBroadPhase broad_phase_;
  bool keeps_fixed_ = false;
};

}  // namespace

SceneDevice* gpu_scene_device() {
  return new (std::nothrow) Gpu;
}

}  // namespace tandem
