#include <fcl/narrowphase/collision.h>

#include <limits>

#include "fcl_model.h"

namespace tandem {
namespace {

using Model = fcl::BVHModel<fcl::OBBd>;

class FclEngine final : public LibraryEngine {
 public:
  std::string_view name() const override { return "fcl"; }
  std::string label() const override { return "FCL"; }
  std::string settings() const override {
    return "BVHModel<OBBd>, all contacts, triangles without points or normals, float64";
  }
  std::vector<Counter> named_counters() const override { return {}; }

  void query(std::span<const ObjectPair> pairs) override {
    LibraryEngine::query(pairs);
    result_ = {};
  }

 private:
  void clear_shapes() override { models_.clear(); }
  void add_shape(const LevelView& level) override { models_.push_back(fcl_model<fcl::OBBd>(level)); }

  void place(std::span<const Pose> poses) override {
    transforms_.clear();
    for (const Pose& pose : poses) transforms_.push_back(fcl_transform(pose));
  }

  void collide(std::uint32_t pair, std::uint32_t a, std::uint32_t b) override {
    result_.clear();
    fcl::collide(models_[shape_of()[a]].get(), transforms_[a], models_[shape_of()[b]].get(), transforms_[b],
                 request_, result_);
    for (std::size_t i = 0; i < result_.numContacts(); ++i) {
      const fcl::Contactd& contact = result_.getContact(i);
      add_contact(pair, contact.b1, contact.b2);
    }
  }

  const fcl::CollisionRequestd request_{std::numeric_limits<std::size_t>::max(), /*enable_contact=*/false};
  fcl::CollisionResultd result_;
  std::vector<std::shared_ptr<Model>> models_;
  std::vector<fcl::Transform3d, Eigen::aligned_allocator<fcl::Transform3d>> transforms_;
};

}  // namespace

std::unique_ptr<Engine> make_fcl(const ContactOptions&) {
  return std::make_unique<FclEngine>();
}

}  // namespace tandem
