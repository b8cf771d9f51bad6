#pragma once
#include <cstdint>
#include <span>

#include "dynamics/rigid_body.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/object_pair.h"

namespace tandem::dynamics {

/// Bodies whose points move against each other by more slops than this in a step are fast: they are not
/// about to rest.
inline constexpr double kFastFrom = 8;

/// What a step asks of manifolds. Bodies that are deep in each other are pushed apart for many steps, however
/// deep they are at first; and what a contact did in the step before, the step remembers by itself.
inline constexpr ManifoldOptions kManifoldsOfStep = {.match_previous = false, .quick_depths = true};

/// A point in which two bodies push against each other: what a solver makes one contact of.
struct ContactPoint {
  std::uint32_t body_a, body_b;  ///< a < b
  Vector3 position;              ///< world
  Vector3 normal;                ///< unit, from a towards b: pushing b along it separates the bodies
  double depth;                  ///< lengths along the normal; where bodies are apart, less than 0
  std::uint64_t feature;         ///< equal in successive steps for what is the same contact; 0: none, to be
                                 ///< matched by position
  double time = 0;  ///< seconds after the step began when position, normal and depth are these, if the bodies
                    ///< go on as they did
};

TANDEM_HD inline ObjectPair pair_of(const ContactPoint& contact) {
  return {contact.body_a, contact.body_b};
}

/// The place of a contact's point in its bodies' frames about their centres of mass, which carry it along.
struct ContactAnchor {
  Vector3 in_a, in_b;
  double depth;  ///< when the contact was found
};

/// Returns where a body is after some seconds if it goes on as it does, with the velocities of now.
TANDEM_HD inline BodyState later(const BodyState& state, double seconds) {
  BodyState out = state;
  if (seconds == 0) return out;
  out.position += seconds * state.velocity;
  out.orientation = normalized(rotation_by(seconds * state.angular_velocity) * state.orientation);
  return out;
}

/// Returns where a contact is, as seen from the centre of mass of one of its bodies at the contact's time.
TANDEM_HD inline Vector3 arm_of(const ContactPoint& contact, const BodyState& state) {
  return contact.position - (state.position + contact.time * state.velocity);
}

/// Returns where a contact is in its bodies. states: those when the step begins.
TANDEM_HD inline ContactAnchor anchor_of(const ContactPoint& contact, std::span<const BodyState> states) {
  return {into_body(later(states[contact.body_a], contact.time), contact.position),
          into_body(later(states[contact.body_b], contact.time), contact.position), contact.depth};
}

/// Returns the contact's normal in the frame of a.
TANDEM_HD inline Vector3 normal_in_a(const ContactPoint& contact, std::span<const BodyState> states) {
  return rotated(conjugated(later(states[contact.body_a], contact.time).orientation), contact.normal);
}

/// Moves a contact to the middle of where its two bodies have carried the point, and corrects its depth by
/// what these have moved apart along the normal; the depth may become negative. The normal stays. The
/// contact's time becomes 0.
TANDEM_HD inline void carry(ContactPoint& contact, const ContactAnchor& anchor,
                            std::span<const BodyState> states) {
  const Vector3 on_a = into_world(states[contact.body_a], anchor.in_a);
  const Vector3 on_b = into_world(states[contact.body_b], anchor.in_b);
  contact.position = 0.5 * (on_a + on_b);
  contact.depth = anchor.depth - dot(contact.normal, on_b - on_a);
  contact.time = 0;
}

/// Returns how fast the bodies approach each other at the contact, along its normal.
TANDEM_HD inline double approach_of(const ContactPoint& contact, std::span<const BodyState> states) {
  const auto velocity = [&](std::uint32_t body) {
    const BodyState& state = states[body];
    return state.velocity + cross(state.angular_velocity, arm_of(contact, state));
  };
  return dot(contact.normal, velocity(contact.body_a) - velocity(contact.body_b));
}

/// The impulse of a contact in a step: an impulse on b, the opposite one on a.
struct ContactImpulse {
  double normal = 0;   ///< along the contact's normal, >= 0
  Vector3 tangential;  ///< across it, in the world
  Vector3 turning;     ///< what resists turning, in the world; each contact of a pair has an equal part
};

}  // namespace tandem::dynamics
