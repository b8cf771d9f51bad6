#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "contact_point.h"
#include "rigid_body.h"

namespace tandem::simulation {

/// What a contact did in a step: an impulse on b, the opposite one on a.
struct ContactImpulse {
  double normal = 0;                                     ///< along the contact's normal, >= 0
  Eigen::Vector3d tangential = Eigen::Vector3d::Zero();  ///< across it, in the world
  Eigen::Vector3d turning = Eigen::Vector3d::Zero();     ///< what resists turning, in the world; each contact
                                                         ///< of a pair has an equal part
};

/// An impulse and what its contact is known by in the next step.
struct CachedImpulse {
  std::uint32_t body_a, body_b;
  std::uint64_t feature;
  Eigen::Vector3d in_a, in_b;   ///< the position, in the bodies' frames about their centres of mass
  Eigen::Vector3d normal_in_a;  ///< the normal, likewise
  double depth;
  std::uint32_t lost;  ///< steps since it was found or pushed
  ContactImpulse impulse;
};

/// Contacts of a step: those found, and those that are kept although they were not.
struct KeptContacts {
  static constexpr std::uint32_t kFound = 0xFFFFFFFFu;

  std::vector<ContactPoint> contacts;
  std::vector<std::uint32_t> entry;  ///< of each: kFound, or its place in ImpulseCache::entries()

  void add(const ContactPoint& contact, std::uint32_t its_entry) {
    contacts.push_back(contact);
    entry.push_back(its_entry);
  }
};

/// Remembers impulses from step to step, so that a solver starts where it stopped.
class ImpulseCache {
 public:
  /// The impulse to start each contact with: that of the last step's contact between the same bodies with the
  /// same feature, or else of the nearest one that is within a tenth of the smaller body's radius; each is
  /// given once. What then is left of a pair's normal impulse and of what resists turning is shared out among
  /// its contacts that found none, so that a pair pushes as it did although its points have changed.
  /// Condition: both lists come by ascending pair.
  std::vector<ContactImpulse> match(std::span<const ContactPoint> contacts,
                                    std::span<const BodyProperties> bodies,
                                    std::span<const BodyState> states) const;

  /// The contacts, but where one lies near a remembered one and pushes nearly the same way it is deeper than
  /// that has become by no more than how far the bodies' points have moved in a step of length dt, and by a
  /// tenth of what it was found deeper still. Depths of meshes jump where other triangles meet although the
  /// bodies hardly moved, and what rests would be shaken by each jump. Conditions as for match().
  std::vector<ContactPoint> without_jumps(std::span<const ContactPoint> contacts,
                                          std::span<const BodyProperties> bodies,
                                          std::span<const BodyState> states, double dt) const;

  /// The contacts, and with them those remembered that are not among them because their bodies have come
  /// apart a little since they were found: by no more than `gap` along the normal and a fiftieth of the
  /// smaller body's radius across it, and no other contact of the pair is that near; and for no more than
  /// eight steps since they pushed. Without them a body that is lifted off by a hair falls freely for a whole
  /// step, and deeper than it was. They are gaps, of negative depth, but stay while they are no deeper than a
  /// tenth of the slop: a gap may close without being found, by rounding or by a vertex a little beside. By
  /// ascending pair. Pairs of two idle bodies are left out. Conditions as for match() and remember(); gap and
  /// slop >= 0.
  KeptContacts with_those_just_lost(std::span<const ContactPoint> contacts,
                                    std::span<const BodyProperties> bodies, std::span<const BodyState> states,
                                    std::span<const std::uint8_t> idle, double gap, double slop) const;

  /// Forgets all but the pairs of two idle bodies, which no engine looks at, and remembers these contacts;
  /// where they have an entry, that of the contact when it was found.
  /// Conditions: kept is what with_those_just_lost() gave, its contacts moved with the bodies since; idle is
  /// empty or has an entry for each body.
  void remember(const KeptContacts& kept, std::span<const ContactImpulse> impulses,
                std::span<const BodyState> states, std::span<const std::uint8_t> idle);

  std::span<const CachedImpulse> entries() const { return entries_; }
  void restore(std::vector<CachedImpulse> entries) { entries_ = std::move(entries); }

 private:
  std::vector<CachedImpulse> entries_;  // by ascending pair
};

}  // namespace tandem::simulation
