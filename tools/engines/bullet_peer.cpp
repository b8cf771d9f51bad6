#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include "peer.h"
#include "peer_mesh.h"

namespace tandem::bench {
namespace {

/// A mesh, and Bullet's shape that looks at it.
class BulletMesh {
 public:
  explicit BulletMesh(const LevelView& level)
      : mesh_(index_mesh(level)),
        triangles_(static_cast<int>(mesh_.triangle_count()), mesh_.corners.data(), 3 * sizeof(int),
                   static_cast<int>(mesh_.vertex_count()), mesh_.vertices.data(), 3 * sizeof(float)),
        shape_(&triangles_) {
    shape_.setMargin(0);  // else triangles touch from afar
    shape_.updateBound();
    part_ = shape_.getMeshPart(0);
    part_->lockChildShapes();  // for good: what btGImpactCollisionAlgorithm does around each pair
  }
  BulletMesh(const BulletMesh&) = delete;
  BulletMesh& operator=(const BulletMesh&) = delete;
  ~BulletMesh() { part_->unlockChildShapes(); }

  const btGImpactMeshShapePart& part() const { return *part_; }

 private:
  IndexedMesh mesh_;
  btTriangleIndexVertexArray triangles_;
  btGImpactMeshShape shape_;
  btGImpactMeshShapePart* part_;
};

btTransform transform(const Pose& pose) {
  const auto cast = [](double x) { return static_cast<btScalar>(x); };
  const auto& r = pose.rotation;
  const btMatrix3x3 basis(cast(r[0][0]), cast(r[0][1]), cast(r[0][2]), cast(r[1][0]), cast(r[1][1]),
                          cast(r[1][2]), cast(r[2][0]), cast(r[2][1]), cast(r[2][2]));
  const double* t = pose.translation;
  return btTransform(basis, btVector3(cast(t[0]), cast(t[1]), cast(t[2])));
}

/// The steps of btGImpactCollisionAlgorithm::collide_sat_triangles on one pair of triangles.
bool triangles_collide(const btGImpactMeshShapePart& part_a, const btTransform& at_a, int triangle_a,
                       const btGImpactMeshShapePart& part_b, const btTransform& at_b, int triangle_b) {
  btPrimitiveTriangle a, b;
  part_a.getPrimitiveTriangle(triangle_a, a);
  part_b.getPrimitiveTriangle(triangle_b, b);
  a.applyTransform(at_a);
  b.applyTransform(at_b);
  a.buildTriPlane();
  b.buildTriPlane();
  GIM_TRIANGLE_CONTACT contact;
  return a.overlap_test_conservative(b) && a.find_triangle_collision_clip_method(b, contact);
}

class BulletPeer final : public TellingPeer {
 public:
  std::string name() const override { return "Bullet"; }
  std::string settings() const override {
    return "btGImpactMeshShape (quantised AABB trees), GImpact's own test of triangles, margin 0, float32";
  }

  void build(std::span<const AssetView> assets, std::span<const Instance> instances) override {
    assets_ = assets;
    for (const AssetView& asset : assets) meshes_.push_back(std::make_unique<BulletMesh>(asset.level()));
    for (const Instance& instance : instances) part_of_.push_back(&meshes_[instance.asset]->part());
    update(instances);
  }

  void update(std::span<const Instance> instances) override {
    transforms_.clear();
    for (const Pose& pose : stored_poses(assets_, instances)) transforms_.push_back(transform(pose));
  }

  void query(std::span<const ObjectPair> pairs) override {
    contacts_.clear();
    candidates_ = 0;
    for (std::uint32_t pair = 0; pair < pairs.size(); ++pair) collide(pair, pairs[pair]);
  }

  std::vector<Counter> counters() const override { return {{"candidates", candidates_}}; }

 private:
  void collide(std::uint32_t pair, ObjectPair instances) {
    const auto [a, b] = instances;
    found_.resize(0);
    btGImpactBoxSet::find_collision(part_of_[a]->getBoxSet(), transforms_[a], part_of_[b]->getBoxSet(),
                                    transforms_[b], found_);
    candidates_ += static_cast<std::uint64_t>(found_.size());
    for (int i = 0; i < found_.size(); ++i) {
      const int triangle_a = found_[i].m_index1, triangle_b = found_[i].m_index2;
      if (!triangles_collide(*part_of_[a], transforms_[a], triangle_a, *part_of_[b], transforms_[b],
                             triangle_b)) {
        continue;
      }
      contacts_.push_back(
          {pair, static_cast<std::uint32_t>(triangle_a), static_cast<std::uint32_t>(triangle_b)});
    }
  }

  std::span<const AssetView> assets_;
  std::vector<std::unique_ptr<BulletMesh>> meshes_;
  std::vector<const btGImpactMeshShapePart*> part_of_;
  btAlignedObjectArray<btTransform> transforms_;
  btPairSet found_;
  std::uint64_t candidates_ = 0;
};

}  // namespace

std::vector<std::unique_ptr<Peer>> make_bullet_peers() {
  std::vector<std::unique_ptr<Peer>> peers;
  peers.push_back(std::make_unique<BulletPeer>());
  return peers;
}

}  // namespace tandem::bench
