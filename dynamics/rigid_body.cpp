#include "dynamics/rigid_body.h"

#include <algorithm>
#include <cmath>

#include "tandem/kernels/world_box.h"

namespace tandem::dynamics {
namespace {

using rigid_body_detail::turn_into_world;

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

bool is_usable_mass(double mass) {
  constexpr double kMost = 1e30;
  return mass >= 1 / kMost && mass <= kMost;
}

BodyState state_of(const BodyProperties& body, const Pose& pose) {
  BodyState state;
  state.orientation = quaternion_of(pose.rotation);
  state.position = vector_of(pose.translation) + matrix_of(state.orientation) * body.centre;
  return state;
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
