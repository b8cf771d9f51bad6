#include "impact_engine.h"

#include <cmath>
#include <new>
#include <stdexcept>

namespace tandem {

// In a file of its own.
void add_fcl_impact(std::vector<std::unique_ptr<ImpactEngine>>& engines);

namespace {

class TandemImpact final : public ImpactEngine {
 public:
  std::string label() const override { return "Tandem"; }
  std::string settings() const override { return "certified, gap of 1e-6 of the smaller body"; }

  void set_shapes(std::span<const AssetView> shapes) override { require(query_.set_assets(shapes)); }

  void update(std::span<const Instance> bodies, std::span<const RigidMotion> motions,
              double duration) override {
    bodies_ = bodies;
    motions_ = motions;
    duration_ = duration;
  }

  void find(std::span<const ObjectPair> pairs, std::vector<double>& times) override {
    require(query_.find(bodies_, motions_, duration_, pairs, {}));
    times.clear();
    for (const Impact& impact : query_.impacts())
      times.push_back(impact.status == ImpactStatus::none ? INFINITY : impact.t_safe);
  }

 private:
  static void require(Status status) {
    if (status == Status::kOutOfMemory) throw std::bad_alloc();
    if (status != Status::kOk) throw std::runtime_error(explain(status));
  }

  ImpactQuery query_;
  std::span<const Instance> bodies_;
  std::span<const RigidMotion> motions_;
  double duration_ = 0;
};

}  // namespace

std::vector<std::unique_ptr<ImpactEngine>> impact_engines() {
  std::vector<std::unique_ptr<ImpactEngine>> engines;
  engines.push_back(std::make_unique<TandemImpact>());
  if constexpr (TANDEM_HAVE_FCL) add_fcl_impact(engines);
  return engines;
}

}  // namespace tandem
