#include "dynamics/scene_contacts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <new>

#include "kernels/common/stopwatch.h"

namespace tandem::dynamics {

void require(Status status, const Scene& scene) {
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw QueryFailed{status, scene.where()};
}

void take_points(const ManifoldQuery& manifolds, std::span<const ObjectPair> pairs,
                 std::vector<ContactPoint>& points, ContactStatistics& statistics) {
  points.clear();
  statistics = {manifolds.counters(), 0, 0};
  for (const Manifold& manifold : manifolds.rows()) {
    const ObjectPair& pair = pairs[manifold.pair];
    statistics.area += std::fabs(dot(vector_of(manifold.area_vector), vector_of(manifold.normal)));
    statistics.depth = std::max(statistics.depth, manifold.depth);
    for (const ManifoldPoint& p : manifolds.points().subspan(manifold.first_point, manifold.point_count))
      points.push_back({pair.a, pair.b, vector_of(p.position), vector_of(p.normal), p.depth, p.id});
  }
}

void Threads::work_for(Scene& scene) const {
  require(share_threads(*workers_, count_, scene), scene);
}

// Remembered pairs may keep a gap, with which their boxes no longer meet.
std::span<const ObjectPair> ContactFinder::find_moved(Scene& scene, MovedQuery& moved,
                                                      std::span<const ObjectPair> meeting,
                                                      const Keeping& keeping) {
  pairs_.clear(), kept_.clear(), asked_.clear();
  const std::span<const ObjectPair> others = keeping.near ? std::span<const ObjectPair>() : meeting;
  std::ranges::set_union(others, keeping.remembered, std::back_inserter(pairs_));
  require(moved.find(scene, pairs_, {.tolerance = keeping.tolerance}), scene);
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (moved.kept_rows()[i] != kNoIndex) kept_.push_back(pairs_[i]);
  }
  if (!keeping.near) return moved.rows();
  std::vector<ObjectPair> near;
  std::ranges::set_difference(*keeping.near, kept_, std::back_inserter(near));
  std::ranges::set_union(moved.rows(), near, std::back_inserter(asked_));
  return asked_;
}

namespace {

class SceneContacts : public ContactFinder {
 public:
  SceneContacts(std::span<const AssetView> assets, const Threads& threads, const PairFilter* filter)
      : filter_(filter), threads_(threads) {
    threads_.work_for(scene_);
    require(scene_.set_assets(assets), scene_);
  }

  const std::vector<ContactPoint>& find(std::span<const Instance> bodies, std::span<const std::uint8_t> idle,
                                        const Keeping& keeping) override {
    Stopwatch stopwatch;
    report_ = {};
    motion_.assign(bodies.size(), Motion::moving);
    for (std::size_t i = 0; i < idle.size(); ++i) motion_[i] = idle[i] != 0 ? Motion::fixed : Motion::moving;
    require(scene_.place(bodies, with_motions(filter_, motion_)), scene_);
    report_.times.update = stopwatch.lap();
    if (!keeping.near) require(scene_.find_pairs(), scene_);
    const std::span<const ObjectPair> asked =
        find_moved(scene_, moved_, keeping.near ? std::span<const ObjectPair>() : scene_.pairs(), keeping);
    report_.times.broad_phase = stopwatch.lap();
    require(contacts_.find(scene_, asked, {}), scene_);
    report_.times.traversal = stopwatch.lap();
    // The cache remembers by itself what a point did in the step before.
    require(manifolds_.find(scene_, contacts_, kManifoldsOfStep), scene_);
    take_points(manifolds_, contacts_.pairs(), points_, report_.contacts);
    report_.times.generation = stopwatch.lap();
    report_.counters = contacts_.counters();
    report_.kept_pairs = kept_.size();
    return points_;
  }

  std::span<const PosedBodies> posed() const override { return moved_.posed(); }
  void resume(std::span<const PosedBodies> posed) override { require(moved_.resume(scene_, posed), scene_); }

 private:
  const PairFilter* filter_;
  Threads threads_;
  std::vector<Motion> motion_;
  Scene scene_;
  MovedQuery moved_;
  ContactQuery contacts_;
  ManifoldQuery manifolds_;
  std::vector<ContactPoint> points_;
};

}  // namespace

std::unique_ptr<ContactFinder> make_scene_contacts(std::span<const AssetView> assets, const Threads& threads,
                                                   const PairFilter* filter) {
  return std::make_unique<SceneContacts>(assets, threads, filter);
}

}  // namespace tandem::dynamics
