#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "dynamics/mass_properties.h"
#include "tandem/dynamics/material.h"
#include "tandem/kernels/scene.h"
#include "tandem/kernels/world_box.h"

namespace tandem::dynamics {

/// The numbers of a body that callers may change between steps.
struct BodySettings {
  Material material;
  double gravity_scale = 1;  ///< the part of gravity that acts on it

  // nvcc defines no default operator for the host.
  friend bool operator==(const BodySettings& p, const BodySettings& q) {
    return p.gravity_scale == q.gravity_scale && p.material.friction == q.material.friction &&
           p.material.restitution == q.material.restitution &&
           p.material.rolling_resistance == q.material.rolling_resistance;
  }
};

/// The properties of a body, apart from where it is.
struct BodyProperties : BodySettings {
  std::uint32_t shape = 0;                ///< by place in the list of assets
  Motion motion = Motion::moving;         ///< never sleeping; a kinematic one keeps its velocities
  double mass = 1;                        ///< kg; that of a fixed body is not looked at
  double density = 0;                     ///< kg/m^3, of which the mass is; 0 of a fixed body
  double radius = 1;                      ///< of the shape, about the centre of mass
  Vector3 centre;                         ///< of mass, in the file's coordinates
  Matrix3 inertia = Matrix3::identity();  ///< about the centre, along the file's axes
  Matrix3 inverse_inertia = Matrix3::identity();
};

/// Returns whether anybody wants to know of contacts between two bodies: of those of fixed ones, which there
/// may be where one was placed, nobody does.
TANDEM_HD inline bool are_told(const BodyProperties& a, const BodyProperties& b) {
  return a.motion != Motion::fixed || b.motion != Motion::fixed;
}

/// The state of a body: where it is and how it moves, in the world.
struct BodyState {
  Vector3 position;  ///< of the centre of mass
  Quaternion orientation;
  Vector3 velocity, angular_velocity;
};

/// A force on a body that lasts, and a torque about its centre of mass. Both are of the world's directions.
struct BodyForce {
  Vector3 force, torque;

  TANDEM_HD friend bool operator==(const BodyForce& p, const BodyForce& q) {
    return p.force == q.force && p.torque == q.torque;
  }
};

/// Says what gravity and forces add to a body's velocities in a second.
struct Pull {
  Vector3 linear, angular;
  double turning = 0;  ///< to the velocity of any of its points by `angular`, at most

  /// Returns what is added to the velocity of any point, at most.
  TANDEM_HD double most() const { return norm(linear) + turning; }
};

/// A point of the world in the body's frame about its centre of mass, and back.
TANDEM_HD inline Vector3 into_body(const BodyState& state, const Vector3& point) {
  return rotated(conjugated(state.orientation), point - state.position);
}
TANDEM_HD inline Vector3 into_world(const BodyState& state, const Vector3& point) {
  return state.position + rotated(state.orientation, point);
}

/// Properties of a dynamic body of a mesh with this mass. radius is left as it is.
BodyProperties body_properties(std::uint32_t shape, const MassProperties& mesh, double density);

/// A body of density 1, made one of another density.
BodyProperties of_density(BodyProperties body, double density);

/// Returns the overlap that a solver leaves alone unless it is told otherwise: 1/4000 of the least diagonal
/// of a moving body's shape; without such bodies that of a shape of 2 m.
double default_slop(std::span<const AssetView> shapes, std::span<const BodyProperties> bodies);

/// The fastest that a body may move or turn along an axis, in m/s and rad/s. From about 1e11 on, rounding
/// takes what gravity adds in a step to the bodies that Newton's method solves with such a body.
inline constexpr double kFastest = 1e10;

/// Returns whether a step can start from a state: all numbers are finite, places are such as queries take,
/// and nothing is faster than kFastest.
TANDEM_HD inline bool is_usable(const BodyState& state) {
  // It is false of NaN.
  const auto is_within = [](const Vector3& x, double most) {
    return std::fabs(x.x) <= most && std::fabs(x.y) <= most && std::fabs(x.z) <= most;
  };
  return is_within(state.position, kLargestWorldCoordinate) &&
         std::fabs(state.orientation.w) <= 1.7976931348623157e308 && is_within(state.velocity, kFastest) &&
         is_within(state.angular_velocity, kFastest);
}

/// Returns whether a step can move a body of this mass, in kg: products of three of its moments of inertia
/// are numbers.
bool is_usable_mass(double mass);

/// Returns where a question is to see the body: x_world = rotation * x_file + translation.
TANDEM_HD inline Instance pose_of(const BodyProperties& body, const BodyState& state) {
  const Matrix3 rotation = matrix_of(state.orientation);
  const Vector3 translation = state.position - rotation * body.centre;
  Instance pose{body.shape, kIdentityPose};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.pose.rotation[i][j] = at(rotation.row[i], j);
    pose.pose.translation[i] = at(translation, i);
  }
  return pose;
}

/// The state in which pose_of() gives this pose, to rounding; at rest. Condition: the pose is rigid.
BodyState state_of(const BodyProperties& body, const Pose& pose);

/// R * inverse_inertia * R^T; zero for a body that contacts do not move.
TANDEM_HD inline Matrix3 world_inverse_inertia(const BodyProperties& body, const BodyState& state) {
  if (body.motion != Motion::moving) return Matrix3{};
  const Matrix3 rotation = matrix_of(state.orientation);
  return rotation * body.inverse_inertia * transposed(rotation);
}

/// force: of a moving body; others have none.
TANDEM_HD inline Pull pull_on(const BodyProperties& body, const BodyState& state, const Vector3& gravity,
                              const BodyForce& force = {}) {
  Pull pull = {body.gravity_scale * gravity, {}};
  if (body.motion != Motion::moving || force == BodyForce{}) return pull;
  pull.linear += force.force / body.mass;
  pull.angular = world_inverse_inertia(body, state) * force.torque;
  pull.turning = body.radius * norm(pull.angular);
  return pull;
}

namespace rigid_body_detail {

TANDEM_HD inline Vector3 turn_into_world(const Quaternion& orientation, const Matrix3& tensor,
                                         const Vector3& vector) {
  const Matrix3 rotation = matrix_of(orientation);
  return rotation * (tensor * (transposed(rotation) * vector));
}

// Solves for the mean angular velocity of the step by fixed-point iteration, whose rate is about the angle
// turned in half a step.
TANDEM_HD inline Vector3 midpoint_angular_velocity(const BodyProperties& body, const BodyState& state,
                                                   const Vector3& momentum, double dt) {
  constexpr int kIterations = 4;
  Vector3 middle = state.angular_velocity;
  for (int i = 0; i < kIterations; ++i) {
    const Quaternion half = rotation_by(0.5 * dt * middle) * state.orientation;
    middle = turn_into_world(half, body.inverse_inertia, momentum);
  }
  return middle;
}

TANDEM_HD inline void rotate(const BodyProperties& body, BodyState& state, const Vector3& correction,
                             double dt) {
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

}  // namespace rigid_body_detail

/// Moves the body by its velocities plus those of a correction, which are forgotten afterwards.
///
/// Rotation is by the implicit midpoint rule on the group of rotations: the angular momentum in the world
/// stays what it is, to rounding, and the angular velocity follows from it at the end. So the kinetic energy
/// of free rotation stays between L^2 / (2 I_max) and L^2 / (2 I_min), whatever dt: the gyroscopic term
/// cannot blow up (Krysl and Endres 2005, LIEMID). A body that turns fast turns in parts.
TANDEM_HD inline void advance(const BodyProperties& body, BodyState& state, const Vector3& correction,
                              const Vector3& angular_correction, double dt) {
  if (body.motion == Motion::fixed) return;
  state.position += dt * (state.velocity + correction);
  rigid_body_detail::rotate(body, state, angular_correction, dt);
}

/// Moves a body that nothing holds by the mean velocity of the step, which is exact.
TANDEM_HD inline void fly(const BodyProperties& body, const Pull& pull, double dt, BodyState& state) {
  const Vector3 gain = dt * pull.linear, turn = dt * pull.angular;
  state.velocity += gain;
  state.angular_velocity += turn;
  advance(body, state, -0.5 * gain, -0.5 * turn, dt);
}

/// Gives a moving body the velocities that an impulse at a point of the world makes.
inline void push_at(const BodyProperties& body, const Vector3& impulse, const Vector3& point,
                    BodyState& state) {
  const Vector3 arm = point - state.position;
  state.velocity += impulse / body.mass;
  state.angular_velocity += world_inverse_inertia(body, state) * cross(arm, impulse);
}

double kinetic_energy(const BodyProperties& body, const BodyState& state);

/// Returns the angular momentum about the world's origin. It is zero for a body that contacts do not move.
Vector3 angular_momentum(const BodyProperties& body, const BodyState& state);

}  // namespace tandem::dynamics
