#pragma once
#include <algorithm>
#include <cstdint>
#include <span>

#include "dynamics/bodies_ahead.h"
#include "tandem/kernels/object_pair.h"

/// How a pair's contacts of one step become those of the next: rules for host and device. See ContactCache.
namespace tandem::dynamics {

/// A contact of a step and its impulse, as the next step needs them.
struct CachedContact {
  ObjectPair pair;
  std::uint64_t feature;
  ContactAnchor anchor;
  Vector3 normal_in_a;        ///< the normal, in a's frame
  std::uint32_t quiet_steps;  ///< since it was found or last pushed
  ContactImpulse impulse;     ///< of the last step
};

TANDEM_HD inline ObjectPair pair_of(const CachedContact& contact) {
  return contact.pair;
}

/// A pair's part of lists that its contacts are written to.
struct PairContacts {
  CachedContact* remembered;
  ContactPoint* contacts;
  std::uint32_t* place;  ///< of each contact among those remembered
};

/// How many were written.
struct PairContactCounts {
  std::uint32_t remembered = 0, contacts = 0;
};

/// Returns whether the step before found the contact, or it pushed then.
TANDEM_HD inline bool was_found(const CachedContact& contact) {
  return contact.quiet_steps <= 1;
}

namespace remembered_contacts_detail {

inline constexpr double kNear = 0.02, kMatches = 0.1;  // of the smaller body's radius

TANDEM_HD inline CachedContact cached(const ContactPoint& contact, std::span<const BodyState> states) {
  return {pair_of(contact), contact.feature, anchor_of(contact, states), normal_in_a(contact, states), 0, {}};
}

// Returns the contact where the bodies have carried it since it was found.
TANDEM_HD inline ContactPoint moved_with_bodies(const CachedContact& entry,
                                                std::span<const BodyState> states) {
  const Vector3 normal = normalized(rotated(states[entry.pair.a].orientation, entry.normal_in_a));
  ContactPoint moved = {entry.pair.a, entry.pair.b, {}, normal, 0, entry.feature};
  carry(moved, entry.anchor, states);
  return moved;
}

// Returns whether it is a gap that may close again.
TANDEM_HD inline bool is_just_lost(const CachedContact& entry, const ContactPoint& moved,
                                   std::span<const BodyState> states, double gap, double near) {
  constexpr std::uint32_t kLife = 8;  // steps; boxes side by side would keep all that ever touched
  const Vector3 by = into_world(states[entry.pair.b], entry.anchor.in_b) -
                     into_world(states[entry.pair.a], entry.anchor.in_a);
  const double across = norm(by - dot(moved.normal, by) * moved.normal);
  return entry.quiet_steps < kLife && -gap <= moved.depth && moved.depth <= 0 && across <= near;
}

// Gives the contacts of one pair the impulses of those remembered.
class PairMatch {
 public:
  // marks: one for each of both, all 0.
  TANDEM_HD PairMatch(std::span<const CachedContact> old, std::span<CachedContact> now, std::uint8_t* marks)
      : old_(old), now_(now), is_taken_(marks), has_one_(marks + old.size()) {}

  TANDEM_HD void by_feature() {
    for (std::size_t i = 0; i < now_.size(); ++i) {
      if (now_[i].feature == 0) continue;
      for (std::size_t j = 0; j < old_.size(); ++j) {
        if (is_taken_[j] || old_[j].feature != now_[i].feature) continue;
        take(i, j);
        break;
      }
    }
  }

  TANDEM_HD void by_position(double reach) {
    for (std::size_t i = 0; i < now_.size(); ++i) {
      if (has_one_[i]) continue;
      std::size_t nearest = old_.size();
      double least = reach * reach;
      for (std::size_t j = 0; j < old_.size(); ++j) {
        const double apart = std::min(square(old_[j].anchor.in_a - now_[i].anchor.in_a),
                                      square(old_[j].anchor.in_b - now_[i].anchor.in_b));
        if (!is_taken_[j] && apart < least) least = apart, nearest = j;
      }
      if (nearest < old_.size()) take(i, nearest);
    }
  }

  TANDEM_HD void share_rest() {
    double normal = 0, without = 0;
    Vector3 turning;
    for (std::size_t j = 0; j < old_.size(); ++j) {
      if (!is_taken_[j]) normal += old_[j].impulse.normal, turning += old_[j].impulse.turning;
    }
    for (std::size_t i = 0; i < now_.size(); ++i) without += has_one_[i] == 0 ? 1 : 0;
    for (std::size_t i = 0; i < now_.size(); ++i) {
      if (!has_one_[i])
        now_[i].impulse.normal = normal / without, now_[i].impulse.turning = turning / without;
    }
  }

 private:
  TANDEM_HD void take(std::size_t now, std::size_t old) {
    is_taken_[old] = has_one_[now] = 1;
    now_[now].impulse = old_[old].impulse;
  }

  std::span<const CachedContact> old_;
  std::span<CachedContact> now_;
  std::uint8_t *is_taken_, *has_one_;
};

}  // namespace remembered_contacts_detail

/// Makes the contacts of a pair that keeps those remembered, where the bodies have carried them. Room: as
/// many.
TANDEM_HD inline PairContactCounts keep_contacts(std::span<const CachedContact> old, const BodiesAhead& of,
                                                 const PairContacts& to) {
  PairContactCounts counts;
  for (const CachedContact& entry : old) {
    const ContactPoint moved = remembered_contacts_detail::moved_with_bodies(entry, of.states);
    if (!of.is_far(moved)) {
      to.place[counts.contacts] = counts.remembered;
      to.contacts[counts.contacts++] = moved;
    }
    to.remembered[counts.remembered++] = entry;
  }
  return counts;
}

/// Makes the contacts of a pair that moved of those found and those just lost. Room: as many as both. marks:
/// two for each of the old and one for each found, all 0.
TANDEM_HD inline PairContactCounts renew_contacts(const ObjectPair& pair, std::span<const CachedContact> old,
                                                  std::span<const ContactPoint> found, const BodiesAhead& of,
                                                  const PairContacts& to, std::uint8_t* marks) {
  using namespace remembered_contacts_detail;
  const double radius = std::min(of.bodies[pair.a].radius, of.bodies[pair.b].radius), near = kNear * radius;
  std::uint32_t count = 0;
  const auto add = [&](const CachedContact& entry, const ContactPoint& contact) {
    to.place[count] = count;
    to.remembered[count] = entry, to.contacts[count] = contact;
    ++count;
  };
  for (const ContactPoint& contact : found) add(cached(contact, of.states), contact);
  for (const CachedContact& before : old) {
    const ContactPoint moved = moved_with_bodies(before, of.states);
    if (!is_just_lost(before, moved, of.states, of.fall(pair), near)) continue;
    bool has_other = false;
    for (std::uint32_t i = 0; i < count; ++i)
      has_other = has_other || norm(to.contacts[i].position - moved.position) <= near;
    if (has_other) continue;
    CachedContact entry = before;
    entry.impulse = {};
    add(entry, moved);
  }
  PairMatch match(old, {to.remembered, count}, marks);
  match.by_feature();
  match.by_position(kMatches * radius);
  match.share_rest();
  return {count, count};
}

/// Takes what a contact did in a step.
TANDEM_HD inline void remember(CachedContact& entry, const ContactImpulse& impulse) {
  entry.impulse = impulse;
  entry.quiet_steps = impulse.normal > 0 ? 0 : entry.quiet_steps + 1;
}

}  // namespace tandem::dynamics
