#include "dynamics/rigid_body.h"

#include <algorithm>
#include <cmath>

#include "tandem/kernels/world_box.h"

namespace tandem::dynamics {
namespace {

// It is false of NaN.
bool is_within(const Vector3& x, double most) {
  return std::fabs(x.x) <= most && std::fabs(x.y) <= most && std::fabs(x.z) <= most;
}

Vector3 turn_into_world(const Quaternion& orientation, const Matrix3& tensor, const Vector3& vector) {
  const Matrix3 rotation = matrix_of(orientation);
  return rotation * (tensor * (transposed(rotation) * vector));
}

// Solves for the mean angular velocity of the step by fixed-point iteration, whose rate is about the angle
// turned in half a step.
Vector3 midpoint_angular_velocity(const BodyProperties& body, const BodyState& state, const Vector3& momentum,
                                  double dt) {
  constexpr int kIterations = 4;
  Vector3 middle = state.angular_velocity;
  for (int i = 0; i < kIterations; ++i) {
    const Quaternion half = rotation_by(0.5 * dt * middle) * state.orientation;
    middle = turn_into_world(half, body.inverse_inertia, momentum);
  }
  return middle;
}

void rotate(const BodyProperties& body, BodyState& state, const Vector3& correction, double dt) {
  if (body.motion != Motion::moving) {
    state.orientation = normalized(rotation_by(dt * state.angular_velocity) * state.orientation);
    return;
  }
  constexpr double kTurn = 0.05;  // in a part: its error is about a thirtieth of the square, of the turn
  constexpr double kMostParts = 1000;
  constexpr double kGain = 0.05;  // of free rotation by rounding and parts, at most
  const BodyState before = state;
  const Vector3 momentum = turn_into_world(state.orientation, body.inertia, state.angular_velocity);
  const double turn = dt * norm(state.angular_velocity);
  const double parts = turn < kTurn * kMostParts ? std::max(1.0, std::ceil(turn / kTurn)) : kMostParts;
  for (double i = 0; i < parts; ++i) {
    const Vector3 middle = midpoint_angular_velocity(body, state, momentum, dt / parts);
    state.orientation = normalized(rotation_by((dt / parts) * (middle + correction)) * state.orientation);
    state.angular_velocity = turn_into_world(state.orientation, body.inverse_inertia, momentum);
  }
  // A correction that tilts a slender body under its spin would give it energy: the spin tilts with it.
  if (dot(momentum, state.angular_velocity) > (1 + kGain) * dot(momentum, before.angular_velocity)) {
    const Vector3 in_body = rotated(conjugated(before.orientation), before.angular_velocity);
    state.angular_velocity = rotated(state.orientation, in_body);
  }
}

}  // namespace

BodyProperties body_properties(std::uint32_t shape, const MassProperties& mesh, double density) {
  BodyProperties body;
  body.shape = shape;
  body.mass = density * mesh.volume;
  body.density = density;
  body.centre = mesh.centre;
  body.inertia = density * mesh.inertia_per_density;
  body.inverse_inertia = inverse(body.inertia);
  return body;
}

BodyProperties of_density(BodyProperties body, double density) {
  body.mass *= density;
  body.density = density;
  body.inertia = density * body.inertia;
  body.inverse_inertia = (1 / density) * body.inverse_inertia;
  return body;
}

double default_slop(std::span<const AssetView> shapes, std::span<const BodyProperties> bodies) {
  constexpr double kOfDiagonal = 1.0 / 4000, kDiagonal = 2;
  double least = INFINITY;
  for (const BodyProperties& body : bodies) {
    const FileHeader& header = *shapes[body.shape].header;
    if (body.motion == Motion::moving)
      least = std::min(least, norm(vector_of(header.upper) - vector_of(header.lower)));
  }
  return kOfDiagonal * (std::isfinite(least) ? least : kDiagonal);
}

bool is_usable(const BodyState& state) {
  return is_within(state.position, kLargestWorldCoordinate) && std::isfinite(state.orientation.w) &&
         is_within(state.velocity, kFastest) && is_within(state.angular_velocity, kFastest);
}

bool is_usable_mass(double mass) {
  constexpr double kMost = 1e30;
  return mass >= 1 / kMost && mass <= kMost;
}

Instance pose_of(const BodyProperties& body, const BodyState& state) {
  const Matrix3 rotation = matrix_of(state.orientation);
  const Vector3 translation = state.position - rotation * body.centre;
  Instance pose{body.shape, kIdentityPose};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.pose.rotation[i][j] = at(rotation.row[i], j);
    pose.pose.translation[i] = at(translation, i);
  }
  return pose;
}

BodyState state_of(const BodyProperties& body, const Pose& pose) {
  BodyState state;
  state.orientation = quaternion_of(pose.rotation);
  state.position = vector_of(pose.translation) + matrix_of(state.orientation) * body.centre;
  return state;
}

Matrix3 world_inverse_inertia(const BodyProperties& body, const BodyState& state) {
  if (body.motion != Motion::moving) return Matrix3{};
  const Matrix3 rotation = matrix_of(state.orientation);
  return rotation * body.inverse_inertia * transposed(rotation);
}

Pull pull_on(const BodyProperties& body, const BodyState& state, const Vector3& gravity,
             const BodyForce& force) {
  Pull pull = {body.gravity_scale * gravity, {}};
  if (body.motion != Motion::moving || force == BodyForce{}) return pull;
  pull.linear += force.force / body.mass;
  pull.angular = world_inverse_inertia(body, state) * force.torque;
  pull.turning = body.radius * norm(pull.angular);
  return pull;
}

void advance(const BodyProperties& body, BodyState& state, const Vector3& correction,
             const Vector3& angular_correction, double dt) {
  if (body.motion == Motion::fixed) return;
  state.position += dt * (state.velocity + correction);
  rotate(body, state, angular_correction, dt);
}

double kinetic_energy(const BodyProperties& body, const BodyState& state) {
  if (body.motion != Motion::moving) return 0;
  const Vector3 spin = turn_into_world(state.orientation, body.inertia, state.angular_velocity);
  return 0.5 * (body.mass * square(state.velocity) + dot(spin, state.angular_velocity));
}

Vector3 angular_momentum(const BodyProperties& body, const BodyState& state) {
  if (body.motion != Motion::moving) return Vector3{};
  const Vector3 spin = turn_into_world(state.orientation, body.inertia, state.angular_velocity);
  return spin + body.mass * cross(state.position, state.velocity);
}

}  // namespace tandem::dynamics
