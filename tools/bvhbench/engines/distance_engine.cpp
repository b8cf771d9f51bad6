#include "distance_engine.h"

#include <new>
#include <stdexcept>

namespace tandem {

using DistanceEngines = void(std::vector<std::unique_ptr<DistanceEngine>>& engines);
// Each in a file of its own.
DistanceEngines add_cgal_distance, add_fcl_distance, add_coal_distance;

namespace {

class TandemDistance final : public DistanceEngine {
 public:
  std::string label() const override { return "Tandem"; }
  std::string settings() const override { return "certified, relative 1e-6"; }

  void set_shapes(std::span<const AssetView> shapes) override { require(query_.set_assets(shapes)); }
  void update(std::span<const Instance> bodies) override { bodies_ = bodies; }
  void find(std::span<const ObjectPair> pairs, std::vector<double>& distances) override {
    require(query_.find_distances(bodies_, pairs, {}));
    distances.clear();
    for (const ObjectDistance& found : query_.distances()) distances.push_back(found.upper);
  }

 private:
  static void require(Status status) {
    if (status == Status::kOutOfMemory) throw std::bad_alloc();
    if (status != Status::kOk) throw std::runtime_error(explain(status));
  }

  DistanceQuery query_;
  std::span<const Instance> bodies_;
};

}  // namespace

std::vector<std::unique_ptr<DistanceEngine>> distance_engines() {
  std::vector<std::unique_ptr<DistanceEngine>> engines;
  engines.push_back(std::make_unique<TandemDistance>());
  if constexpr (TANDEM_HAVE_FCL) add_fcl_distance(engines);
  if constexpr (TANDEM_HAVE_COAL) add_coal_distance(engines);
  add_cgal_distance(engines);
  return engines;
}

}  // namespace tandem
