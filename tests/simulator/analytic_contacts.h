#pragma once
#include <memory>

#include "bvhbench/simulator/simulator.h"

/// Contacts by formula, for tests of the simulator without meshes.
namespace tandem::simulation {

inline constexpr double kGravity = 9.81;
/// The size of the boxes that most tests stack.
inline const Eigen::Vector3d kCube = {1, 1, 1};

/// A box of this mass with its centre at the origin of its frame.
BodyProperties box_body(const Eigen::Vector3d& size, double mass);

/// A solid ball of this mass with its centre at the origin of its frame.
BodyProperties ball_body(double radius, double mass);

/// A body that nothing moves.
BodyProperties fixed_body();

/// Body 0 is the half-space below the plane through the origin with this normal; the other bodies are boxes.
/// The corners of each box that lie in the half-space are contacts, and so are those bottom corners of box i
/// + 1 that lie below the top of box i, over its footprint in the frame of box i.
std::unique_ptr<ContactFinder> boxes_on_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& size);

/// Body 0 is the half-space as above; the other bodies are balls. Each has one contact with it, at its foot.
std::unique_ptr<ContactFinder> balls_on_plane(const Eigen::Vector3d& normal, double radius);

/// No contacts.
std::unique_ptr<ContactFinder> no_contacts();

}  // namespace tandem::simulation
