#pragma once
#include <span>
#include <vector>

#include "contact_point.h"
#include "rigid_body.h"

namespace tandem::simulation {

/// Contacts that move with their bodies between two searches for contacts.
class FollowedContacts {
 public:
  FollowedContacts(std::span<const ContactPoint> contacts, std::span<const BodyState> states);

  /// Moves each contact to the middle of where its two bodies have carried the point, and corrects its depth
  /// by what these have moved apart along the normal; the depth may become negative. Normals stay.
  void follow(std::span<const BodyState> states);

  const std::vector<ContactPoint>& contacts() const { return contacts_; }

 private:
  struct Anchor {
    Eigen::Vector3d in_a, in_b;  // in the bodies' frames
    double depth;                // when found
  };

  std::vector<ContactPoint> contacts_;
  std::vector<Anchor> anchors_;
};

}  // namespace tandem::simulation
