#pragma once
#include <cstdint>
#include <span>

#include "dynamics/rigid_body.h"
#include "tandem/kernels/object_pair.h"

namespace tandem::dynamics {

/// A point in which two bodies push against each other: what a solver makes one contact of.
struct ContactPoint {
  std::uint32_t body_a, body_b;  ///< a < b
  Vector3 position;              ///< world
  Vector3 normal;                ///< unit, from a towards b: pushing b along it separates the bodies
  double depth;                  ///< lengths along the normal; where bodies are apart, less than 0
  std::uint64_t feature;         ///< equal in successive steps for what is the same contact; 0: none, to be
                                 ///< matched by position
};

inline ObjectPair pair_of(const ContactPoint& contact) {
  return {contact.body_a, contact.body_b};
}

/// The place of a contact's point in its bodies' frames about their centres of mass, which carry it along.
struct ContactAnchor {
  Vector3 in_a, in_b;
  double depth;  ///< when the contact was found
};

ContactAnchor anchor_of(const ContactPoint& contact, std::span<const BodyState> states);

/// Moves a contact to the middle of where its two bodies have carried the point, and corrects its depth by
/// what these have moved apart along the normal; the depth may become negative. The normal stays.
void carry(ContactPoint& contact, const ContactAnchor& anchor, std::span<const BodyState> states);

/// Returns how fast the bodies approach each other at the contact, along its normal.
double approach_of(const ContactPoint& contact, std::span<const BodyState> states);

/// The impulse of a contact in a step: an impulse on b, the opposite one on a.
struct ContactImpulse {
  double normal = 0;   ///< along the contact's normal, >= 0
  Vector3 tangential;  ///< across it, in the world
  Vector3 turning;     ///< what resists turning, in the world; each contact of a pair has an equal part
};

}  // namespace tandem::dynamics
