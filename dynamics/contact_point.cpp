#include "dynamics/contact_point.h"

namespace tandem::dynamics {

ContactAnchor anchor_of(const ContactPoint& contact, std::span<const BodyState> states) {
  return {into_body(states[contact.body_a], contact.position),
          into_body(states[contact.body_b], contact.position), contact.depth};
}

void carry(ContactPoint& contact, const ContactAnchor& anchor, std::span<const BodyState> states) {
  const Vector3 on_a = into_world(states[contact.body_a], anchor.in_a);
  const Vector3 on_b = into_world(states[contact.body_b], anchor.in_b);
  contact.position = 0.5 * (on_a + on_b);
  contact.depth = anchor.depth - dot(contact.normal, on_b - on_a);
}

double approach_of(const ContactPoint& contact, std::span<const BodyState> states) {
  const auto velocity = [&](std::uint32_t body) {
    const BodyState& state = states[body];
    return state.velocity + cross(state.angular_velocity, contact.position - state.position);
  };
  return dot(contact.normal, velocity(contact.body_a) - velocity(contact.body_b));
}

}  // namespace tandem::dynamics
