#include <fcl/narrowphase/distance.h>

#include "distance_engine.h"
#include "fcl_model.h"

namespace tandem {
namespace {

template <typename Volume>
class FclDistance final : public DistanceEngine {
 public:
  explicit FclDistance(const char* volume) : volume_(volume) {}

  std::string label() const override { return "FCL " + volume_; }
  std::string settings() const override { return "BVHModel<" + volume_ + "d>, relative error 1e-6, float64"; }

  void set_shapes(std::span<const AssetView> shapes) override {
    models_.clear();
    shapes_ = shapes;
    for (const AssetView& shape : shapes) models_.push_back(fcl_model<Volume>(shape.level()));
  }

  void update(std::span<const Instance> bodies) override {
    bodies_ = bodies;
    transforms_.clear();
    for (const Instance& body : bodies) {
      transforms_.push_back(
          fcl_transform(for_stored_coordinates(body.pose, shapes_[body.asset].header->origin)));
    }
  }

  void find(std::span<const ObjectPair> pairs, std::vector<double>& distances) override {
    fcl::DistanceRequestd request;
    request.rel_err = 1e-6;
    distances.clear();
    for (const auto& [a, b] : pairs) {
      fcl::DistanceResultd result;
      fcl::distance(models_[bodies_[a].asset].get(), transforms_[a], models_[bodies_[b].asset].get(),
                    transforms_[b], request, result);
      distances.push_back(result.min_distance);
    }
  }

 private:
  const std::string volume_;
  std::span<const AssetView> shapes_;
  std::span<const Instance> bodies_;
  std::vector<std::shared_ptr<fcl::BVHModel<Volume>>> models_;
  std::vector<fcl::Transform3d, Eigen::aligned_allocator<fcl::Transform3d>> transforms_;
};

}  // namespace

void add_fcl_distance(std::vector<std::unique_ptr<DistanceEngine>>& engines) {
  engines.push_back(std::make_unique<FclDistance<fcl::RSSd>>("RSS"));
  engines.push_back(std::make_unique<FclDistance<fcl::OBBRSSd>>("OBBRSS"));
}

}  // namespace tandem
