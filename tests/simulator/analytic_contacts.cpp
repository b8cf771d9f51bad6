#include "analytic_contacts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/geometry/pair_motion.h"
#include "kernels/manifold/manifold_scene.h"

namespace tandem::simulation {
namespace {

constexpr double kWide = 1e4;  // the radius of a half-space

class NoContacts : public AnalyticContacts {
  void find_all(std::span<const BodyPose>, std::vector<ContactPoint>&) override {}
  double radius(std::uint32_t) const override { return kWide; }
};

// A cube in a sphere of this radius.
AssetBox cube_of(double radius) {
  const auto half = static_cast<float>(radius / std::sqrt(3));
  return asset_box({-half, -half, -half}, {half, half, half}, {0, 0, 0});
}

Matrix3 rotation_of(const Pose& pose) {
  return {{vector_of(pose.rotation[0]), vector_of(pose.rotation[1]), vector_of(pose.rotation[2])}};
}

Vector3 to_body(const Pose& pose, const Vector3& point) {
  return transposed(rotation_of(pose)) * (point - vector_of(pose.translation));
}

class BoxesOnPlane : public AnalyticContacts {
 public:
  BoxesOnPlane(const Vector3& normal, const Vector3& size, double flicker)
      : normal_(normal), half_(0.5 * size), flicker_(flicker) {}

 private:
  void find_all(std::span<const BodyPose> bodies, std::vector<ContactPoint>& points) override {
    for (std::uint32_t i = 1; i < bodies.size(); ++i) on_plane(i, bodies[i].pose, points);
    for (std::uint32_t i = 1; i + 1 < bodies.size(); ++i)
      on_box(i, bodies[i].pose, bodies[i + 1].pose, points);
    for (ContactPoint& point : points) point.depth += flicker_ * static_cast<double>(++calls_ % 3);
  }
  double radius(std::uint32_t body) const override { return body == 0 ? kWide : norm(half_); }

  Vector3 corner(int i) const {
    return {i & 1 ? half_.x : -half_.x, i & 2 ? half_.y : -half_.y, i & 4 ? half_.z : -half_.z};
  }

  void on_plane(std::uint32_t body, const Pose& pose, std::vector<ContactPoint>& points) const {
    for (int i = 0; i < 8; ++i) {
      const Vector3 at = test::apply(pose, corner(i));
      const double height = dot(normal_, at);
      if (height <= 0) points.push_back({0, body, at, normal_, -height, static_cast<std::uint64_t>(i + 1)});
    }
  }

  void on_box(std::uint32_t body, const Pose& lower, const Pose& upper,
              std::vector<ContactPoint>& points) const {
    const Vector3 up = rotation_of(lower) * kUp;
    for (int i = 0; i < 4; ++i) {
      const Vector3 at = test::apply(upper, corner(i)), seen = to_body(lower, at);
      const bool over = std::fabs(seen.x) <= 1.1 * half_.x && std::fabs(seen.y) <= 1.1 * half_.y;
      const double depth = half_.z - seen.z;
      if (over && depth >= 0)
        points.push_back({body, body + 1, at, up, depth, static_cast<std::uint64_t>(i + 1)});
    }
  }

  Vector3 normal_, half_;
  double flicker_;
  std::uint64_t calls_ = 0;
};

class BallsOnPlane : public AnalyticContacts {
 public:
  BallsOnPlane(const Vector3& normal, double radius) : normal_(normal), radius_(radius) {}

 private:
  void find_all(std::span<const BodyPose> bodies, std::vector<ContactPoint>& points) override {
    for (std::uint32_t i = 1; i < bodies.size(); ++i) {
      const Vector3 centre = test::apply(bodies[i].pose, Vector3{});
      const double depth = radius_ - dot(normal_, centre);
      if (depth >= 0) points.push_back({0, i, centre - radius_ * normal_, normal_, depth, 1});
    }
  }
  double radius(std::uint32_t body) const override { return body == 0 ? kWide : radius_; }

  Vector3 normal_;
  double radius_;
};

}  // namespace

std::vector<ObjectPair> PairJudge::kept(std::span<const ObjectPair> pairs, std::span<const BodyPose> bodies,
                                        std::span<const double> radii, double tolerance) {
  std::vector<ObjectPair> kept;
  const std::vector<PosedBodies> before = std::exchange(posed_, {});
  for (const ObjectPair& pair : pairs) {
    const PosedBodies now = {pair, bodies[pair.a], bodies[pair.b]};
    const auto then = std::ranges::lower_bound(before, pair, {}, &PosedBodies::pair);
    const bool stays = then != before.end() && then->pair == pair &&
                       is_kept(cube_of(radii[pair.a]), cube_of(radii[pair.b]), {then->a.pose, then->b.pose},
                               {now.a.pose, now.b.pose}, tolerance);
    if (stays) kept.push_back(pair);
    posed_.push_back(stays ? *then : now);
  }
  return kept;
}

const std::vector<ContactPoint>& AnalyticContacts::find(std::span<const BodyPose> bodies,
                                                        std::span<const std::uint8_t>,
                                                        const Keeping& keeping) {
  points_.clear();
  find_all(bodies, points_);
  std::vector<ObjectPair> pairs(keeping.remembered.begin(), keeping.remembered.end());
  for (const ContactPoint& point : points_) pairs.push_back({point.body_a, point.body_b});
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  std::vector<double> radii;
  for (std::uint32_t i = 0; i < bodies.size(); ++i) radii.push_back(radius(i));
  kept_ = judge_.kept(pairs, bodies, radii, keeping.tolerance);
  return points_;
}

BodyProperties box_body(const Vector3& size, double mass) {
  BodyProperties body;
  body.mass = mass;
  body.radius = 0.5 * norm(size);
  const double x = size.x * size.x, y = size.y * size.y, z = size.z * size.z;
  body.inertia = mass / 12 * Matrix3{{{y + z, 0, 0}, {0, z + x, 0}, {0, 0, x + y}}};
  body.inverse_inertia = inverse(body.inertia);
  return body;
}

BodyProperties ball_body(double radius, double mass) {
  BodyProperties body;
  body.mass = mass;
  body.radius = radius;
  body.inertia = 0.4 * mass * radius * radius * Matrix3::identity();
  body.inverse_inertia = inverse(body.inertia);
  return body;
}

BodyProperties fixed_body() {
  BodyProperties body;
  body.motion = Motion::fixed;
  return body;
}

std::unique_ptr<ContactFinder> boxes_on_plane(const Vector3& normal, const Vector3& size, double flicker) {
  return std::make_unique<BoxesOnPlane>(normal, size, flicker);
}

std::unique_ptr<ContactFinder> balls_on_plane(const Vector3& normal, double radius) {
  return std::make_unique<BallsOnPlane>(normal, radius);
}

std::unique_ptr<ContactFinder> no_contacts() {
  return std::make_unique<NoContacts>();
}

}  // namespace tandem::simulation
