#include "contact_scene.h"

#include "dynamics/scene_contacts.h"

namespace tandem::test {

std::uint32_t ContactScene::add_shape(const Mesh& mesh, const std::array<double, 3>& origin) {
  assets_.add(mesh, origin);
  return assets_.size() - 1;
}

std::vector<dynamics::ContactPoint> ContactScene::points(const Pose& motion) {
  std::vector<Instance> moved;
  for (const Instance& body : bodies_) moved.push_back({body.asset, after(motion, body.pose)});
  const auto finder = dynamics::make_scene_contacts(assets_.views(), threads_);
  const std::vector<dynamics::ContactPoint> points = finder->find(moved, {}, {});
  report_ = finder->report();
  return points;
}

}  // namespace tandem::test
