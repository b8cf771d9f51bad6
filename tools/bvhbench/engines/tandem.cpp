#include <cmath>
#include <memory>
#include <optional>

#include "engine.h"
#include "tandem/kernels/manifold_query.h"

namespace tandem {
namespace {

/// What Tandem's questions share on the CPU: the query is told the shapes, and asked as often as wanted.
template <typename Query, typename Options>
class TandemEngine : public Engine {
 public:
  TandemEngine(std::string_view name, const Options& options) : Engine(name), options_(options) {
    options_.filter = &filter_;
  }

  std::string label() const override { return "Tandem"; }

  void set_shapes(std::span<const AssetView> shapes) override { check(query_.set_assets(shapes)); }
  void update(std::span<const BodyPose> bodies) override { bodies_ = bodies; }

 protected:
  void check(Status status) const { require(status, query_.where()); }

  /// ask(): finds pairs, where none are given, and a row for each. rows(): what it found.
  template <typename Timed, typename Ask, typename Rows>
  Timed time(const TimedQuery& asked, const Ask& ask, const Rows& rows) {
    Timed timed;
    for (std::uint32_t i = 0; i < asked.repeats; ++i) {
      Stopwatch watch;
      const Status status = ask();
      timed.whole.push_back(watch.lap());
      check(status);
    }
    timed.counters = query_.counters();
    timed.pairs.assign(query_.pairs().begin(), query_.pairs().end());
    timed.rows.assign(rows().begin(), rows().end());
    return timed;
  }

  Options options_;
  Query query_;
  std::span<const BodyPose> bodies_;
};

constexpr const char* kLabels[] = {"Tandem exact", "Tandem fast", "Tandem boxes"};
constexpr const char* kSettings[] = {"4-ary AABB trees in one file each, exact on the posed float64 vertices",
                                     "the same trees, triangles decided in float32",
                                     "the same trees, triangles whose boxes overlap"};

class TandemContacts final : public TandemEngine<ContactQuery, ContactOptions> {
 public:
  using TandemEngine::TandemEngine;

  std::string label() const override { return kLabels[static_cast<int>(options_.mode)]; }
  std::string settings() const override { return kSettings[static_cast<int>(options_.mode)]; }

  void set_shapes(std::span<const AssetView> shapes) override {
    TandemEngine::set_shapes(shapes);
    shapes_.assign(shapes.begin(), shapes.end());
    manifolds_.reset();
    file_bytes_ = 0;
    for (const AssetView& shape : shapes) file_bytes_ += shape.header->file_bytes;
  }

  void update(std::span<const BodyPose> bodies) override {
    TandemEngine::update(bodies);
    check(query_.keep_fixed({}, {}));
  }

  void keep_fixed() override {
    if (filter_.motion != nullptr)
      check(query_.keep_fixed(bodies_, {filter_.motion, bodies_.size()}, options_));
  }

  std::span<const ObjectPair> find_pairs() override {
    check(query_.find_pairs(bodies_, options_));
    return query_.pairs();
  }

  void query(std::span<const ObjectPair> pairs) override {
    check(query_.find_contacts(bodies_, pairs, options_));
    counters_ = query_.counters();
  }

  bool contacts(std::vector<TriangleContact>& found) override {
    found.clear();
    found.reserve(query_.contacts().size());
    for (const Contact& c : query_.contacts()) found.push_back({c.pair, c.triangle_a, c.triangle_b});
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

 protected:
  std::span<const ObjectPair> find_pairs_and_query() override {
    check(query_.find_contacts(bodies_, options_));
    counters_ = query_.counters();
    return query_.pairs();
  }

  void make_manifolds(std::span<const ObjectPair> pairs, TimedManifolds& made) override {
    if (!manifolds_) {
      manifolds_.emplace();
      const Status status = manifolds_->set_assets(shapes_);
      require(status, manifolds_->where());
    }
    Stopwatch watch;
    const Status status = manifolds_->make(bodies_, pairs, query_.contacts(),
                                           {.match_previous = false, .threads = options_.threads});
    made.seconds.push_back(watch.lap());
    require(status, manifolds_->where());
    made.manifolds.assign(manifolds_->manifolds().begin(), manifolds_->manifolds().end());
    made.points.assign(manifolds_->points().begin(), manifolds_->points().end());
    made.counters = manifolds_->counters();
  }

 private:
  std::vector<AssetView> shapes_;
  std::optional<ManifoldQuery> manifolds_;  // of shapes_, once they are asked for
  std::uint64_t file_bytes_ = 0;
};

class TandemDistances final : public TandemEngine<DistanceQuery, DistanceOptions> {
 public:
  using TandemEngine::TandemEngine;

  std::string settings() const override { return "certified, relative 1e-6"; }

  void find_distances(std::span<const ObjectPair> pairs, std::vector<double>& distances) override {
    check(query_.find_distances(bodies_, pairs, options_));
    distances.clear();
    for (const ObjectDistance& found : query_.distances()) distances.push_back(found.upper);
  }

  TimedDistances time_distances(const TimedQuery& asked) override {
    const auto ask = [&] {
      return asked.given != nullptr ? query_.find_distances(bodies_, *asked.given, options_)
                                    : query_.find_distances(bodies_, options_);
    };
    return time<TimedDistances>(asked, ask, [&] { return query_.distances(); });
  }
};

class TandemImpacts final : public TandemEngine<ImpactQuery, ImpactOptions> {
 public:
  using TandemEngine::TandemEngine;

  std::string settings() const override { return "certified, gap of 1e-6 of the smaller body"; }

  void find_impacts(std::span<const ObjectPair> pairs, std::vector<double>& times) override {
    check(query_.find(bodies_, motion_, duration_, pairs, options_));
    times.clear();
    for (const Impact& impact : query_.impacts())
      times.push_back(impact.status == ImpactStatus::none ? INFINITY : impact.t_safe);
  }

  TimedImpacts time_impacts(const TimedQuery& asked) override {
    const auto ask = [&] {
      return asked.given != nullptr ? query_.find(bodies_, motion_, duration_, *asked.given, options_)
                                    : query_.find(bodies_, motion_, duration_, options_);
    };
    return time<TimedImpacts>(asked, ask, [&] { return query_.impacts(); });
  }
};

class TandemVerdicts final : public TandemEngine<ToleranceQuery, ToleranceOptions> {
 public:
  using TandemEngine::TandemEngine;

  TimedVerdicts time_verdicts(const TimedQuery& asked) override {
    const auto ask = [&] {
      return asked.given != nullptr ? query_.decide(bodies_, *asked.given, options_)
                                    : query_.decide(bodies_, options_);
    };
    return time<TimedVerdicts>(asked, ask, [&] { return query_.verdicts(); });
  }
};

}  // namespace

std::unique_ptr<Engine> make_tandem(std::string_view name, const Question& question) {
  return make_for<TandemContacts, TandemDistances, TandemImpacts, TandemVerdicts>(question, name);
}

}  // namespace tandem
