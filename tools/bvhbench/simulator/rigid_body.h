#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "bvhbench/engines/engine.h"
#include "mass_properties.h"

namespace tandem::simulation {

/// The properties of a body, apart from where it is.
struct BodyProperties {
  std::uint32_t shape = 0;                           ///< by place in the list given to the engine
  Motion motion = Motion::moving;                    ///< never sleeping; a kinematic one keeps its velocities
  double mass = 1;                                   ///< kg; that of a fixed body is not looked at
  double radius = 1;                                 ///< of the shape, about the centre of mass
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of mass, in the file's coordinates
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();  ///< about the centre, along the file's axes
  Eigen::Matrix3d inverse_inertia = Eigen::Matrix3d::Identity();
};

/// The state of a body: where it is and how it moves, in the world.
struct BodyState {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the centre of mass
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
};

/// A point of the world in the body's frame about its centre of mass, and back.
inline Eigen::Vector3d into_body(const BodyState& state, const Eigen::Vector3d& point) {
  return state.orientation.conjugate() * (point - state.position);
}
inline Eigen::Vector3d into_world(const BodyState& state, const Eigen::Vector3d& point) {
  return state.position + state.orientation * point;
}

/// Properties of a dynamic body of a mesh with this mass. radius is left as it is.
BodyProperties body_properties(std::uint32_t shape, const MassProperties& mesh, double density);

/// Returns where the engine is to see the body: x_world = rotation * x_file + translation.
BodyPose pose_of(const BodyProperties& body, const BodyState& state);

/// The state in which pose_of() gives this pose, to rounding; at rest. Condition: the pose is rigid.
BodyState state_of(const BodyProperties& body, const Pose& pose);

/// R * inverse_inertia * R^T; zero for a body that contacts do not move.
Eigen::Matrix3d world_inverse_inertia(const BodyProperties& body, const BodyState& state);

/// Moves the body by its velocities plus those of a correction, which are forgotten afterwards.
///
/// Rotation is by the implicit midpoint rule on the group of rotations: the angular momentum in the world
/// stays what it is, to rounding, and the angular velocity follows from it at the end. So the kinetic energy
/// of free rotation stays between L^2 / (2 I_max) and L^2 / (2 I_min), whatever dt: the gyroscopic term
/// cannot blow up (Krysl and Endres 2005, LIEMID).
void advance(const BodyProperties& body, BodyState& state, const Eigen::Vector3d& correction,
             const Eigen::Vector3d& angular_correction, double dt);

double kinetic_energy(const BodyProperties& body, const BodyState& state);

/// Returns the angular momentum about the world's origin. It is zero for a body that contacts do not move.
Eigen::Vector3d angular_momentum(const BodyProperties& body, const BodyState& state);

}  // namespace tandem::simulation
