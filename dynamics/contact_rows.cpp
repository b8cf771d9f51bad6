#include "dynamics/contact_rows.h"

#include <algorithm>
#include <cmath>

namespace tandem::dynamics {
namespace {

Vector6 scaled(const MassScale& scale, const Vector3& velocity, const Vector3& spin) {
  return {scale.root_mass * velocity, inverse(scale.spread) * spin};
}

Vector6 gradient(const SteppedBody& body, const Vector3& direction, const Vector3& arm) {
  if (!body.moves) return {};
  return {body.scale.inverse_root_mass * direction, transposed(body.scale.spread) * cross(arm, direction)};
}

}  // namespace

SteppedBody RowMaker::body(std::uint32_t body) const {
  const BodyState& state = states_[body];
  SteppedBody out;
  out.moves = true;
  const double root_mass = std::sqrt(input_.bodies[body].mass);
  out.scale = {root_mass, 1 / root_mass,
               matrix_of(state.orientation) * cholesky(input_.bodies[body].inverse_inertia)};
  out.velocity = scaled(out.scale, state.velocity, state.angular_velocity);
  out.gravity = scaled(out.scale, input_.pulls[body].linear, input_.pulls[body].angular);
  return out;
}

// The contacts of a patch are those of a pair that have the same normal.
bool RowMaker::is_of_patch(std::uint32_t first, std::uint32_t contact) const {
  return square(input_.contacts[contact].normal - input_.contacts[first].normal) < 1e-12;
}

ContactPatch RowMaker::patch_of(std::span<const std::uint32_t> contacts) const {
  ContactPatch out = {&input_.contacts[contacts[0]], {}};
  for (const std::uint32_t i : contacts) {
    const ContactPoint& contact = input_.contacts[i];
    if (contact.depth > out.deepest->depth) out.deepest = &contact;
  }
  const double least = std::min(0.0, out.deepest->depth);
  double shares = 0;
  for (const std::uint32_t i : contacts) {
    const ContactPoint& contact = input_.contacts[i];
    if (contact.depth < least) continue;
    const double share = options_.slop + std::max(0.0, contact.depth);
    out.centre += share * contact.position, shares += share;
  }
  out.centre = out.centre / shares;
  return out;
}

// A gap may close; what is in contact comes no deeper, or bodies would rock within the slop. But a body that
// rolls brings the points before it down: they may go on as they turn, and faster. Bodies that turn slowly,
// or have the contacts of the start, come to rest: there only points of a patch that is clearly round may, if
// that is much.
double RowMaker::separation_of(const ContactPoint& contact, const ContactPatch& patch,
                               const ContactMeeting& meeting) const {
  constexpr double kFasterOfMiddle = 2, kRound = 0.7, kOfSlop = 0.25, kFaster = 4, kLeast = 0.3;
  // What comes out by itself is not pushed out.
  const double depth = std::min(contact.depth, depth_at_start(contact, meeting));
  const double separation = depth < 0 ? -depth : std::min(0.0, options_.slop - depth);
  const Vector3 spin_a = states_[contact.body_a].angular_velocity,
                spin_b = states_[contact.body_b].angular_velocity;
  const auto comes_down = [&](const Vector3& than) {
    return -input_.dt * dot(contact.normal, cross(spin_b - spin_a, contact.position - than));
  };
  const double turning = input_.dt * (input_.bodies[contact.body_a].radius * norm(spin_a) +
                                      input_.bodies[contact.body_b].radius * norm(spin_b));
  if (contact.time > 0 && turning > kFastFrom * options_.slop)
    return separation + std::max(0.0, kFasterOfMiddle * comes_down(patch.centre));
  const ContactPoint& deepest = *patch.deepest;
  if (deepest.depth - contact.depth < kRound * std::max(deepest.depth, kOfSlop * options_.slop))
    return separation;
  const double allowed = kFaster * comes_down(deepest.position);
  return allowed > kLeast * options_.slop ? separation + allowed : separation;
}

// The velocity of a body's point if contacts do not move the body, else 0.
Vector3 RowMaker::driven(std::uint32_t body, const Vector3& arm) const {
  if (input_.bodies[body].motion != Motion::kinematic) return Vector3{};
  return states_[body].velocity + cross(states_[body].angular_velocity, arm);
}

Vector3 RowMaker::spin_driven(std::uint32_t body) const {
  if (input_.bodies[body].motion != Motion::kinematic) return Vector3{};
  return states_[body].angular_velocity;
}

// The velocity of a body's point.
Vector3 RowMaker::velocity_at(std::uint32_t body, const Vector3& arm) const {
  if (input_.bodies[body].motion == Motion::fixed) return Vector3{};
  return states_[body].velocity + cross(states_[body].angular_velocity, arm);
}

// Returns how gravity and lasting forces accelerate the place of a contact.
Vector3 RowMaker::pull_at(std::uint32_t body, const Vector3& arm) const {
  if (!is_moved(body)) return Vector3{};
  return input_.pulls[body].linear + cross(input_.pulls[body].angular, arm);
}

double RowMaker::rebound_of(const ContactPoint& contact, const ContactMeeting& meeting,
                            const Material& material) const {
  constexpr double kBouncesAbove = 2;  // times what gravity and forces give in a step
  if (!(material.restitution > 0)) return 0;
  const double approach = -dot(contact.normal, meeting.velocity);
  const double fall =
      -dot(contact.normal, pull_at(contact.body_b, meeting.arm_b) - pull_at(contact.body_a, meeting.arm_a));
  const double gap = std::max(0.0, -depth_at_start(contact, meeting));
  const bool meets = gap < input_.dt * (approach + 0.5 * input_.dt * fall) || gap == 0;
  if (!meets || !(approach > kBouncesAbove * input_.dt * input_.pull_of(contact))) return 0;
  const double square_at_impact = approach * approach + 2 * fall * gap;
  return material.restitution * std::sqrt(std::max(0.0, square_at_impact));
}

ContactMeeting RowMaker::meeting(const ContactPoint& contact, const ContactPatch& patch,
                                 const Material& material) const {
  ContactMeeting out;
  out.arm_a = arm_of(contact, states_[contact.body_a]);
  out.arm_b = arm_of(contact, states_[contact.body_b]);
  out.velocity = velocity_at(contact.body_b, out.arm_b) - velocity_at(contact.body_a, out.arm_a);
  out.separation = separation_of(contact, patch, out);
  out.rebound = rebound_of(contact, out, material);
  return out;
}

ContactRows RowMaker::rows(const ContactPoint& contact, const ContactPatch& patch, const SteppedBody& a,
                           const SteppedBody& b, const Material& material,
                           const ContactImpulse& impulse) const {
  const Tangents across(contact.normal);
  const ContactMeeting meets = meeting(contact, patch, material);
  const auto row = [&](const Vector3& direction) {
    return ContactRow{-gradient(a, direction, meets.arm_a), gradient(b, direction, meets.arm_b)};
  };
  const auto along = [&](const Vector3& x) {
    return Vector3{dot(contact.normal, x), dot(across.first, x), dot(across.second, x)};
  };
  const Vector3 moving = driven(contact.body_b, meets.arm_b) - driven(contact.body_a, meets.arm_a);
  const Vector3 pushed = along(impulse.tangential);
  return {row(contact.normal), row(across.first),
          row(across.second),  across.first,
          across.second,       along(moving),
          meets.separation,    material.friction,
          meets.rebound,       {impulse.normal, pushed.y, pushed.z}};
}

double turning_mobility(const SteppedBody& a, const SteppedBody& b) {
  Matrix3 mobility;
  for (const SteppedBody* body : {&a, &b}) {
    if (body->moves) mobility = mobility + body->scale.spread * transposed(body->scale.spread);
  }
  double most = 0;
  for (const Vector3& row : mobility.row)
    most = std::max(most, std::fabs(row.x) + std::fabs(row.y) + std::fabs(row.z));
  return most;
}

void apply_motion(const BodyProperties& body, const MassScale& scale, const Vector6& velocity,
                  const Vector6& displacement, double dt, BodyState& state) {
  state.velocity = velocity.linear / scale.root_mass;
  state.angular_velocity = scale.spread * velocity.angular;
  const Vector3 moved = displacement.linear / (scale.root_mass * dt);
  const Vector3 turned = scale.spread * displacement.angular / dt;
  advance(body, state, moved - state.velocity, turned - state.angular_velocity, dt);
}

}  // namespace tandem::dynamics
