#include "dynamics/contact_cache.h"

#include <algorithm>

namespace tandem::dynamics {
namespace {

ObjectPair pair_of(const CachedContact& contact) {
  return contact.pair;
}

// The contacts of a pair that a list by ascending pair begins with.
template <typename Contact>
std::span<const Contact> head_of(std::span<const Contact> contacts, const ObjectPair& pair) {
  std::size_t count = 0;
  while (count < contacts.size() && pair_of(contacts[count]) == pair) ++count;
  return contacts.first(count);
}

double smaller_radius(const ObjectPair& pair, std::span<const BodyProperties> bodies) {
  return std::min(bodies[pair.a].radius, bodies[pair.b].radius);
}

CachedContact cached(const ContactPoint& contact, std::span<const BodyState> states) {
  return {pair_of(contact), contact.feature, anchor_of(contact, states), normal_in_a(contact, states), 0, {}};
}

// Returns the contact where the bodies have carried it since it was found.
ContactPoint moved_with_bodies(const CachedContact& entry, std::span<const BodyState> states) {
  const Vector3 normal = normalized(rotated(states[entry.pair.a].orientation, entry.normal_in_a));
  ContactPoint moved = {entry.pair.a, entry.pair.b, {}, normal, 0, entry.feature};
  carry(moved, entry.anchor, states);
  return moved;
}

// Returns whether it is a gap that may close again.
bool is_just_lost(const CachedContact& entry, const ContactPoint& moved, std::span<const BodyState> states,
                  double gap, double near) {
  constexpr std::uint32_t kLife = 8;  // steps; boxes side by side would keep all that ever touched
  const Vector3 by = into_world(states[entry.pair.b], entry.anchor.in_b) -
                     into_world(states[entry.pair.a], entry.anchor.in_a);
  const double across = norm(by - dot(moved.normal, by) * moved.normal);
  return entry.quiet_steps < kLife && -gap <= moved.depth && moved.depth <= 0 && across <= near;
}

// Gives the contacts of one pair the impulses of those remembered.
class PairMatch {
 public:
  PairMatch(std::span<const CachedContact> old, std::span<CachedContact> now)
      : old_(old), now_(now), is_taken_(old.size(), 0), has_one_(now.size(), 0) {}

  void by_feature() {
    for (std::size_t i = 0; i < now_.size(); ++i) {
      if (now_[i].feature == 0) continue;
      for (std::size_t j = 0; j < old_.size(); ++j) {
        if (is_taken_[j] || old_[j].feature != now_[i].feature) continue;
        take(i, j);
        break;
      }
    }
  }

  void by_position(double reach) {
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

  void share_rest() {
    double normal = 0;
    Vector3 turning;
    for (std::size_t j = 0; j < old_.size(); ++j) {
      if (!is_taken_[j]) normal += old_[j].impulse.normal, turning += old_[j].impulse.turning;
    }
    const auto without = static_cast<double>(std::count(has_one_.begin(), has_one_.end(), 0));
    for (std::size_t i = 0; i < now_.size(); ++i) {
      if (!has_one_[i])
        now_[i].impulse.normal = normal / without, now_[i].impulse.turning = turning / without;
    }
  }

 private:
  void take(std::size_t now, std::size_t old) {
    is_taken_[old] = has_one_[now] = 1;
    now_[now].impulse = old_[old].impulse;
  }

  std::span<const CachedContact> old_;
  std::span<CachedContact> now_;
  std::vector<char> is_taken_, has_one_;
};

}  // namespace

std::vector<ObjectPair> ContactCache::pairs() const {
  std::vector<ObjectPair> pairs;
  for (const CachedContact& entry : entries_) {
    if (pairs.empty() || pairs.back() != entry.pair) pairs.push_back(entry.pair);
  }
  return pairs;
}

void ContactCache::update(std::span<const ContactPoint> found, std::span<const ObjectPair> kept,
                          const BodiesAhead& of) {
  before_.swap(entries_);
  is_cold_ = before_.empty();
  update_again(found, kept, of);
}

void ContactCache::update_again(std::span<const ContactPoint> found, std::span<const ObjectPair> kept,
                                const BodiesAhead& of) {
  entries_.clear(), contacts_.clear(), place_.clear();
  std::span<const CachedContact> rest = before_;
  while (!rest.empty() || !found.empty()) {
    const ObjectPair pair = rest.empty()    ? pair_of(found.front())
                            : found.empty() ? pair_of(rest.front())
                                            : std::min(pair_of(rest.front()), pair_of(found.front()));
    const auto old = head_of(rest, pair);
    const auto fresh = head_of(found, pair);
    rest = rest.subspan(old.size()), found = found.subspan(fresh.size());
    if (of.is_idle(pair.a) && of.is_idle(pair.b)) {
      entries_.insert(entries_.end(), old.begin(), old.end());
      continue;
    }
    while (!kept.empty() && kept.front() < pair) kept = kept.subspan(1);
    if (kept.empty() || kept.front() != pair) {
      renew(old, fresh, of, smaller_radius(pair, of.bodies));
      continue;
    }
    for (const CachedContact& entry : old) {
      const ContactPoint moved = moved_with_bodies(entry, of.states);
      if (of.is_far(moved))
        entries_.push_back(entry);
      else
        add(entry, moved);
    }
  }
}

void ContactCache::renew(std::span<const CachedContact> old, std::span<const ContactPoint> found,
                         const BodiesAhead& of, double radius) {
  constexpr double kNear = 0.02, kMatches = 0.1;  // of the smaller body's radius
  const double near = kNear * radius;
  const std::size_t first = entries_.size(), first_contact = contacts_.size();
  for (const ContactPoint& contact : found) add(cached(contact, of.states), contact);
  for (CachedContact entry : old) {
    const ContactPoint moved = moved_with_bodies(entry, of.states);
    const auto is_near = [&](const ContactPoint& one) { return norm(one.position - moved.position) <= near; };
    const auto others = std::span(contacts_).subspan(first_contact);
    if (!is_just_lost(entry, moved, of.states, of.fall(entry.pair), near) ||
        std::ranges::any_of(others, is_near))
      continue;
    entry.impulse = {};
    add(entry, moved);
  }
  PairMatch match(old, std::span(entries_).subspan(first));
  match.by_feature();
  match.by_position(kMatches * radius);
  match.share_rest();
}

void ContactCache::add(const CachedContact& entry, const ContactPoint& contact) {
  place_.push_back(static_cast<std::uint32_t>(entries_.size()));
  entries_.push_back(entry);
  contacts_.push_back(contact);
}

std::vector<ContactImpulse> ContactCache::impulses() const {
  std::vector<ContactImpulse> impulses;
  impulses.reserve(place_.size());
  for (const std::uint32_t i : place_) impulses.push_back(entries_[i].impulse);
  return impulses;
}

void ContactCache::restore(std::vector<CachedContact> entries) {
  entries_ = std::move(entries);
  contacts_.clear(), place_.clear();
}

void ContactCache::remember(std::span<const ContactImpulse> impulses) {
  for (std::size_t i = 0; i < impulses.size(); ++i) {
    CachedContact& entry = entries_[place_[i]];
    entry.impulse = impulses[i];
    entry.quiet_steps = impulses[i].normal > 0 ? 0 : entry.quiet_steps + 1;
  }
}

}  // namespace tandem::dynamics
