#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "kernels/query_scenes.h"
#include "simulator/contacts/contact_generation.h"

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

  const simulation::ContactStatistics& statistics() const { return statistics_; }
  std::size_t triangle_pairs() const { return found_.triangles.size(); }

 private:
  SampleAssets assets_;
  std::vector<std::pair<std::uint32_t, Eigen::Isometry3d>> bodies_;
  ContactList found_;
  simulation::ContactStatistics statistics_;
  std::uint32_t threads_ = 1;
};

Pose to_pose(const Eigen::Isometry3d& pose);

Eigen::Isometry3d at(double x, double y, double z);
Eigen::Isometry3d turned(double angle, const Eigen::Vector3d& axis);
/// A uniformly random rotation, and a translation of up to `reach`.
Eigen::Isometry3d random_motion(RandomPoses& random, double reach);

/// A flat sheet in z = 0 of side `size`, its normals up, in cells^2 squares of two triangles.
Mesh sheet(float size, int cells);
/// The octahedron's sphere, each triangle split into four `splits` times.
Mesh sphere(double radius, int splits);
/// A closed box.
Mesh box(float x, float y, float z);
/// Both meshes in one.
Mesh joined(const Mesh& a, const Mesh& b);
Mesh moved(Mesh mesh, float x, float y, float z);
/// One of the project's own meshes.
Mesh project_mesh(const char* name);

}  // namespace tandem::test
