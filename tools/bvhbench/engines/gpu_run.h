#pragma once
#include <span>
#include <vector>

#include "engine.h"
#include "gpu_engine.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_excluded_pairs.h"

namespace tandem {

/// Bodies on the GPU and the pairs of them that a query is about, for queries that are run and timed there by
/// themselves. What it is given must stay. Throws GpuError, EngineError or std::bad_alloc.
class GpuRun {
 protected:
  GpuRun(std::span<const AssetView> shapes, std::span<const Instance> bodies,
         const std::vector<ObjectPair>* given, const PairFilter& filter, double reach);
  ~GpuRun() = default;

  void check(Status status, cudaError_t error, const char* step) const;
  void check(cudaError_t error, const char* step) const;
  /// The same of a status that names an instance or a pair, where it does.
  void require(Status status, cudaError_t error, std::uint64_t where, const char* step) const;

  template <typename Element>
  void upload(GpuArray<Element>& array, std::span<const Element> elements, const char* step) {
    check(array.upload(elements, stream_.get()), step);
  }

  void upload_shapes(Contents contents);
  /// The end of what is uploaded.
  void end_upload();

  /// Uploads the pairs that are given, or finds those whose boxes are within reach, sorted.
  void find_pairs();
  void enqueue_broad_phase();

  /// Times a replayed graph of the work.
  template <typename Work>
  Seconds time_repeats(std::uint32_t repeats, const Work& work) {
    GpuEvent begin, end;
    for (GpuEvent* event : {&begin, &end}) check(event->create(), "an event");
    GpuGraph graph;
    check(graph.capture(stream_.get(), work), "a graph");
    Seconds seconds;
    for (std::uint32_t i = 0; i < repeats; ++i) {
      check(begin.record(stream_.get()), "an event");
      check(graph.launch(stream_.get()), "a graph");
      check(end.record(stream_.get()), "an event");
      check(stream_.wait(), "the query");
      float milliseconds = 0;
      check(milliseconds_between(begin, end, milliseconds), "time");
      seconds.push_back(1e-3 * static_cast<double>(milliseconds));
    }
    return seconds;
  }

  /// bytes, bytes_bound: of the query alone.
  GpuUse use(std::size_t bytes, std::size_t bytes_bound) const;

  const std::span<const AssetView> shapes_;
  const std::vector<ObjectPair>* const given_;
  GpuStream stream_;
  DeviceAssets uploaded_;
  GpuInstances instances_ = {};
  GpuPairs pairs_ = {};
  std::uint32_t pair_count_ = 0;

 private:
  const std::span<const Instance> bodies_;
  const PairFilter filter_;
  const double reach_;
  Stopwatch watch_;
  std::size_t free_at_start_ = 0;
  double upload_seconds_ = 0;
  std::vector<AssetBounds> bounds_of_shape_;
  std::vector<std::uint32_t> shape_of_body_;
  std::vector<Pose> pose_of_body_;
  GpuArray<AssetBounds> bounds_of_;
  GpuArray<std::uint32_t> shape_of_, count_, group_, mask_;
  GpuArray<Pose> poses_;
  GpuArray<ObjectPair> given_on_gpu_;
  GpuArray<Motion> motion_;
  GpuExcludedPairs excluded_;
  GpuAssetBounds bounds_ = {};
  GpuBroadPhaseOptions near_pairs_;
  GpuBroadPhase broad_phase_;
};

}  // namespace tandem
