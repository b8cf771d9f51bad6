#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/motion/interp_motion.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/continuous_collision.h>
#include <fcl/narrowphase/distance.h>

#include <cmath>
#include <limits>

#include "bvh_models.h"

namespace tandem {
namespace {

struct Fcl : BvhLibrary<fcl::BVHModel, fcl::Vector3d, fcl::Triangle, fcl::Transform3d> {
  static Transform transform(const Pose& pose) {
    Transform out = Transform::Identity();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) out.linear()(i, j) = pose.rotation[i][j];
      out.translation()[i] = pose.translation[i];
    }
    return out;
  }

  template <typename Model>
  static double distance(const Model* a, const Transform& at_a, const Model* b, const Transform& at_b) {
    fcl::DistanceRequestd request;
    request.rel_err = 1e-6;
    fcl::DistanceResultd result;
    fcl::distance(a, at_a, b, at_b, request, result);
    return result.min_distance;
  }
};

class FclContacts final : public BodiesAtRest<Fcl, fcl::OBBd> {
 public:
  using BodiesAtRest::BodiesAtRest;

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
  // replaceVertex(), since updateVertex() has boxes contain where vertices were, too.
  void move_vertices(std::uint32_t shape, std::span<const double> vertices) override {
    auto& model = kept(shape).model;
    model.beginReplaceModel();
    for (std::size_t i = 0; i < vertices.size(); i += 3)
      model.replaceVertex({vertices[i], vertices[i + 1], vertices[i + 2]});
    model.endReplaceModel(/*refit=*/true, /*bottomup=*/true);
  }

  void collide(std::uint32_t pair, std::uint32_t a, std::uint32_t b) override {
    result_.clear();
    fcl::collide(model(a), transform(a), model(b), transform(b), request_, result_);
    for (std::size_t i = 0; i < result_.numContacts(); ++i) {
      const fcl::Contactd& contact = result_.getContact(i);
      add_contact(pair, contact.b1, contact.b2);
    }
  }

  const fcl::CollisionRequestd request_{std::numeric_limits<std::size_t>::max(), /*enable_contact=*/false};
  fcl::CollisionResultd result_;
};

using FclMotion = fcl::InterpMotion<double>;

/// The motion as FCL interpolates it between the start of the step and its end: the centre goes straight
/// ahead, and the body turns about it by the shortest rotation, both at constant speed. That is the motion
/// itself where it turns by less than half a turn.
std::unique_ptr<FclMotion> fcl_motion(const Pose& start, const Pose& end, const RigidMotion& motion) {
  const fcl::Transform3d from = Fcl::transform(start), to = Fcl::transform(end);
  const fcl::Vector3d centre = from.inverse(Eigen::Isometry) * fcl::Vector3d(motion.centre);
  return std::make_unique<FclMotion>(from.linear(), from.translation(), to.linear(), to.translation(),
                                     centre);
}

/// The trees of a shape, one of them of rectangles swept by spheres.
struct BodyTrees {
  explicit BodyTrees(const LevelView& level) : boxes(level), swept(level) {}

  BvhMesh<Fcl, fcl::OBBd> boxes;
  BvhMesh<Fcl, fcl::RSSd> swept;
};

/// The base of all of FCL's ways to find impacts.
class FclImpacts : public EngineWith<BodyTrees> {
 public:
  using EngineWith::EngineWith;

 protected:
  struct Mover {
    const fcl::BVHModel<fcl::OBBd>* boxes;
    const fcl::BVHModel<fcl::RSSd>* swept;
    const FclMotion* motion;

    fcl::Transform3d place() const {
      fcl::Transform3d now;
      motion->getCurrentTransform(now);
      return now;
    }
  };

 private:
  /// Infinite where the bodies do not meet.
  virtual double part_of_step(const Mover& a, const Mover& b) = 0;

  void place(std::span<const Pose> poses) final {
    motions_.clear();
    for (std::uint32_t i = 0; i < poses.size(); ++i)
      motions_.push_back(fcl_motion(poses[i], end_of_step(i), motion_[i]));
  }

  double impact(std::uint32_t a, std::uint32_t b) final {
    motions_[a]->integrate(0);  // conservative advancement begins where the motion was left
    motions_[b]->integrate(0);
    return duration_ * part_of_step(mover(a), mover(b));
  }

  Mover mover(std::uint32_t body) const {
    return {&shape(body).boxes.model, &shape(body).swept.model, motions_[body].get()};
  }

  std::vector<std::unique_ptr<FclMotion>> motions_;
};

double part_of(const fcl::ContinuousCollisionResultd& result) {
  return result.is_collide ? result.time_of_contact : INFINITY;
}

/// The public function's conservative advancement.
class PublicAdvancement final : public FclImpacts {
 public:
  using FclImpacts::FclImpacts;

  std::string label() const override { return "FCL public"; }
  std::string settings() const override {
    return "continuousCollide, conservative advancement, BVHModel<RSSd>, to 1e-5 of the step, float64";
  }
  bool runs_once() const override { return true; }

 private:
  double part_of_step(const Mover& a, const Mover& b) override {
    fcl::ContinuousCollisionRequestd request;
    request.ccd_motion_type = fcl::CCDM_LINEAR;
    request.ccd_solver_type = fcl::CCDC_CONSERVATIVE_ADVANCEMENT;
    fcl::ContinuousCollisionResultd result;
    fcl::continuousCollide(a.swept, a.motion, b.swept, b.motion, request, result);
    return part_of(result);
  }
};

/// The public function's collisions at even times.
class Poses final : public FclImpacts {
 public:
  Poses(std::string_view name, std::size_t count) : FclImpacts(name), count_(count) {}

  std::string label() const override { return "FCL " + std::to_string(count_) + " poses"; }
  std::string settings() const override {
    return "continuousCollide, " + std::to_string(count_) + " poses, BVHModel<OBBd>, float64";
  }

 private:
  double part_of_step(const Mover& a, const Mover& b) override {
    fcl::ContinuousCollisionRequestd request;
    request.num_max_iterations = count_;
    request.ccd_motion_type = fcl::CCDM_LINEAR;
    request.ccd_solver_type = fcl::CCDC_NAIVE;
    fcl::ContinuousCollisionResultd result;
    fcl::continuousCollide(a.boxes, a.motion, b.boxes, b.motion, request, result);
    return part_of(result);
  }

  const std::size_t count_;
};

/// The advancement that FCL has for oriented volumes, which its public function does not call. Its own loop,
/// conservativeAdvancementMeshOriented(), rebuilds both trees to see whether the bodies meet at the start;
/// oriented boxes tell that at once, so this is that loop without it.
class OrientedAdvancement final : public FclImpacts {
 public:
  using FclImpacts::FclImpacts;

  std::string label() const override { return "FCL oriented"; }
  std::string settings() const override {
    return "MeshConservativeAdvancementTraversalNodeRSS to 1e-5 of the step, BVHModel<OBBd> at the start, "
           "float64";
  }

 private:
  double part_of_step(const Mover& a, const Mover& b) override {
    fcl::CollisionResultd start;
    if (fcl::collide(a.boxes, a.place(), b.boxes, b.place(), fcl::CollisionRequestd(), start)) return 0;
    fcl::detail::MeshConservativeAdvancementTraversalNodeRSS<double> node;
    fcl::detail::initialize(node, *a.swept, a.place(), *b.swept, b.place());
    node.motion1 = a.motion;
    node.motion2 = b.motion;
    while (node.toc < 1) {
      const fcl::Transform3d b_in_a = a.place().inverse(Eigen::Isometry) * b.place();
      node.R = b_in_a.linear();
      node.T = b_in_a.translation();
      node.delta_t = 1;
      node.min_distance = std::numeric_limits<double>::max();
      fcl::detail::distanceRecurse<double>(&node, 0, 0, nullptr);
      if (node.delta_t <= node.t_err) return node.toc;
      node.toc += node.delta_t;
      a.motion->integrate(node.toc);
      b.motion->integrate(node.toc);
    }
    return INFINITY;
  }
};

}  // namespace

std::unique_ptr<Engine> make_fcl(std::string_view name, const Question&) {
  if (name == "fcl-rss") return std::make_unique<BvhDistances<Fcl, fcl::RSSd>>(name, "FCL RSS", "RSSd");
  if (name == "fcl-obbrss")
    return std::make_unique<BvhDistances<Fcl, fcl::OBBRSSd>>(name, "FCL OBBRSS", "OBBRSSd");
  if (name == "fcl-oriented") return std::make_unique<OrientedAdvancement>(name);
  if (name == "fcl-10-poses") return std::make_unique<Poses>(name, 10);
  if (name == "fcl-100-poses") return std::make_unique<Poses>(name, 100);
  if (name == "fcl-public") return std::make_unique<PublicAdvancement>(name);
  return std::make_unique<FclContacts>(name);
}

}  // namespace tandem
