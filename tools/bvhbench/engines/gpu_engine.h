#pragma once
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_stream.h"
#include "tandem/kernels/gpu_arrays.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_deformer.h"
#include "tandem/kernels/gpu_excluded_pairs.h"
#include "tandem/runtime/upload.h"

namespace tandem {

/// An array on the GPU, and one in pinned CPU memory that it is filled from.
template <typename Element>
struct StagedArray {
  PinnedArray<Element> staged;
  GpuArray<Element> on_gpu;

  /// Room for at least one element, so that there is an address.
  cudaError_t grow(std::size_t count) {
    const std::size_t room = count == 0 ? 1 : count;
    const cudaError_t error = staged.grow(room);
    return error == cudaSuccess ? on_gpu.grow(room) : error;
  }
  /// Queues the copy of the first `count`.
  cudaError_t upload(std::size_t count, cudaStream_t stream) {
    return on_gpu.upload({staged.data(), count}, stream);
  }
};

/// The shapes that deform, and where their positions lie.
struct DeformingShapes {
  GpuDeformer deformer;
  std::map<std::uint32_t, StagedArray<float>> positions;  ///< by shape
  StagedArray<const float*> places;                       ///< of these, null where a shape stays as it is
  std::function<void()> refit;                            ///< queues the call
};

/// Returns the error of a call that failed, which is not kOk. who: begins its text; step: what was being
/// done.
GpuError gpu_error(std::string_view who, Status status, cudaError_t error, const char* step);

/// Says what a question on a GPU takes of a scene.
struct GpuNeeds {
  Contents contents = Contents::all;  ///< of the shapes
  bool all_levels = false;            ///< of each shape, not its first alone
  bool finds_pairs = false;           ///< the question finds its pairs itself, without a broad phase before
  double within = 0;                  ///< how far apart the boxes of pairs may be
};

/// A scene on the current GPU, and the pairs of its bodies: what engines there share, whatever the question.
class GpuEngine : public Engine {
 public:
  void set_shapes(std::span<const AssetView> shapes) final;
  void update(std::span<const BodyPose> bodies) final;
  std::optional<double> deform(std::span<const BentShape> bent) final;
  void keep_fixed() final;
  std::span<const ObjectPair> find_pairs() final;

 protected:
  /// Throws GpuError where no GPU can be used.
  GpuEngine(std::string_view name, const GpuNeeds& needs);

  cudaStream_t stream() const { return stream_.get(); }
  std::span<const GpuAsset> shapes() const { return shapes_; }
  const GpuInstances& instances() const { return instances_; }
  /// The records of shapes() that a query follows; null where none ever deformed.
  GpuAssetRecords records() const {
    return deforming_.positions.empty() ? GpuAssetRecords{} : list_.records();
  }
  const RigidMotion* motion_on_gpu() const { return motions_.on_gpu.data(); }

  /// Throw what a call that failed calls for. `step`: what was done.
  void check(cudaError_t error, const char* step) const;
  void check(Status status, cudaError_t error, const char* step) const;
  /// Throws what the call of a query calls for, whose status may name an instance or a pair.
  template <typename Query>
  void check(Status status, const Query& query, const char* step) const {
    if (subject(status) != nullptr) require(status, query.report().where);
    check(status, query.cuda_error(), step);
  }

  /// Tells the query of shapes(), and of records().
  virtual void name_shapes() = 0;

  /// Uploads the filter, which is in GPU memory until the next call.
  const PairFilter& upload_filter();

  /// The name of the GPU, as its driver tells it.
  std::string gpu_name() const;

  /// Finds the pairs that the filter looks at, until there is room for all.
  void find_pairs_on_gpu(bool sorted);
  /// Queues that again.
  void enqueue_broad_phase(bool sorted);
  /// The pairs that were found, and how many there are.
  GpuPairs pairs_found() const { return broad_phase_.pairs(); }
  std::uint32_t count_found() const { return broad_phase_.report().count; }
  /// Returns whether these are all that find_pairs() found, which lie on the GPU already.
  bool are_on_gpu(std::span<const ObjectPair> pairs) const;

  /// Queues the copy of pairs.
  GpuPairs upload(std::span<const ObjectPair> pairs);

  /// Returns whether the broad phase finds the pairs that the question is about.
  bool has_broad_phase(const TimedQuery& asked) const {
    return asked.given == nullptr && !needs_.finds_pairs;
  }
  /// Uploads the pairs that are given, or finds them; none where the question does.
  GpuPairs pairs_of(const TimedQuery& asked, bool sorted);

  /// Captures what `work` queues. Result: replays the graph.
  std::function<void()> captured(const std::function<void()>& work);

  /// Runs what `run` queues, and tells the seconds from `begin` to `end`.
  void run_between(const GpuEvent& begin, const std::function<void()>& run, const GpuEvent& end) const;
  double seconds_between(const GpuEvent& begin, const GpuEvent& end) const;
  Seconds time_repeats(std::uint32_t repeats, const std::function<void()>& run) const;

  /// Tells what was taken of the GPU. bytes, bound: of the query alone, and what its rule and that of the
  /// broad phase say that both take at most; 0: there is no rule.
  GpuUse use(const TimedQuery& asked, std::size_t bytes, std::size_t bound) const;
  const GpuBroadPhase& broad_phase() const { return broad_phase_; }

 private:
  GpuAssetBounds bounds() const;
  std::span<const float> checked(const BentShape& bent) const;
  void begin_deforming();
  GpuBroadPhaseOptions broad_phase_options(bool sorted) const;
  template <typename Elements, typename Element, typename Get>
  void stage(const Elements& elements, StagedArray<Element>& array, const char* step, const Get& get);
  template <typename Element>
  const Element* upload_of_each(const Element* of_each, StagedArray<Element>& array);
  std::size_t scene_bytes(const TimedQuery& asked) const;

  GpuNeeds needs_;
  std::size_t free_at_start_ = 0;
  double upload_of_shapes_ = 0, upload_of_bodies_ = 0;  // seconds
  GpuStream stream_;
  DeviceAssets uploaded_;
  std::vector<GpuAsset> shapes_;
  std::uint32_t bounds_count_ = 0;
  StagedArray<AssetBounds> bounds_;
  GpuAssetList list_;  // once a shape deforms
  DeformingShapes deforming_;
  StagedArray<std::uint32_t> shape_of_, pair_count_;
  StagedArray<Pose> poses_;
  StagedArray<RigidMotion> motions_;
  StagedArray<ObjectPair> given_pairs_;
  PinnedArray<ObjectPair> found_pairs_;
  GpuInstances instances_ = {};
  StagedArray<Motion> filter_motion_;
  StagedArray<std::uint32_t> group_, mask_, world_;
  GpuExcludedPairs excluded_;
  PairFilter filter_on_gpu_;
  GpuBroadPhase broad_phase_;
};

}  // namespace tandem
