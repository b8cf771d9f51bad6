#include <fcl/math/motion/interp_motion.h>
#include <fcl/narrowphase/continuous_collision.h>

#include <cmath>

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
template <typename Volume>
class FclImpact : public ImpactEngine {
 public:
  using Model = fcl::BVHModel<Volume>;

  void set_shapes(std::span<const AssetView> shapes) final {
    models_.clear();
    shapes_ = shapes;
    for (const AssetView& shape : shapes) models_.push_back(fcl_model<Volume>(shape.level()));
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
      times.push_back(duration_ * part_of_step(*models_[bodies_[a].asset], *motions_[a],
                                               *models_[bodies_[b].asset], *motions_[b]));
    }
  }

 private:
  /// Infinite where the bodies do not meet.
  virtual double part_of_step(const Model& a, const FclMotion& motion_a, const Model& b,
                              const FclMotion& motion_b) = 0;

  std::span<const AssetView> shapes_;
  std::span<const Instance> bodies_;
  double duration_ = 0;
  std::vector<std::shared_ptr<Model>> models_;
  std::vector<std::unique_ptr<FclMotion>> motions_;
};

/// The public function, by conservative advancement or by collisions at even times.
template <typename Volume>
class PublicImpact final : public FclImpact<Volume> {
 public:
  using Model = typename FclImpact<Volume>::Model;

  PublicImpact(std::string label, std::string settings, const fcl::ContinuousCollisionRequestd& request)
      : label_(std::move(label)), settings_(std::move(settings)), request_(request) {}

  std::string label() const override { return label_; }
  std::string settings() const override { return settings_; }

 private:
  double part_of_step(const Model& a, const FclMotion& motion_a, const Model& b,
                      const FclMotion& motion_b) override {
    fcl::ContinuousCollisionResultd result;
    fcl::continuousCollide(&a, &motion_a, &b, &motion_b, request_, result);
    return result.is_collide ? result.time_of_contact : INFINITY;
  }

  const std::string label_, settings_;
  const fcl::ContinuousCollisionRequestd request_;
};

/// FCL's own advancement of oriented volumes, which its public function does not call.
class InnerImpact final : public FclImpact<fcl::RSSd> {
 public:
  std::string label() const override { return "FCL inner"; }
  std::string settings() const override {
    return "conservativeAdvancementMeshOriented, BVHModel<RSSd>, 1e-5 of the step, float64";
  }

 private:
  double part_of_step(const Model& a, const FclMotion& motion_a, const Model& b,
                      const FclMotion& motion_b) override {
    using Node = fcl::detail::MeshConservativeAdvancementTraversalNodeRSS<double>;
    const fcl::CollisionRequestd request;
    fcl::CollisionResultd result;
    double part = 0;
    const bool meet = fcl::detail::conservativeAdvancementMeshOriented<fcl::RSSd, Node>(
        a, &motion_a, b, &motion_b, request, result, part);
    return meet ? part : INFINITY;
  }
};

fcl::ContinuousCollisionRequestd request_for(fcl::CCDSolverType solver, std::size_t count) {
  fcl::ContinuousCollisionRequestd request;
  request.num_max_iterations = count;
  request.ccd_motion_type = fcl::CCDM_LINEAR;
  request.ccd_solver_type = solver;
  return request;
}

}  // namespace

void add_fcl_impact(std::vector<std::unique_ptr<ImpactEngine>>& engines) {
  engines.push_back(std::make_unique<PublicImpact<fcl::RSSd>>(
      "FCL RSS", "continuousCollide, conservative advancement, BVHModel<RSSd>, 1e-5 of the step, float64",
      request_for(fcl::CCDC_CONSERVATIVE_ADVANCEMENT, 10)));
  engines.push_back(std::make_unique<InnerImpact>());
  for (const std::size_t count : {10, 100}) {
    const std::string poses = std::to_string(count) + " poses";
    engines.push_back(std::make_unique<PublicImpact<fcl::OBBd>>(
        "FCL " + poses, "continuousCollide, " + poses + ", BVHModel<OBBd>, float64",
        request_for(fcl::CCDC_NAIVE, count)));
  }
}

}  // namespace tandem
