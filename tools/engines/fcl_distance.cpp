#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/distance.h>

#include "distance_engine.h"
#include "library_engine.h"

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
    for (const AssetView& shape : shapes) models_.push_back(make_model(shape.level()));
  }

  void update(std::span<const Instance> bodies) override {
    bodies_ = bodies;
    transforms_.clear();
    for (const Instance& body : bodies) {
      const Pose pose = for_stored_coordinates(body.pose, shapes_[body.asset].header->origin);
      fcl::Transform3d out = fcl::Transform3d::Identity();
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) out.linear()(i, j) = pose.rotation[i][j];
        out.translation()[i] = pose.translation[i];
      }
      transforms_.push_back(out);
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
  using Model = fcl::BVHModel<Volume>;

  static std::shared_ptr<Model> make_model(const LevelView& level) {
    const IndexedMesh mesh = index_mesh(level);
    std::vector<fcl::Vector3d> vertices;
    std::vector<fcl::Triangle> triangles;
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 3)
      vertices.emplace_back(mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2]);
    for (std::size_t i = 0; i < mesh.corners.size(); i += 3)
      triangles.emplace_back(mesh.corners[i], mesh.corners[i + 1], mesh.corners[i + 2]);
    auto model = std::make_shared<Model>();
    model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
    model->addSubModel(vertices, triangles);
    model->endModel();
    return model;
  }

  const std::string volume_;
  std::span<const AssetView> shapes_;
  std::span<const Instance> bodies_;
  std::vector<std::shared_ptr<Model>> models_;
  std::vector<fcl::Transform3d, Eigen::aligned_allocator<fcl::Transform3d>> transforms_;
};

}  // namespace

void add_fcl_distance(std::vector<std::unique_ptr<DistanceEngine>>& engines) {
  engines.push_back(std::make_unique<FclDistance<fcl::RSSd>>("RSS"));
  engines.push_back(std::make_unique<FclDistance<fcl::OBBRSSd>>("OBBRSS"));
}

}  // namespace tandem
