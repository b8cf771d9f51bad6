#include "analytic_contacts.h"

#include <Eigen/LU>
#include <cmath>

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

class NoContacts : public ContactFinder {
 public:
  const std::vector<ContactPoint>& find(std::span<const BodyPose>, std::span<const std::uint8_t>,
                                        std::span<const ObjectPair>) override {
    return none_;
  }

 private:
  std::vector<ContactPoint> none_;
};

Vector3d to_world(const Pose& pose, const Vector3d& point) {
  Vector3d out;
  apply(pose, point.x(), point.y(), point.z(), out.data());
  return out;
}

Eigen::Matrix3d rotation_of(const Pose& pose) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&pose.rotation[0][0]);
}

Vector3d to_body(const Pose& pose, const Vector3d& point) {
  return rotation_of(pose).transpose() * (point - Eigen::Map<const Vector3d>(pose.translation));
}

class BoxesOnPlane : public ContactFinder {
 public:
  BoxesOnPlane(const Vector3d& normal, const Vector3d& size) : normal_(normal), half_(0.5 * size) {}

  const std::vector<ContactPoint>& find(std::span<const BodyPose> bodies, std::span<const std::uint8_t>,
                                        std::span<const ObjectPair>) override {
    points_.clear();
    for (std::uint32_t i = 1; i < bodies.size(); ++i) on_plane(i, bodies[i].pose);
    for (std::uint32_t i = 1; i + 1 < bodies.size(); ++i) on_box(i, bodies[i].pose, bodies[i + 1].pose);
    return points_;
  }

 private:
  Vector3d corner(int i) const {
    return {i & 1 ? half_.x() : -half_.x(), i & 2 ? half_.y() : -half_.y(), i & 4 ? half_.z() : -half_.z()};
  }

  void on_plane(std::uint32_t body, const Pose& pose) {
    for (int i = 0; i < 8; ++i) {
      const Vector3d at = to_world(pose, corner(i));
      const double height = normal_.dot(at);
      if (height <= 0) points_.push_back({0, body, at, normal_, -height, static_cast<std::uint64_t>(i + 1)});
    }
  }

  void on_box(std::uint32_t body, const Pose& lower, const Pose& upper) {
    const Vector3d up = rotation_of(lower) * Vector3d::UnitZ();
    for (int i = 0; i < 4; ++i) {
      const Vector3d at = to_world(upper, corner(i)), seen = to_body(lower, at);
      const bool over = std::fabs(seen.x()) <= 1.1 * half_.x() && std::fabs(seen.y()) <= 1.1 * half_.y();
      const double depth = half_.z() - seen.z();
      if (over && depth >= 0)
        points_.push_back({body, body + 1, at, up, depth, static_cast<std::uint64_t>(i + 1)});
    }
  }

  Vector3d normal_, half_;
  std::vector<ContactPoint> points_;
};

class BallsOnPlane : public ContactFinder {
 public:
  BallsOnPlane(const Vector3d& normal, double radius) : normal_(normal), radius_(radius) {}

  const std::vector<ContactPoint>& find(std::span<const BodyPose> bodies, std::span<const std::uint8_t>,
                                        std::span<const ObjectPair>) override {
    points_.clear();
    for (std::uint32_t i = 1; i < bodies.size(); ++i) {
      const Vector3d centre = to_world(bodies[i].pose, Vector3d::Zero());
      const double depth = radius_ - normal_.dot(centre);
      if (depth >= 0) points_.push_back({0, i, centre - radius_ * normal_, normal_, depth, 1});
    }
    return points_;
  }

 private:
  Vector3d normal_;
  double radius_;
  std::vector<ContactPoint> points_;
};

}  // namespace

BodyProperties box_body(const Vector3d& size, double mass) {
  BodyProperties body;
  body.mass = mass;
  body.radius = 0.5 * size.norm();
  const Vector3d squares = size.cwiseProduct(size);
  body.inertia = (mass / 12 * (Vector3d::Constant(squares.sum()) - squares)).asDiagonal();
  body.inverse_inertia = body.inertia.inverse();
  return body;
}

BodyProperties ball_body(double radius, double mass) {
  BodyProperties body;
  body.mass = mass;
  body.radius = radius;
  body.inertia = 0.4 * mass * radius * radius * Eigen::Matrix3d::Identity();
  body.inverse_inertia = body.inertia.inverse();
  return body;
}

BodyProperties fixed_body() {
  BodyProperties body;
  body.motion = Motion::fixed;
  return body;
}

std::unique_ptr<ContactFinder> boxes_on_plane(const Vector3d& normal, const Vector3d& size) {
  return std::make_unique<BoxesOnPlane>(normal, size);
}

std::unique_ptr<ContactFinder> balls_on_plane(const Vector3d& normal, double radius) {
  return std::make_unique<BallsOnPlane>(normal, radius);
}

std::unique_ptr<ContactFinder> no_contacts() {
  return std::make_unique<NoContacts>();
}

}  // namespace tandem::simulation
