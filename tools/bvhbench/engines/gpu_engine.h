#pragma once
#include <functional>
#include <string>
#include <vector>

#include "engine.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_stream.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_excluded_pairs.h"
#include "tandem/kernels/gpu_scene.h"
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

/// Throws what a call that failed calls for. name: of the engine; step: what was done.
void check_on_gpu(const std::string& name, Status status, cudaError_t error, const char* step);

/// Contacts in GPU memory.
struct GpuContacts {
  const Contact* data;
  std::size_t count;
};

/// A query behind Tandem's broad phase, both on the current GPU.
class GpuEngine : public Engine {
 public:
  std::string_view name() const final { return name_; }
  void set_shapes(std::span<const AssetView> shapes) final;
  void update(std::span<const BodyPose> bodies) final;
  void keep_fixed() final;
  std::span<const ObjectPair> find_pairs() final;
  void query(std::span<const ObjectPair> pairs) final;
  bool contacts(std::vector<TriangleContact>& found) final;

  /// The query runs until everything has room, then again for each repeat, timed by events.
  TimedAnswer time_query(const TimedQuery& asked) final;

 protected:
  /// contents: what it uploads of shapes; within: of clearance, how far apart the boxes of pairs may be.
  /// Throws GpuError where no GPU can be used.
  GpuEngine(std::string_view name, Contents contents, double within = 0);

  cudaStream_t stream() const { return stream_.get(); }
  std::span<const GpuAsset> shapes() const { return shapes_; }
  const GpuInstances& instances() const { return instances_; }

  /// Throw what a call that failed calls for. `step`: what was done.
  void check(cudaError_t error, const char* step) const;
  void check(Status status, cudaError_t error, const char* step) const;

  /// Tells the query of shapes().
  virtual void name_shapes() = 0;

  /// Finds the contacts of these pairs, of instances(), and waits for them.
  virtual void ask(const GpuPairs& pairs, OrderOnGpu order) = 0;

  /// What the last ask(), or repeat of it, found; sets counters_.
  virtual GpuContacts found() = 0;

  /// Queues on stream() what comes before a query: the pairs, and an event that is recorded with these flags.
  using Before = std::function<void(unsigned event_flags)>;

  /// What queues `before` and the query of these pairs once more. Conditions: ask() of the same went well;
  /// what `before` looks at stays.
  virtual std::function<void()> repeatable(const GpuPairs& pairs, OrderOnGpu order, const Before& before) = 0;

  /// The same with contact manifolds of what the query finds, behind `between`. Engines that have none throw.
  virtual std::function<void()> repeatable_with_manifolds(const GpuPairs& pairs, OrderOnGpu order,
                                                          const Before& before, const Before& between);

  /// What the last repeat of these made, their rows those of the GPU's pairs.
  virtual void take_manifolds(TimedManifolds&) {}

  /// Times the walk of the trees alone.
  virtual Seconds time_walk(const GpuPairs&, std::uint32_t) { return {}; }

  /// GPU memory of the query, and what its rule says it is at most; 0: there is no rule.
  virtual std::size_t query_bytes() const = 0;
  virtual std::size_t most_bytes(OrderOnGpu) const { return 0; }

  /// Runs what `run` queues, and tells the seconds from `begin` to `end`.
  void run_between(const GpuEvent& begin, const std::function<void()>& run, const GpuEvent& end) const;
  double seconds_between(const GpuEvent& begin, const GpuEvent& end) const;

 private:
  GpuAssetBounds bounds() const;
  GpuBroadPhaseOptions broad_phase_options(bool sorted) const;
  template <typename Element>
  const Element* upload_of_each(const Element* of_each, StagedArray<Element>& array);
  void upload_filter();
  void find_pairs_on_gpu(bool sorted);
  GpuPairs upload(std::span<const ObjectPair> pairs);
  void time_repeats(const GpuPairs& pairs, const TimedQuery& asked, TimedAnswer& answer);
  void take(const GpuPairs& pairs, const GpuContacts& contacts, OrderOnGpu order, TimedAnswer& answer) const;
  std::size_t scene_bytes(const TimedQuery& asked) const;
  GpuUse use(const TimedQuery& asked) const;

  std::string name_;
  Contents contents_;
  double within_;
  std::size_t free_at_start_ = 0;
  double upload_of_shapes_ = 0, upload_of_bodies_ = 0;  // seconds
  GpuStream stream_;
  DeviceAssets uploaded_;
  std::vector<GpuAsset> shapes_;
  StagedArray<AssetBounds> bounds_;
  StagedArray<std::uint32_t> shape_of_, pair_count_;
  StagedArray<Pose> poses_;
  StagedArray<ObjectPair> given_pairs_;
  PinnedArray<ObjectPair> found_pairs_;
  PinnedArray<Contact> contacts_;
  GpuInstances instances_ = {};
  StagedArray<Motion> motion_;
  StagedArray<std::uint32_t> group_, mask_;
  GpuExcludedPairs excluded_;
  PairFilter filter_on_gpu_;
  GpuBroadPhase broad_phase_;
};

}  // namespace tandem
