#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "bvhbench/simulator/contacts.h"
#include "kernels/query_scenes.h"
#include "kernels/solid_meshes.h"

/// Small scenes for contact generation.
namespace tandem::test {

/// Bodies, their contacts by the CPU engine, and their points.
class ContactScene {
 public:
  std::uint32_t add_shape(const Mesh& mesh, const std::array<double, 3>& origin = {});
  void add_body(std::uint32_t shape, const Eigen::Isometry3d& pose);
  std::size_t bodies() const { return bodies_.size(); }

  /// The points, with all bodies moved by `motion` first.
  std::vector<simulation::ContactPoint> points(
      const Eigen::Isometry3d& motion = Eigen::Isometry3d::Identity());
  void swap_bodies() { std::swap(bodies_[0], bodies_[1]); }
  void move_body(std::size_t body, const Eigen::Isometry3d& pose) { bodies_[body].second = pose; }

  void use_threads(std::uint32_t threads) { threads_ = threads; }
  /// Pairs that points() makes no points of, ascending.
  void leave_out(std::vector<ObjectPair> pairs) { left_out_ = std::move(pairs); }

  const simulation::ContactStatistics& statistics() const { return statistics_; }
  std::size_t triangle_pairs() const { return found_.triangles.size(); }

 private:
  SampleAssets assets_;
  std::vector<std::pair<std::uint32_t, Eigen::Isometry3d>> bodies_;
  ContactList found_;
  simulation::ContactStatistics statistics_;
  std::vector<ObjectPair> left_out_;
  std::uint32_t threads_ = 1;
};

Pose to_pose(const Eigen::Isometry3d& pose);

Eigen::Isometry3d at(double x, double y, double z);
Eigen::Isometry3d turned(double angle, const Eigen::Vector3d& axis);
/// A uniformly random rotation, and a translation of up to `reach`.
Eigen::Isometry3d random_motion(RandomPoses& random, double reach);

}  // namespace tandem::test
