#include "contact_scene.h"

#include "bvhbench/engines/registry.h"

namespace tandem::test {

using Eigen::Isometry3d;
using Eigen::Vector3d;

std::uint32_t ContactScene::add_shape(const Mesh& mesh, const std::array<double, 3>& origin) {
  assets_.add(mesh, origin);
  return assets_.size() - 1;
}

void ContactScene::add_body(std::uint32_t shape, const Isometry3d& pose) {
  bodies_.emplace_back(shape, pose);
}

std::vector<simulation::ContactPoint> ContactScene::points(const Isometry3d& motion) {
  std::vector<Instance> instances;
  for (const auto& [shape, pose] : bodies_) instances.push_back({shape, to_pose(motion * pose)});
  const auto engine = make_engine("tandem");
  engine->set_shapes(assets_.views());
  engine->find(instances, {}, found_);
  simulation::ContactGenerator generator;
  generator.set_shapes(assets_.views());
  const std::vector<simulation::ContactPoint> points =
      generator.generate(found_, instances, left_out_, threads_);
  statistics_ = generator.statistics();
  return points;
}

Pose to_pose(const Isometry3d& pose) {
  Pose out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.rotation[i][j] = pose.linear()(i, j);
    out.translation[i] = pose.translation()[i];
  }
  return out;
}

Isometry3d at(double x, double y, double z) {
  Isometry3d pose = Isometry3d::Identity();
  pose.translation() = Vector3d(x, y, z);
  return pose;
}

Isometry3d turned(double angle, const Vector3d& axis) {
  return Isometry3d(Eigen::AngleAxisd(angle, axis.normalized()));
}

Isometry3d random_motion(RandomPoses& random, double reach) {
  Eigen::Quaterniond q;
  do {
    for (int k = 0; k < 4; ++k) q.coeffs()[k] = random.symmetric(1);
  } while (q.norm() > 1 || q.norm() < 0.1);
  Isometry3d motion(q.normalized());
  for (int k = 0; k < 3; ++k) motion.translation()[k] = random.symmetric(reach);
  return motion;
}

}  // namespace tandem::test
