#include <coal/BVH/BVH_model.h>
#include <coal/distance.h>

#include "distance_engine.h"
#include "library_engine.h"

namespace tandem {
namespace {

template <typename Volume>
class CoalDistance final : public DistanceEngine {
 public:
  explicit CoalDistance(const char* volume) : volume_(volume) {}

  std::string label() const override { return "Coal " + volume_; }
  std::string settings() const override { return "BVHModel<" + volume_ + ">, relative error 1e-6, float64"; }

  void set_shapes(std::span<const AssetView> shapes) override {
    models_.clear();
    shapes_ = shapes;
    for (const AssetView& shape : shapes) models_.push_back(make_model(shape.level()));
  }

  void update(std::span<const Instance> bodies) override {
    bodies_ = bodies;
    transforms_.clear();
    for (const Instance& body : bodies) {
      const Pose pose = for_stored_coordinates(body.pose, shapes_[body.asset].header->origin);
      coal::Matrix3s rotation;
      coal::Vec3s translation;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) rotation(i, j) = pose.rotation[i][j];
        translation[i] = pose.translation[i];
      }
      transforms_.emplace_back(rotation, translation);
    }
  }

  void find(std::span<const ObjectPair> pairs, std::vector<double>& distances) override {
    coal::DistanceRequest request;
    request.rel_err = 1e-6;
    request.enable_signed_distance = false;
    distances.clear();
    for (const auto& [a, b] : pairs) {
      coal::DistanceResult result;
      coal::distance(models_[bodies_[a].asset].get(), transforms_[a], models_[bodies_[b].asset].get(),
                     transforms_[b], request, result);
      distances.push_back(result.min_distance);
    }
  }

 private:
  using Model = coal::BVHModel<Volume>;

  static std::shared_ptr<Model> make_model(const LevelView& level) {
    const IndexedMesh mesh = index_mesh(level);
    std::vector<coal::Vec3s> vertices;
    std::vector<coal::Triangle> triangles;
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 3)
      vertices.emplace_back(mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2]);
    for (std::size_t i = 0; i < mesh.corners.size(); i += 3) {
      const auto corner = [&](std::size_t k) { return static_cast<unsigned>(mesh.corners[i + k]); };
      triangles.emplace_back(corner(0), corner(1), corner(2));
    }
    auto model = std::make_shared<Model>();
    model->beginModel(static_cast<unsigned>(triangles.size()), static_cast<unsigned>(vertices.size()));
    model->addSubModel(vertices, triangles);
    model->endModel();
    return model;
  }

  const std::string volume_;
  std::span<const AssetView> shapes_;
  std::span<const Instance> bodies_;
  std::vector<std::shared_ptr<Model>> models_;
  std::vector<coal::Transform3s> transforms_;
};

}  // namespace

void add_coal_distance(std::vector<std::unique_ptr<DistanceEngine>>& engines) {
  engines.push_back(std::make_unique<CoalDistance<coal::RSS>>("RSS"));
  engines.push_back(std::make_unique<CoalDistance<coal::OBBRSS>>("OBBRSS"));
}

}  // namespace tandem
