#include <fcl/math/motion/interp_motion.h>
#include <fcl/narrowphase/continuous_collision.h>

#include <cmath>
#include <limits>

#include "fcl_model.h"
#include "impact_engine.h"

namespace tandem {
namespace {

using FclMotion = fcl::InterpMotion<double>;

/// The motion as FCL interpolates it between the start of the step and its end: the centre goes straight
/// ahead, and the body turns about it by the shortest rotation, both at constant speed. That is the motion
/// itself where it turns by less than half a turn.
std::unique_ptr<FclMotion> fcl_motion(const Pose& start, const Pose& end, const RigidMotion& motion) {
  const fcl::Transform3d from = fcl_transform(start), to = fcl_transform(end);
  const fcl::Vector3d center = from.inverse(Eigen::Isometry) * fcl::Vector3d(motion.center);
  return std::make_unique<FclMotion>(from.linear(), from.translation(), to.linear(), to.translation(),
                                     center);
}

/// What is the same for all of FCL's ways.
class FclImpact : public ImpactEngine {
 public:
  void set_shapes(std::span<const AssetView> shapes) final {
    shapes_ = shapes;
    boxes_.clear();
    swept_.clear();
    for (const AssetView& shape : shapes) {
      boxes_.push_back(fcl_model<fcl::OBBd>(shape.level()));
      swept_.push_back(fcl_model<fcl::RSSd>(shape.level()));
    }
  }

  void update(std::span<const Instance> bodies, std::span<const RigidMotion> motions, double duration) final {
    bodies_ = bodies;
    duration_ = duration;
    motions_.clear();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const auto& origin = shapes_[bodies[i].asset].header->origin;
      const Pose end = pose_at(bodies[i].pose, motions[i], duration);
      motions_.push_back(fcl_motion(for_stored_coordinates(bodies[i].pose, origin),
                                    for_stored_coordinates(end, origin), motions[i]));
    }
  }

  void find(std::span<const ObjectPair> pairs, std::vector<double>& times) final {
    times.clear();
    for (const auto& [a, b] : pairs) {
      motions_[a]->integrate(0);  // conservative advancement begins where the motion was left
      motions_[b]->integrate(0);
      times.push_back(duration_ * part_of_step(mover(a), mover(b)));
    }
  }

 protected:
  struct Mover {
    const fcl::BVHModel<fcl::OBBd>* boxes;
    const fcl::BVHModel<fcl::RSSd>* swept;  ///< rectangles swept by spheres
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

  Mover mover(std::uint32_t body) const {
    const std::uint32_t shape = bodies_[body].asset;
    return {boxes_[shape].get(), swept_[shape].get(), motions_[body].get()};
  }

  std::span<const AssetView> shapes_;
  std::span<const Instance> bodies_;
  double duration_ = 0;
  std::vector<std::shared_ptr<fcl::BVHModel<fcl::OBBd>>> boxes_;
  std::vector<std::shared_ptr<fcl::BVHModel<fcl::RSSd>>> swept_;
  std::vector<std::unique_ptr<FclMotion>> motions_;
};

double part_of(const fcl::ContinuousCollisionResultd& result) {
  return result.is_collide ? result.time_of_contact : INFINITY;
}

/// The public function's conservative advancement.
class PublicAdvancement final : public FclImpact {
 public:
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
class Poses final : public FclImpact {
 public:
  explicit Poses(std::size_t count) : count_(count) {}

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
class OrientedAdvancement final : public FclImpact {
 public:
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

void add_fcl_impact(std::vector<std::unique_ptr<ImpactEngine>>& engines) {
  engines.push_back(std::make_unique<OrientedAdvancement>());
  for (const std::size_t count : {10, 100}) engines.push_back(std::make_unique<Poses>(count));
  engines.push_back(std::make_unique<PublicAdvancement>());
}

}  // namespace tandem
