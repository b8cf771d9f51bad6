#pragma once
#include <vector>

#include "dynamics/contact_finder.h"
#include "kernels/manifold/manifold_scene.h"

/// Small scenes for contact generation.
namespace tandem::test {

/// Bodies, their contacts by the library's queries, and their points.
class ContactScene {
 public:
  std::uint32_t add_shape(const Mesh& mesh, const std::array<double, 3>& origin = {});
  void add_body(std::uint32_t shape, const Pose& pose) { bodies_.push_back({shape, pose}); }
  void move_body(std::size_t body, const Pose& pose) { bodies_[body].pose = pose; }
  void use_threads(std::uint32_t threads) { threads_ = threads; }

  /// The points, with all bodies moved by `motion` first.
  std::vector<dynamics::ContactPoint> points(const Pose& motion = kIdentityPose);

  const dynamics::ContactStatistics& statistics() const { return report_.contacts; }
  std::size_t triangle_pairs() const { return report_.counters.contacts; }

 private:
  SampleAssets assets_;
  std::vector<Instance> bodies_;
  dynamics::FinderReport report_;
  std::uint32_t threads_ = 1;
};

}  // namespace tandem::test
