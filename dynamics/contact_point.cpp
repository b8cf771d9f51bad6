#include "dynamics/contact_point.h"

namespace tandem::dynamics {

BodyState later(const BodyState& state, double seconds) {
  BodyState out = state;
  if (seconds == 0) return out;
  out.position += seconds * state.velocity;
  out.orientation = normalized(rotation_by(seconds * state.angular_velocity) * state.orientation);
  return out;
}

ContactAnchor anchor_of(const ContactPoint& contact, std::span<const BodyState> states) {
  return {into_body(later(states[contact.body_a], contact.time), contact.position),
          into_body(later(states[contact.body_b], contact.time), contact.position), contact.depth};
}

Vector3 normal_in_a(const ContactPoint& contact, std::span<const BodyState> states) {
  return rotated(conjugated(later(states[contact.body_a], contact.time).orientation), contact.normal);
}

void carry(ContactPoint& contact, const ContactAnchor& anchor, std::span<const BodyState> states) {
  const Vector3 on_a = into_world(states[contact.body_a], anchor.in_a);
  const Vector3 on_b = into_world(states[contact.body_b], anchor.in_b);
  contact.position = 0.5 * (on_a + on_b);
  contact.depth = anchor.depth - dot(contact.normal, on_b - on_a);
  contact.time = 0;
}

double approach_of(const ContactPoint& contact, std::span<const BodyState> states) {
  const auto velocity = [&](std::uint32_t body) {
    const BodyState& state = states[body];
    return state.velocity + cross(state.angular_velocity, arm_of(contact, state));
  };
  return dot(contact.normal, velocity(contact.body_a) - velocity(contact.body_b));
}

}  // namespace tandem::dynamics
