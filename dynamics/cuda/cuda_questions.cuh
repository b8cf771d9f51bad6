#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/cuda/cuda_executor.cuh"
#include "dynamics/parallel/bytes_of.h"
#include "dynamics/parallel/pair_step.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/gpu_distance_query.h"
#include "tandem/kernels/gpu_excluded_pairs.h"
#include "tandem/kernels/gpu_manifold_query.h"

namespace tandem::dynamics {

/// What the questions of a step had too little room for, or what was wrong: of all calls, since a query
/// reports the last one alone.
struct QuestionNeeds {
  Status status;  ///< the first that is not kOk
  std::uint64_t where;
  GpuBroadPhaseCapacity near;
  GpuContactCapacity contacts;
  GpuManifoldCapacity manifolds;
  GpuDistanceCapacity distances;
};

/// Sums over the questions about contacts of a step.
struct FoundCounts {
  ContactCounters contacts;
  ManifoldCounters manifolds;
};

namespace cuda_questions_detail {

template <typename Number>
__device__ void raise(Number& of, Number to) {
  if (of < to) of = to;
}

template <typename Report>
__device__ bool blames(QuestionNeeds& needs, const Report& report) {
  if (needs.status == Status::kOk && report.status != Status::kOk)
    needs.status = report.status, needs.where = report.where;
  return report.status != Status::kOk;
}

struct TakeNear {
  const GpuBroadPhaseReport* report;
  QuestionNeeds* needs;
  __device__ void operator()() const {
    if (!blames(*needs, *report) && report->complete == 0) raise(needs->near.pairs, report->count);
  }
};

struct TakeManifolds {
  const GpuContactReport* contacts;
  const GpuManifoldReport* manifolds;
  QuestionNeeds* needs;
  FoundCounts* found;
  __device__ void operator()() const {
    if (blames(*needs, *contacts)) return;
    if (contacts->complete == 0) {
      raise(needs->contacts.pairs, contacts->needed.pairs);
      raise(needs->contacts.contacts, contacts->needed.contacts);
      raise(needs->contacts.undecided, contacts->needed.undecided);
      return;
    }
    if (needs->status == Status::kOk) needs->status = manifolds->status;
    if (manifolds->complete != 0) return count();
    raise(needs->manifolds.pairs, manifolds->needed.pairs);
    raise(needs->manifolds.contacts, manifolds->needed.contacts);
    raise(needs->manifolds.manifolds, manifolds->needed.manifolds);
    raise(needs->manifolds.points, manifolds->needed.points);
  }
  __device__ void count() const {
    found->contacts.object_pairs += contacts->counters.object_pairs;
    found->contacts.block_pairs += contacts->counters.block_pairs;
    found->contacts.candidates += contacts->counters.candidates;
    found->contacts.contacts += contacts->counters.contacts;
    found->manifolds.segments += manifolds->counters.segments;
    found->manifolds.manifolds += manifolds->counters.manifolds;
    found->manifolds.open_curves += manifolds->counters.open_curves;
  }
};

struct TakeDistances {
  const GpuDistanceReport* report;
  QuestionNeeds* needs;
  __device__ void operator()() const {
    if (blames(*needs, *report) || report->complete != 0) return;
    raise(needs->distances.pairs, report->needed.pairs);
    raise(needs->distances.block_pairs, report->needed.block_pairs);
    raise(needs->distances.triangle_pairs, report->needed.triangle_pairs);
    raise(needs->distances.settled, report->needed.settled);
    raise(needs->distances.words, report->needed.words);
  }
};

struct ClearFound {
  FoundCounts* found;
  __device__ void operator()() const { *found = {}; }
};

struct Clear {
  QuestionNeeds* needs;
  __device__ void operator()() const { *needs = {}; }
};

}  // namespace cuda_questions_detail

/// Answers the questions of a parallel step by the queries of the GPU, behind what the executor has queued.
class CudaQuestions {
 public:
  explicit CudaQuestions(CudaExecutor& executor) : to_(executor) {}

  /// assets: what they point to must outlive the questions.
  Status set_assets(std::span<const GpuAsset> assets) {
    std::vector<AssetBounds> bounds;
    for (const GpuAsset& asset : assets) bounds.push_back(asset_bounds(asset));
    Status status = status_of(bounds_.upload(bounds, to_.stream()));
    if (status == Status::kOk) status = to_.wait();
    bounds_count_ = static_cast<std::uint32_t>(bounds.size());
    if (status == Status::kOk) status = status_of(needs_.reserve(1));
    if (status == Status::kOk) status = status_of(found_.reserve(1));
    if (status == Status::kOk) status = contacts_.set_assets(assets, to_.stream());
    if (status == Status::kOk) status = manifolds_.set_assets(assets, to_.stream());
    if (status == Status::kOk) status = distances_.set_assets(assets, to_.stream());
    return status;
  }

  /// filter: in GPU memory; its motions are not looked at.
  void set_filter(const PairFilter& filter) { filter_ = filter; }

  std::uint64_t where() const { return where_; }

  /// Returns what all questions of the last step found.
  const FoundCounts& found() const { return read_found_; }

  /// Returns the first error of a call of CUDA that a query has met.
  cudaError_t error() const {
    for (const cudaError_t error :
         {near_.cuda_error(), contacts_.cuda_error(), manifolds_.cuda_error(), distances_.cuda_error()}) {
      if (error != cudaSuccess) return error;
    }
    return cudaSuccess;
  }

  /// Returns the GPU memory held.
  std::size_t bytes() const { return bytes_of(bounds_, needs_, near_, contacts_, manifolds_, distances_); }

  Status reserve(std::uint32_t bodies, std::uint32_t pairs) {
    bodies_ = bodies;
    // Nothing is asked about most pairs that are near.
    QuestionNeeds needs = {};
    needs.near.pairs = needs.contacts.pairs = needs.manifolds.pairs = needs.distances.pairs = pairs;
    needs.contacts.contacts = std::max(std::uint64_t{1} << 18, 4 * std::uint64_t{pairs});
    needs.contacts.undecided = std::uint64_t{1} << 16;
    needs.manifolds.contacts = needs.contacts.contacts;
    needs.manifolds.manifolds = std::max(1u << 12, pairs / 2);
    needs.manifolds.points = std::max(1u << 14, 2 * pairs);
    needs.distances.block_pairs = std::max(1u << 18, 8 * pairs);
    needs.distances.triangle_pairs = std::max(1u << 16, 2 * pairs);
    needs.distances.settled = std::max(1u << 14, pairs / 2);
    needs.distances.words = kFewWords;
    return provide(needs);
  }

  /// Is the first question of a step.
  PairList near(const PosedList& bodies, const Motion* motion, double within) {
    to_.once(cuda_questions_detail::ClearFound{found_.data()});
    GpuBroadPhaseOptions options = kNearOptions;
    options.filter = filter_, options.filter.motion = motion, options.within = within;
    take(near_.enqueue({bodies.asset, bodies.pose, bodies.count}, {bounds_.data(), bounds_count_}, options,
                       to_.stream()));
    to_.once(cuda_questions_detail::TakeNear{near_.device_report(), needs_.data()});
    const GpuPairs pairs = near_.pairs();
    return {pairs.pairs, pairs.count, pairs.capacity};
  }

  FoundManifolds manifolds(const PosedList& bodies, const PairList& pairs) {
    const GpuInstances instances = {bodies.asset, bodies.pose, bodies.count};
    const GpuPairs on_gpu = {pairs.pairs, pairs.count, pairs.most};
    take(contacts_.enqueue(instances, on_gpu, kContactOptions, to_.stream()));
    take(manifolds_.enqueue(instances, on_gpu, contacts_, kManifoldsOfStep, to_.stream()));
    const GpuManifoldReport* const report = manifolds_.device_report();
    to_.once(cuda_questions_detail::TakeManifolds{contacts_.device_report(), report, needs_.data(),
                                                  found_.data()});
    return {manifolds_.manifolds(), manifolds_.points(), &report->manifolds, &report->points,
            manifolds_.capacity().manifolds};
  }

  const ObjectDistance* distances(const PosedList& bodies, const PairList& pairs, const double* reach,
                                  const DistanceTolerance& tolerance) {
    GpuDistanceOptions options;
    options.tolerance = tolerance, options.reach_of_pair = reach;
    take(distances_.enqueue({bodies.asset, bodies.pose, bodies.count}, {pairs.pairs, pairs.count, pairs.most},
                            options, to_.stream()));
    to_.once(cuda_questions_detail::TakeDistances{distances_.device_report(), needs_.data()});
    return distances_.distances();
  }

  void forget_needs() {
    status_ = Status::kOk;
    to_.once(cuda_questions_detail::Clear{needs_.data()});
  }

  /// Queues that the needs of the questions are read, for make_room() behind it.
  void read_needs() {
    to_.copy_later(needs_.data(), read_);
    to_.copy_later(found_.data(), read_found_);
  }

  Status make_room(bool& grew) {
    QuestionNeeds needs = read_;
    const Status status = std::exchange(needs.status, Status::kOk);
    const std::uint64_t where = std::exchange(needs.where, 0);
    const auto more = [](auto& number) { number += number / 2; };
    more(needs.near.pairs), more(needs.contacts.pairs), more(needs.contacts.contacts);
    more(needs.contacts.undecided), more(needs.manifolds.pairs), more(needs.manifolds.contacts);
    more(needs.manifolds.manifolds), more(needs.manifolds.points), more(needs.distances.pairs);
    more(needs.distances.block_pairs), more(needs.distances.triangle_pairs), more(needs.distances.settled);
    const QuestionNeeds none = {};
    // What follows from rows that had no room may be anything.
    if (std::memcmp(&needs, &none, sizeof needs) == 0) {
      where_ = where;
      return status_ != Status::kOk ? status_ : status;
    }
    grew = true;
    return provide(needs);
  }

 private:
  static constexpr GpuBroadPhaseOptions kNearOptions = {.sorted = true};
  static constexpr GpuContactOptions kContactOptions = {.grouped = true};

  void take(Status status) {
    if (status_ == Status::kOk) status_ = status;
  }

  // Makes room for at least so much of each.
  Status provide(const QuestionNeeds& wanted) {
    GpuBroadPhaseCapacity near = near_.capacity();
    near.boxes = near.instances = std::max(near.instances, bodies_);
    near.pairs = std::max(near.pairs, wanted.near.pairs);
    const auto largest = [](auto a, auto b) { return std::max(a, b); };
    GpuContactCapacity contacts = contacts_.capacity();
    contacts = {largest(contacts.pairs, wanted.contacts.pairs),
                largest(contacts.contacts, wanted.contacts.contacts),
                largest(contacts.undecided, wanted.contacts.undecided)};
    GpuManifoldCapacity manifolds = manifolds_.capacity();
    manifolds = {largest(manifolds.pairs, std::max(contacts.pairs, wanted.manifolds.pairs)),
                 largest(manifolds.contacts, std::max(contacts.contacts, wanted.manifolds.contacts)),
                 largest(manifolds.manifolds, wanted.manifolds.manifolds),
                 largest(manifolds.points, wanted.manifolds.points)};
    GpuDistanceCapacity distances = distances_.capacity();
    distances = {largest(distances.pairs, wanted.distances.pairs),
                 largest(distances.block_pairs, wanted.distances.block_pairs),
                 largest(distances.triangle_pairs, wanted.distances.triangle_pairs),
                 largest(distances.settled, wanted.distances.settled),
                 largest(distances.words, wanted.distances.words)};
    Status status = near_.reserve(near, kNearOptions);
    if (status == Status::kOk) status = contacts_.reserve(contacts, kContactOptions);
    if (status == Status::kOk) status = manifolds_.reserve(manifolds);
    if (status == Status::kOk) status = distances_.reserve(distances);
    return status;
  }

  CudaExecutor& to_;
  PairFilter filter_;
  QuestionNeeds read_ = {};
  FoundCounts read_found_;
  std::uint32_t bodies_ = 0, bounds_count_ = 0;
  std::uint64_t where_ = 0;
  Status status_ = Status::kOk;  // of what the CPU finds wrong
  GpuArray<AssetBounds> bounds_;
  GpuArray<QuestionNeeds> needs_;
  GpuArray<FoundCounts> found_;
  GpuBroadPhase near_;
  GpuContactQuery contacts_;
  GpuManifoldQuery manifolds_;
  GpuDistanceQuery distances_;
};

}  // namespace tandem::dynamics
