#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>

#include <limits>

#include "peer.h"
#include "peer_mesh.h"

namespace tandem::bench {
namespace {

using Model = fcl::BVHModel<fcl::OBBd>;

std::shared_ptr<Model> make_model(const LevelView& level) {
  const IndexedMesh mesh = index_mesh(level);
  std::vector<fcl::Vector3d> vertices;
  std::vector<fcl::Triangle> triangles;
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 3) {
    vertices.emplace_back(mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2]);
  }
  for (std::size_t i = 0; i < mesh.corners.size(); i += 3) {
    triangles.emplace_back(mesh.corners[i], mesh.corners[i + 1], mesh.corners[i + 2]);
  }
  auto model = std::make_shared<Model>();
  model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
  model->addSubModel(vertices, triangles);
  model->endModel();
  return model;
}

fcl::Transform3d transform(const Pose& pose) {
  fcl::Transform3d out = fcl::Transform3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.linear()(i, j) = pose.rotation[i][j];
    out.translation()[i] = pose.translation[i];
  }
  return out;
}

class FclPeer final : public TellingPeer {
 public:
  std::string name() const override { return "FCL"; }
  std::string settings() const override {
    return "BVHModel<OBBd>, all contacts, triangles without points or normals, float64";
  }

  void build(std::span<const AssetView> assets, std::span<const Instance> instances) override {
    assets_ = assets;
    for (const AssetView& asset : assets) models_.push_back(make_model(asset.level()));
    for (const Instance& instance : instances) model_of_.push_back(models_[instance.asset].get());
    update(instances);
  }

  void update(std::span<const Instance> instances) override {
    transforms_.clear();
    for (const Pose& pose : stored_poses(assets_, instances)) transforms_.push_back(transform(pose));
  }

  void query(std::span<const ObjectPair> pairs) override {
    contacts_.clear();
    const fcl::CollisionRequestd request(std::numeric_limits<std::size_t>::max(), /*enable_contact=*/false);
    fcl::CollisionResultd result;
    for (std::uint32_t pair = 0; pair < pairs.size(); ++pair) {
      const auto [a, b] = pairs[pair];
      result.clear();
      fcl::collide(model_of_[a], transforms_[a], model_of_[b], transforms_[b], request, result);
      for (std::size_t i = 0; i < result.numContacts(); ++i) {
        const fcl::Contactd& contact = result.getContact(i);
        contacts_.push_back(
            {pair, static_cast<std::uint32_t>(contact.b1), static_cast<std::uint32_t>(contact.b2)});
      }
    }
  }

 private:
  std::span<const AssetView> assets_;
  std::vector<std::shared_ptr<Model>> models_;
  std::vector<const Model*> model_of_;
  std::vector<fcl::Transform3d, Eigen::aligned_allocator<fcl::Transform3d>> transforms_;
};

}  // namespace

std::vector<std::unique_ptr<Peer>> make_fcl_peers() {
  std::vector<std::unique_ptr<Peer>> peers;
  peers.push_back(std::make_unique<FclPeer>());
  return peers;
}

}  // namespace tandem::bench
