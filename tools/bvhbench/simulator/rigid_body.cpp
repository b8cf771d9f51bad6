#include "rigid_body.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace tandem::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// The turn by |angle| about the direction of `angle`.
Quaterniond rotation_by(const Vector3d& angle) {
  const double half = 0.5 * angle.norm();
  // sin(x) / x differs from 1 by less than half a unit in the last place.
  const double sine_over = half < 1e-9 ? 0.5 : 0.5 * std::sin(half) / half;
  return Quaterniond(std::cos(half), sine_over * angle.x(), sine_over * angle.y(), sine_over * angle.z());
}

Vector3d turn_into_world(const Quaterniond& orientation, const Matrix3d& tensor, const Vector3d& vector) {
  const Matrix3d rotation = orientation.toRotationMatrix();
  return rotation * (tensor * (rotation.transpose() * vector));
}

// Solves for the mean angular velocity of the step by fixed-point iteration, whose rate is about the angle
// turned in half a step.
Vector3d midpoint_angular_velocity(const BodyProperties& body, const BodyState& state,
                                   const Vector3d& momentum, double dt) {
  constexpr int kIterations = 4;
  Vector3d middle = state.angular_velocity;
  for (int i = 0; i < kIterations; ++i) {
    const Quaterniond half = rotation_by(0.5 * dt * middle) * state.orientation;
    middle = turn_into_world(half, body.inverse_inertia, momentum);
  }
  return middle;
}

void rotate(const BodyProperties& body, BodyState& state, const Vector3d& correction, double dt) {
  if (body.motion != Motion::moving) {
    state.orientation = (rotation_by(dt * state.angular_velocity) * state.orientation).normalized();
    return;
  }
  const Vector3d momentum = turn_into_world(state.orientation, body.inertia, state.angular_velocity);
  const Vector3d middle = midpoint_angular_velocity(body, state, momentum, dt);
  state.orientation = (rotation_by(dt * (middle + correction)) * state.orientation).normalized();
  state.angular_velocity = turn_into_world(state.orientation, body.inverse_inertia, momentum);
}

}  // namespace

BodyProperties body_properties(std::uint32_t shape, const MassProperties& mesh, double density) {
  BodyProperties body;
  body.shape = shape;
  body.mass = density * mesh.volume;
  body.centre = mesh.centre;
  body.inertia = density * mesh.inertia_per_density;
  body.inverse_inertia = body.inertia.inverse();
  return body;
}

BodyPose pose_of(const BodyProperties& body, const BodyState& state) {
  const Matrix3d rotation = state.orientation.toRotationMatrix();
  const Vector3d translation = state.position - rotation * body.centre;
  BodyPose pose{body.shape, kIdentityPose};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.pose.rotation[i][j] = rotation(i, j);
    pose.pose.translation[i] = translation[i];
  }
  return pose;
}

BodyState state_of(const BodyProperties& body, const Pose& pose) {
  Matrix3d rotation;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rotation(i, j) = pose.rotation[i][j];
  }
  BodyState state;
  state.orientation = Quaterniond(rotation).normalized();
  const Vector3d translation(pose.translation[0], pose.translation[1], pose.translation[2]);
  state.position = translation + state.orientation.toRotationMatrix() * body.centre;
  return state;
}

Matrix3d world_inverse_inertia(const BodyProperties& body, const BodyState& state) {
  if (body.motion != Motion::moving) return Matrix3d::Zero();
  const Matrix3d rotation = state.orientation.toRotationMatrix();
  return rotation * body.inverse_inertia * rotation.transpose();
}

void advance(const BodyProperties& body, BodyState& state, const Vector3d& correction,
             const Vector3d& angular_correction, double dt) {
  if (body.motion == Motion::fixed) return;
  state.position += dt * (state.velocity + correction);
  rotate(body, state, angular_correction, dt);
}

double kinetic_energy(const BodyProperties& body, const BodyState& state) {
  if (body.motion != Motion::moving) return 0;
  const Vector3d spin = turn_into_world(state.orientation, body.inertia, state.angular_velocity);
  return 0.5 * (body.mass * state.velocity.squaredNorm() + spin.dot(state.angular_velocity));
}

Vector3d angular_momentum(const BodyProperties& body, const BodyState& state) {
  if (body.motion != Motion::moving) return Vector3d::Zero();
  const Vector3d spin = turn_into_world(state.orientation, body.inertia, state.angular_velocity);
  return spin + body.mass * state.position.cross(state.velocity);
}

}  // namespace tandem::simulation
