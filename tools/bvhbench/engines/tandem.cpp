#include <memory>
#include <optional>

#include "engine.h"
#include "tandem/kernels/manifold_query.h"

namespace tandem {
namespace {

constexpr const char* kLabels[] = {"Tandem exact", "Tandem fast", "Tandem boxes"};
constexpr const char* kSettings[] = {"4-ary AABB trees in one file each, exact on the posed float64 vertices",
                                     "the same trees, triangles decided in float32",
                                     "the same trees, triangles whose boxes overlap"};

/// Tandem on the CPU.
class TandemEngine final : public Engine {
 public:
  explicit TandemEngine(const ContactOptions& options) : options_(options) {}

  std::string_view name() const override { return "tandem"; }
  std::string label() const override { return kLabels[static_cast<int>(options_.mode)]; }
  std::string settings() const override { return kSettings[static_cast<int>(options_.mode)]; }

  void set_shapes(std::span<const AssetView> shapes) override {
    check(query_.set_assets(shapes));
    shapes_.assign(shapes.begin(), shapes.end());
    manifolds_.reset();
    file_bytes_ = 0;
    for (const AssetView& shape : shapes) file_bytes_ += shape.header->file_bytes;
  }

  void update(std::span<const BodyPose> bodies) override {
    bodies_ = bodies;
    check(query_.keep_fixed({}, {}));
  }

  void keep_fixed() override {
    if (filter_.motion != nullptr)
      check(query_.keep_fixed(bodies_, {filter_.motion, bodies_.size()}, options_));
  }

  std::span<const ObjectPair> find_pairs() override {
    check(query_.find_pairs(bodies_, filtered()));
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
    check(query_.find_contacts(bodies_, filtered()));
    counters_ = query_.counters();
    return query_.pairs();
  }

  void make_manifolds(std::span<const ObjectPair> pairs, TimedManifolds& made) override {
    if (!manifolds_) {
      manifolds_.emplace();
      require(manifolds_->set_assets(shapes_), manifolds_->where());
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
  ContactOptions filtered() const {
    ContactOptions options = options_;
    options.filter = &filter_;
    return options;
  }

  void check(Status status) const { require(status, query_.where()); }

  ContactOptions options_;
  ContactQuery query_;
  std::vector<AssetView> shapes_;
  std::optional<ManifoldQuery> manifolds_;  // of shapes_, once they are asked for
  std::span<const BodyPose> bodies_;
  std::uint64_t file_bytes_ = 0;
};

}  // namespace

std::unique_ptr<Engine> make_tandem(const ContactOptions& options) {
  return std::make_unique<TandemEngine>(options);
}

}  // namespace tandem
