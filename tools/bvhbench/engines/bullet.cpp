#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <algorithm>

#include "library_engine.h"

namespace tandem {
namespace {

/// A mesh, and Bullet's shape that looks at it.
class BulletMesh {
 public:
  explicit BulletMesh(const LevelView& level)
      : mesh_(level),
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

  void move_vertices(std::span<const double> vertices) {
    std::transform(vertices.begin(), vertices.end(), mesh_.vertices.begin(),
                   [](double x) { return static_cast<float>(x); });
    shape_.postUpdate();
    shape_.updateBound();
  }

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

class BulletEngine final : public EngineWith<BulletMesh> {
 public:
  using EngineWith::EngineWith;

  std::string label() const override { return "Bullet"; }
  std::string settings() const override {
    return "btGImpactMeshShape (quantised AABB trees), GImpact's own test of triangles, margin 0, float32";
  }

 private:
  void place(std::span<const Pose> poses) override {
    transforms_.clear();
    for (const Pose& pose : poses) transforms_.push_back(transform(pose));
  }

  void move_vertices(std::uint32_t shape, std::span<const double> vertices) override {
    kept(shape).move_vertices(vertices);
  }

  void collide(std::uint32_t pair, std::uint32_t a, std::uint32_t b) override {
    const btGImpactMeshShapePart &part_a = shape(a).part(), &part_b = shape(b).part();
    const btTransform &at_a = transforms_[static_cast<int>(a)], &at_b = transforms_[static_cast<int>(b)];
    found_.resize(0);
    btGImpactBoxSet::find_collision(part_a.getBoxSet(), at_a, part_b.getBoxSet(), at_b, found_);
    candidates_ += static_cast<std::uint64_t>(found_.size());
    for (int i = 0; i < found_.size(); ++i) {
      const int triangle_a = found_[i].m_index1, triangle_b = found_[i].m_index2;
      if (!triangles_collide(part_a, at_a, triangle_a, part_b, at_b, triangle_b)) continue;
      add_contact(pair, static_cast<std::uint32_t>(triangle_a), static_cast<std::uint32_t>(triangle_b));
    }
  }

  btAlignedObjectArray<btTransform> transforms_;
  btPairSet found_;
};

}  // namespace

std::unique_ptr<Engine> make_bullet(std::string_view name, const Question&) {
  return std::make_unique<BulletEngine>(name);
}

}  // namespace tandem
