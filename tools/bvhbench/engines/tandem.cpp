#include <cmath>
#include <memory>
#include <type_traits>
#include <vector>

#include "engine.h"
#include "tandem/kernels/closest_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/moved_query.h"
#include "tandem/kernels/ray_query.h"

namespace tandem {
namespace {

/// The base of Tandem's questions on the CPU: the scene has the shapes and the bodies, and the query is asked
/// of it as often as wanted.
template <typename Query>
class TandemEngine : public Engine {
 public:
  using Options = typename Query::Options;

  TandemEngine(std::string_view name, const Options& options) : Engine(name), options_(options) {}

  std::string label() const override { return "Tandem"; }

  void set_shapes(std::span<const AssetView> shapes) override { check(scene_.set_assets(shapes)); }
  void update(std::span<const BodyPose> bodies) override {
    bodies_ = bodies;
    placed_ = false;
  }

 protected:
  std::optional<double> deform_one(std::uint32_t shape, const VertexPositions& positions) override {
    const Status status =
        std::visit([&](const auto& given) { return scene_.deform(shape, given); }, positions);
    require_bent(shape, status, scene_.where());
    return scene_.looseness(shape);
  }

  void check(Status status) const { require(status, scene_.where()); }

  // The bodies are not placed in update(), because the filter may be set after it.
  Status place() {
    placed_ = true;
    const Status status = scene_.set_threads(threads_);
    return status == Status::kOk ? scene_.place(bodies_, filter_) : status;
  }

  // Asks about the pairs that are given, or those that the scene finds.
  Status ask(const std::vector<ObjectPair>* given) {
    if constexpr (std::is_same_v<Query, ImpactQuery>) {
      options_.motion = motion_;
      options_.duration = duration_;
    }
    return given != nullptr ? query_.find(scene_, *given, options_) : query_.find(scene_, options_);
  }

  // Brings about what a step begins with: all bodies but those that the filter calls fixed stood elsewhere,
  // and a tree of the fixed ones is kept. A new scene without fixed bodies needs none of it.
  void stand_elsewhere() {
    if (!placed_ && filter_.motion == nullptr) return;
    elsewhere_.assign(bodies_.begin(), bodies_.end());
    for (std::size_t i = 0; i < elsewhere_.size(); ++i) {
      double& x = elsewhere_[i].pose.translation[0];
      if (filter_.motion == nullptr || filter_.motion[i] != Motion::fixed) x = std::nextafter(x, 0.5 * x + 1);
    }
    check(scene_.place(elsewhere_, filter_));
    check(scene_.find_pairs());
  }

  // Places the bodies and asks. Result: seconds.
  double time_step(const std::vector<ObjectPair>* given) {
    stand_elsewhere();
    Stopwatch watch;
    Status status = place();
    if (status == Status::kOk) status = ask(given);
    const double seconds = watch.lap();
    check(status);
    return seconds;
  }

  template <typename Timed>
  Timed time(const TimedQuery& asked) {
    Timed timed;
    for (std::uint32_t i = 0; i < asked.repeats; ++i) timed.whole.push_back(time_step(asked.given));
    timed.counters = query_.counters();
    timed.pairs.assign(query_.pairs().begin(), query_.pairs().end());
    timed.rows.assign(query_.rows().begin(), query_.rows().end());
    return timed;
  }

  Options options_;
  Scene scene_;
  Query query_;
  std::span<const BodyPose> bodies_;
  bool placed_ = false;

 private:
  std::vector<BodyPose> elsewhere_;
};

constexpr const char* kLabels[] = {"Tandem exact", "Tandem fast", "Tandem boxes"};
constexpr const char* kSettings[] = {"4-ary AABB trees in one file each, exact on the posed float64 vertices",
                                     "the same trees, triangles decided in float32",
                                     "the same trees, triangles whose boxes overlap"};

class TandemContacts final : public TandemEngine<ContactQuery> {
 public:
  using TandemEngine::TandemEngine;

  std::string label() const override { return kLabels[static_cast<int>(options_.mode)]; }
  std::string settings() const override { return kSettings[static_cast<int>(options_.mode)]; }

  void set_shapes(std::span<const AssetView> shapes) override {
    TandemEngine::set_shapes(shapes);
    file_bytes_ = 0;
    for (const AssetView& shape : shapes) file_bytes_ += shape.header->file_bytes;
  }

  std::span<const ObjectPair> find_pairs() override {
    check(place());
    check(scene_.find_pairs(options_.within, options_.self_pairs));
    return scene_.pairs();
  }

  void query(std::span<const ObjectPair> pairs) override {
    if (!placed_) check(place());
    check(query_.find(scene_, pairs, options_));
    counters_ = query_.counters();
  }

  bool contacts(std::vector<TriangleContact>& found) override {
    found.clear();
    found.reserve(query_.rows().size());
    for (const Contact& c : query_.rows()) found.push_back({c.pair, c.triangle_a, c.triangle_b});
    return true;
  }

  std::vector<Counter> named_counters() const override {
    return {{"block_pairs", counters_.block_pairs},
            {"candidates", counters_.candidates},
            {"decided_by_float32", counters_.decided_by_float32},
            {"decided_by_float64", counters_.decided_by_float64},
            {"decided_exactly", counters_.decided_exactly}};
  }

  std::uint64_t bytes_beside_heap() const override { return file_bytes_; }

  TimedAnswer time_query(const TimedQuery& asked) override {
    TimedAnswer answer;
    for (std::uint32_t i = 0; i < asked.repeats; ++i) {
      answer.whole.push_back(time_step(asked.given));
      if (asked.manifolds) make_manifolds(answer.manifolds);
    }
    counters_ = query_.counters();
    answer.pairs.assign(query_.pairs().begin(), query_.pairs().end());
    contacts(answer.contacts);
    if (asked.kept_within) keep_manifolds(asked, answer.manifolds);
    return answer;
  }

 private:
  // The first turn finds what the others keep.
  void keep_manifolds(const TimedQuery& asked, TimedManifolds& made) {
    MovedQuery moved;
    for (std::uint32_t i = 0; i <= asked.repeats; ++i) {
      Stopwatch watch;
      check(place());
      const MovedOptions options = {.tolerance = *asked.kept_within};
      check(asked.given != nullptr ? moved.find(scene_, *asked.given, options) : moved.find(scene_, options));
      check(query_.find(scene_, moved.rows(), options_));
      check(manifolds_.find(scene_, moved, query_, {.match_previous = false}));
      if (i > 0) made.kept.push_back(watch.lap());
    }
    made.kept_pairs = moved.counters().kept;
    check_kept(manifolds_.rows(), manifolds_.points(), made);
  }

  void make_manifolds(TimedManifolds& made) {
    Stopwatch watch;
    const Status status = manifolds_.find(scene_, query_, {.match_previous = false});
    made.seconds.push_back(watch.lap());
    check(status);
    made.manifolds.assign(manifolds_.rows().begin(), manifolds_.rows().end());
    made.points.assign(manifolds_.points().begin(), manifolds_.points().end());
    made.counters = manifolds_.counters();
  }

  ManifoldQuery manifolds_;
  std::uint64_t file_bytes_ = 0;
};

class TandemDistances final : public TandemEngine<DistanceQuery> {
 public:
  using TandemEngine::TandemEngine;

  std::string settings() const override { return "certified, relative 1e-6"; }

  void find_distances(std::span<const ObjectPair> pairs, std::vector<double>& distances) override {
    check(place());
    check(query_.find(scene_, pairs, options_));
    distances.clear();
    for (const ObjectDistance& found : query_.rows()) distances.push_back(found.upper);
  }

  TimedDistances time_distances(const TimedQuery& asked) override { return time<TimedDistances>(asked); }
};

class TandemImpacts final : public TandemEngine<ImpactQuery> {
 public:
  using TandemEngine::TandemEngine;

  std::string settings() const override { return "certified, gap of 1e-6 of the smaller body"; }

  void find_impacts(std::span<const ObjectPair> pairs, std::vector<double>& times) override {
    const std::vector<ObjectPair> given(pairs.begin(), pairs.end());
    check(place());
    check(ask(&given));
    times.clear();
    for (const Impact& impact : query_.rows())
      times.push_back(impact.status == ImpactStatus::none ? INFINITY : impact.t_safe);
  }

  TimedImpacts time_impacts(const TimedQuery& asked) override { return time<TimedImpacts>(asked); }
};

class TandemVerdicts final : public TandemEngine<ToleranceQuery> {
 public:
  using TandemEngine::TandemEngine;

  TimedVerdicts time_verdicts(const TimedQuery& asked) override { return time<TimedVerdicts>(asked); }
};

/// Closest points and rays.
class TandemProbes final : public Engine {
 public:
  TandemProbes(std::string_view name, const ProbeOptions& options) : Engine(name), options_(options) {}

  std::string label() const override { return "Tandem"; }
  std::string settings() const override {
    return "float64 points and rays, hits decided exactly, distances certified";
  }

  void set_shapes(std::span<const AssetView> shapes) override { check(scene_.set_assets(shapes)); }
  void update(std::span<const BodyPose> bodies) override {
    check(scene_.set_threads(threads_));
    check(scene_.place(bodies, filter_));
  }

  void find_closest(Points points, std::vector<double>& distances) override {
    check(closest_.find(scene_, {.points = points, .tolerance = options_.tolerance}));
    distances.clear();
    for (const ClosestPoint& row : closest_.rows()) distances.push_back(row.upper);
  }

  void find_hits(Points origins, Points directions, std::vector<double>& times) override {
    check(rays_.find(scene_, {.origins = origins, .directions = directions}));
    times.clear();
    for (const RayHit& row : rays_.rows()) times.push_back(row.t);
  }

 private:
  void check(Status status) const { require(status, scene_.where()); }

  ProbeOptions options_;
  Scene scene_;
  ClosestQuery closest_;
  RayQuery rays_;
};

}  // namespace

std::unique_ptr<Engine> make_tandem(std::string_view name, const Question& question) {
  if (const auto* probes = std::get_if<ProbeOptions>(&question))
    return std::make_unique<TandemProbes>(name, *probes);
  return make_for<TandemContacts, TandemDistances, TandemImpacts, TandemVerdicts>(question, name);
}

}  // namespace tandem
