#include "followed_contacts.h"

namespace tandem::simulation {

FollowedContacts::FollowedContacts(std::span<const ContactPoint> contacts, std::span<const BodyState> states)
    : contacts_(contacts.begin(), contacts.end()) {
  anchors_.reserve(contacts.size());
  for (const ContactPoint& contact : contacts) {
    const BodyState &a = states[contact.body_a], &b = states[contact.body_b];
    anchors_.push_back({a.orientation.conjugate() * (contact.position - a.position),
                        b.orientation.conjugate() * (contact.position - b.position), contact.depth});
  }
}

void FollowedContacts::follow(std::span<const BodyState> states) {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    ContactPoint& contact = contacts_[i];
    const BodyState &a = states[contact.body_a], &b = states[contact.body_b];
    const Eigen::Vector3d on_a = a.position + a.orientation * anchors_[i].in_a;
    const Eigen::Vector3d on_b = b.position + b.orientation * anchors_[i].in_b;
    contact.position = 0.5 * (on_a + on_b);
    contact.depth = anchors_[i].depth - contact.normal.dot(on_b - on_a);
  }
}

}  // namespace tandem::simulation
