#include "engine_parts.h"

namespace tandem::simulation {
namespace {

class TandemEngine final : public CollisionEngine {
 public:
  explicit TandemEngine(const EngineOptions& options) {
    options_.mode = options.fast ? QueryMode::fast : QueryMode::exact;
    options_.threads = options.threads;
  }

  std::string_view name() const override { return "tandem"; }

  void set_shapes(std::span<const AssetView> shapes) override {
    require(name(), query_.set_assets(shapes), query_);
  }

  void find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle,
            ContactList& found) override {
    times_ = {};
    Stopwatch watch;
    require(name(), query_.find_pairs(bodies, options_), query_);
    keep_active(query_.pairs(), idle, found.pairs);
    times_.broad_phase = watch.lap();
    require(name(), query_.find_contacts(bodies, found.pairs, options_), query_);
    times_.traversal = watch.lap();
    found.triangles.clear();
    for (const Contact& c : query_.contacts())
      found.triangles.push_back({c.pair, c.triangle_a, c.triangle_b});
    sort_contacts(found.triangles);
    times_.transfer = watch.lap();
    counters_ = query_.counters();
  }

 private:
  QueryOptions options_;
  ContactQuery query_;
};

}  // namespace

std::unique_ptr<CollisionEngine> make_tandem_engine(const EngineOptions& options) {
  return std::make_unique<TandemEngine>(options);
}

}  // namespace tandem::simulation
