#include "reentry.h"

#include <algorithm>
#include <cmath>

#include "bvhbench/scenes/make_scene_parts.h"

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

bool is_free(const Simulator& simulator, std::uint32_t body, const Vector3d& position) {
  const auto bodies = simulator.bodies();
  const auto states = simulator.states();
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    if (i == body || bodies[i].motion != Motion::moving) continue;
    const double reach = bodies[i].radius + bodies[body].radius;
    if ((states[i].position - position).squaredNorm() < reach * reach) return false;
  }
  return true;
}

}  // namespace

Reentry::Reentry(const AssetView& sheet, std::span<const Instance> grounds, double tilt, std::uint64_t seed)
    : lower_(Vector3d::Constant(HUGE_VAL)), upper_(Vector3d::Constant(-HUGE_VAL)), seed_(seed) {
  const double angle = tilt * M_PI / 180;
  frame_ = Eigen::AngleAxisd(angle, Vector3d::UnitY()).toRotationMatrix();
  const Bounds bounds = bounds_of(sheet);
  for (const Instance& ground : grounds) {
    for (int corner = 0; corner < 8; ++corner) {
      Vector3d world;
      const auto end = [&](int k) { return corner >> k & 1 ? bounds.upper[k] : bounds.lower[k]; };
      tandem::apply(ground.pose, end(0), end(1), end(2), world.data());
      lower_ = lower_.cwiseMin(frame_.transpose() * world);
      upper_ = upper_.cwiseMax(frame_.transpose() * world);
    }
  }
}

bool Reentry::has_left(const Vector3d& position, double radius) const {
  const Vector3d seen = frame_.transpose() * position;
  const bool beside =
      seen.x() > upper_.x() || seen.x() < lower_.x() || seen.y() > upper_.y() || seen.y() < lower_.y();
  return beside || seen.z() < lower_.z() - radius;
}

BodyState Reentry::entry(const Simulator& simulator, std::uint32_t body, std::uint64_t step) const {
  constexpr int kTriesAtAHeight = 30;
  const double radius = simulator.bodies()[body].radius;
  Random random(seed_ * 0x9E3779B97F4A7C15u + step * 0xC2B2AE3D27D4EB4Fu + body);
  BodyState state;
  const Rotation turned = random_rotation(random);
  Eigen::Matrix3d rotation;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rotation(i, j) = turned[i][j];
  }
  state.orientation = Eigen::Quaterniond(rotation).normalized();
  for (double height = upper_.z() + radius;; height += radius) {
    for (int i = 0; i < kTriesAtAHeight; ++i) {
      const double along = lower_.x() + random.between(radius, 3 * radius);
      const double across = random.between(lower_.y() + radius, upper_.y() - radius);
      state.position = frame_ * Vector3d(along, across, height);
      if (is_free(simulator, body, state.position)) return state;
    }
  }
}

std::uint64_t Reentry::apply(Simulator& simulator, std::uint64_t step) const {
  std::uint64_t count = 0;
  for (std::uint32_t i = 0; i < simulator.bodies().size(); ++i) {
    const BodyProperties& body = simulator.bodies()[i];
    if (body.motion != Motion::moving || !has_left(simulator.states()[i].position, body.radius)) continue;
    simulator.place(i, entry(simulator, i, step));
    ++count;
  }
  return count;
}

}  // namespace tandem::simulation
