#pragma once
#include <span>
#include <vector>

#include "dynamics/contact_finder.h"
#include "dynamics/parallel/host_executor.h"
#include "dynamics/parallel/parallel_simulation.h"
#include "tandem/kernels/distance_query.h"

namespace tandem::dynamics {

/// Answers the questions of a parallel step by the queries of the CPU.
class HostQuestions {
 public:
  explicit HostQuestions(std::span<const AssetView> assets, const PairFilter* filter = nullptr)
      : filter_(filter) {
    require(scene_.set_assets(assets), scene_);
  }

  PairList near(const PosedList& bodies, const Motion* motion, double within) {
    place(bodies, motion);
    require(scene_.find_pairs(within), scene_);
    pairs_.assign(scene_.pairs().begin(), scene_.pairs().end());
    near_count_ = static_cast<std::uint32_t>(pairs_.size());
    pairs_.resize(most_pairs_);
    return {pairs_.data(), &near_count_, most_pairs_};
  }

  FoundManifolds manifolds(const PosedList& bodies, const PairList& pairs) {
    place(bodies, nullptr);
    require(contacts_.find(scene_, {pairs.pairs, std::min(*pairs.count, pairs.most)}, {}), scene_);
    require(manifolds_.find(scene_, contacts_, kManifoldsOfStep), scene_);
    manifold_count_ = static_cast<std::uint32_t>(manifolds_.rows().size());
    point_count_ = static_cast<std::uint32_t>(manifolds_.points().size());
    return {manifolds_.rows().data(), manifolds_.points().data(), &manifold_count_, &point_count_,
            manifold_count_};
  }

  const ObjectDistance* distances(const PosedList& bodies, const PairList& pairs, const double* reach,
                                  const DistanceTolerance& tolerance) {
    place(bodies, nullptr);
    const std::uint32_t count = std::min(*pairs.count, pairs.most);
    require(distances_.find(scene_, {pairs.pairs, count},
                            {.tolerance = tolerance, .reach_of_pair = {reach, count}}),
            scene_);
    return distances_.rows().data();
  }

  void forget_needs() {}
  void read_needs() {}
  Status make_room(bool& grew) {
    if (near_count_ > most_pairs_) most_pairs_ = near_count_, grew = true;
    return Status::kOk;
  }
  Status reserve(std::uint32_t, std::uint32_t pairs) {
    most_pairs_ = std::max(most_pairs_, pairs);
    return Status::kOk;
  }

 private:
  void place(const PosedList& bodies, const Motion* motion) {
    std::vector<Instance> instances(bodies.count);
    for (std::uint32_t i = 0; i < bodies.count; ++i) instances[i] = {bodies.asset[i], bodies.pose[i]};
    PairFilter filter = filter_ != nullptr && motion != nullptr ? *filter_ : PairFilter{};
    filter.motion = motion;
    require(scene_.place(instances, filter), scene_);
  }

  const PairFilter* filter_;
  Scene scene_;
  ContactQuery contacts_;
  ManifoldQuery manifolds_;
  DistanceQuery distances_;
  std::vector<ObjectPair> pairs_;
  std::uint32_t near_count_ = 0, most_pairs_ = 0, manifold_count_ = 0, point_count_ = 0;
};

}  // namespace tandem::dynamics
