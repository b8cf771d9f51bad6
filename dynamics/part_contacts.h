#pragma once
#include <cstdint>
#include <span>

#include "dynamics/carver.h"
#include "dynamics/contact_point.h"

namespace tandem::dynamics {

TANDEM_HD inline ContactImpulse operator*(double s, const ContactImpulse& impulse) {
  return {s * impulse.normal, s * impulse.tangential, s * impulse.turning};
}
TANDEM_HD inline ContactImpulse& operator+=(ContactImpulse& sum, const ContactImpulse& impulse) {
  sum.normal += impulse.normal, sum.tangential += impulse.tangential, sum.turning += impulse.turning;
  return sum;
}

/// The contacts of a step that is made in equal parts, each a step of its own with the same contacts, which
/// the bodies carry along, and normals that turn with the first of two. The memory is somebody else's.
struct PartContacts {
  std::span<ContactPoint> contacts;  ///< as they are in this part
  std::span<ContactAnchor> anchors;
  std::span<Vector3> normals;                ///< in a's frame
  std::span<ContactImpulse> impulses, sums;  ///< of this part; of those before it

  TANDEM_HD void carve(Carver& carver, std::size_t count) {
    carver.take(count, contacts), carver.take(count, anchors), carver.take(count, normals);
    carver.take(count, impulses), carver.take(count, sums);
  }

  /// Begins the first of so many parts for contact i. impulse: that the whole step starts with. states: of
  /// the bodies that contacts name.
  TANDEM_HD void begin(std::uint32_t i, const ContactPoint& contact, const ContactImpulse& impulse,
                       std::uint32_t parts, std::span<const BodyState> states) const {
    contacts[i] = contact;
    anchors[i] = anchor_of(contact, states);
    normals[i] = normal_in_a(contact, states);
    impulses[i] = 1.0 / parts * impulse, sums[i] = {};
    if (contact.time > 0) move(i, states);
  }

  /// Ends a part for contact i. states: at its end.
  TANDEM_HD void end_part(std::uint32_t i, std::span<const BodyState> states) const {
    sums[i] += impulses[i];
    move(i, states);
  }

 private:
  // Moves a contact to where the bodies are.
  TANDEM_HD void move(std::uint32_t i, std::span<const BodyState> states) const {
    contacts[i].normal = normalized(rotated(states[contacts[i].body_a].orientation, normals[i]));
    carry(contacts[i], anchors[i], states);
  }
};

}  // namespace tandem::dynamics
