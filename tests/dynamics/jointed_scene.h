#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kernels/manifold/manifold_scene.h"
#include "tandem/dynamics/world.h"

/// Bodies that joints hold, for tests.
namespace tandem::test {

inline constexpr double kStep = 1.0 / 60, kGravity = 9.81;

inline Pose inverse(const Pose& pose) {
  Pose out = kIdentityPose;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.rotation[i][j] = pose.rotation[j][i];
  }
  const Vector3 back = rotate(out, vector_of(pose.translation));
  out.translation[0] = -back.x, out.translation[1] = -back.y, out.translation[2] = -back.z;
  return out;
}

/// Boxes, and joints between them.
class JointedScene {
 public:
  BodyDescription& add(const Mesh& mesh, const Pose& pose) {
    assets_.add(mesh);
    BodyDescription& body = bodies.emplace_back();
    body.asset = static_cast<std::uint32_t>(bodies.size() - 1), body.pose = pose;
    return body;
  }
  BodyDescription& add_box(const Vector3& size, const Pose& pose) {
    sizes_.resize(bodies.size());
    sizes_.push_back(size);
    return add(box(static_cast<float>(size.x), static_cast<float>(size.y), static_cast<float>(size.z)), pose);
  }
  World& begin(const WorldOptions& options = {.sleeping = false}) {
    EXPECT_EQ(world.set_assets(assets_.views()), Status::kOk);
    EXPECT_EQ(world.set_bodies(bodies, options, {}, joints), Status::kOk);
    start_.assign(world.bodies().begin(), world.bodies().end());
    return world;
  }

  /// How far a joint's anchors are apart, which were in one place.
  double apart(const JointDescription& joint) const {
    const auto carried = [&](std::uint32_t body) {
      const Vector3 at = vector_of(joint.anchor);
      return body == kNoIndex ? at : apply(world.bodies()[body].pose, apply(inverse(start_[body].pose), at));
    };
    return norm(carried(joint.a) - carried(joint.b));
  }
  double most_apart() const {
    double most = 0;
    for (const JointDescription& joint : joints) most = std::max(most, apart(joint));
    return most;
  }

  struct Sums {
    Vector3 momentum, angular_momentum;
    double kinetic = 0, potential = 0;

    double energy() const { return kinetic + potential; }
  };
  /// Condition: all bodies are boxes.
  Sums sums() const {
    Sums sum;
    for (std::uint32_t i = 0; i < bodies.size(); ++i) {
      const BodyMotion& body = world.bodies()[i];
      const double m = world.mass_of(i);
      const Vector3 v = vector_of(body.velocity), w = vector_of(body.angular_velocity), s = sizes_[i];
      const double x = s.x * s.x, y = s.y * s.y, z = s.z * s.z, inertia[3] = {y + z, z + x, x + y};
      Vector3 spin;
      for (int k = 0; k < 3; ++k) {
        const Vector3 axis = rotate(body.pose, {k == 0 ? 1.0 : 0, k == 1 ? 1.0 : 0, k == 2 ? 1.0 : 0});
        spin = spin + (m / 12 * inertia[k] * dot(w, axis)) * axis;
      }
      sum.momentum = sum.momentum + m * v;
      sum.angular_momentum = sum.angular_momentum + m * cross(vector_of(body.centre), v) + spin;
      sum.kinetic += 0.5 * (m * dot(v, v) + dot(w, spin));
      sum.potential += m * kGravity * body.centre[2];
    }
    return sum;
  }

  std::vector<BodyDescription> bodies;
  std::vector<JointDescription> joints;
  World world;

 private:
  SampleAssets assets_;
  std::vector<Vector3> sizes_;
  std::vector<BodyMotion> start_;
};

/// A rod that hangs on the world by its end, from the horizontal.
class Pendulum : public JointedScene {
 public:
  explicit Pendulum(JointKind kind) {
    add_box({1, 0.2, 0.2}, shift(0.5, 0, 0));
    joints.push_back({.kind = kind, .b = 0, .axis = {0, 1, 0}});
  }
  double mass() const { return world.mass_of(0); }
  double inertia() const { return mass() * (1.04 / 12 + 0.25); }  // about the end
};

/// Links of 0.2 m in a row, the first of which hangs on the world. last: how many times as heavy the last one
/// is.
class Chain : public JointedScene {
 public:
  Chain(const Pose& pose, double last) {
    for (std::uint32_t i = 0; i < 20; ++i) {
      add_box({0.2, 0.05, 0.05}, after(pose, shift(0.1 + 0.2 * i, 0, 0))).filter.mask = 0;
      joints.push_back({.a = i == 0 ? kNoIndex : i - 1, .b = i});
      const Vector3 at = apply(pose, {0.2 * i, 0, 0});
      joints.back().anchor[0] = at.x, joints.back().anchor[2] = at.z;
    }
    bodies.back().density = 1000 * last;
  }
};

}  // namespace tandem::test
