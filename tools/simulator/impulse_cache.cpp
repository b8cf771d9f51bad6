#include "impulse_cache.h"

#include <algorithm>
#include <utility>

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kNear = 0.02;  // contacts so near each other are one, by the smaller body's radius

template <typename Contact>
std::pair<std::uint32_t, std::uint32_t> pair_of(const Contact& contact) {
  return {contact.body_a, contact.body_b};
}

Vector3d into_body(const BodyState& state, const Vector3d& point) {
  return state.orientation.conjugate() * (point - state.position);
}

Vector3d into_world(const BodyState& state, const Vector3d& point) {
  return state.position + state.orientation * point;
}

// Where the bodies have carried a contact.
ContactPoint moved_with_bodies(const CachedImpulse& entry, std::span<const BodyState> states) {
  const BodyState &a = states[entry.body_a], &b = states[entry.body_b];
  const Vector3d on_a = into_world(a, entry.in_a), on_b = into_world(b, entry.in_b);
  const Vector3d normal = (a.orientation * entry.normal_in_a).normalized();
  return {entry.body_a, entry.body_b, 0.5 * (on_a + on_b), normal, entry.depth - normal.dot(on_b - on_a),
          entry.feature};
}

// How far the bodies have carried its two sides apart.
Vector3d apart(const CachedImpulse& entry, std::span<const BodyState> states) {
  return into_world(states[entry.body_b], entry.in_b) - into_world(states[entry.body_a], entry.in_a);
}

// The same across the normal.
double across(const CachedImpulse& entry, const ContactPoint& moved, std::span<const BodyState> states) {
  const Vector3d by = apart(entry, states);
  return (by - moved.normal.dot(by) * moved.normal).norm();
}

// The contacts of one pair of bodies, old and new.
class PairMatch {
 public:
  PairMatch(std::span<const CachedImpulse> old, std::span<const ContactPoint> now,
            std::span<ContactImpulse> out)
      : old_(old), now_(now), out_(out), is_taken_(old.size(), 0), has_one_(now.size(), 0) {}

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

  void by_position(const BodyState& a, const BodyState& b, double reach) {
    for (std::size_t i = 0; i < now_.size(); ++i) {
      if (has_one_[i]) continue;
      const Vector3d in_a = into_body(a, now_[i].position), in_b = into_body(b, now_[i].position);
      std::size_t nearest = old_.size();
      double least = reach * reach;
      for (std::size_t j = 0; j < old_.size(); ++j) {
        const double apart =
            std::min((old_[j].in_a - in_a).squaredNorm(), (old_[j].in_b - in_b).squaredNorm());
        if (!is_taken_[j] && apart < least) least = apart, nearest = j;
      }
      if (nearest < old_.size()) take(i, nearest);
    }
  }

  void share_rest() {
    double normal = 0;
    Vector3d turning = Vector3d::Zero();
    for (std::size_t j = 0; j < old_.size(); ++j) {
      if (!is_taken_[j]) normal += old_[j].impulse.normal, turning += old_[j].impulse.turning;
    }
    const auto without = static_cast<double>(std::count(has_one_.begin(), has_one_.end(), 0));
    for (std::size_t i = 0; i < now_.size(); ++i) {
      if (!has_one_[i]) out_[i].normal = normal / without, out_[i].turning = turning / without;
    }
  }

 private:
  void take(std::size_t now, std::size_t old) {
    is_taken_[old] = has_one_[now] = 1;
    out_[now] = old_[old].impulse;
  }

  std::span<const CachedImpulse> old_;
  std::span<const ContactPoint> now_;
  std::span<ContactImpulse> out_;
  std::vector<char> is_taken_, has_one_;
};

}  // namespace

std::vector<ContactImpulse> ImpulseCache::match(std::span<const ContactPoint> contacts,
                                                std::span<const BodyProperties> bodies,
                                                std::span<const BodyState> states) const {
  constexpr double kReach = 0.1;  // of the smaller body's radius
  std::vector<ContactImpulse> impulses(contacts.size());
  std::size_t old = 0;
  for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
    const auto pair = pair_of(contacts[begin]);
    while (end < contacts.size() && pair_of(contacts[end]) == pair) ++end;
    while (old < entries_.size() && pair_of(entries_[old]) < pair) ++old;
    std::size_t old_end = old;
    while (old_end < entries_.size() && pair_of(entries_[old_end]) == pair) ++old_end;
    if (old == old_end) continue;
    PairMatch match({entries_.data() + old, old_end - old}, contacts.subspan(begin, end - begin),
                    {impulses.data() + begin, end - begin});
    match.by_feature();
    match.by_position(states[pair.first], states[pair.second],
                      kReach * std::min(bodies[pair.first].radius, bodies[pair.second].radius));
    match.share_rest();
    old = old_end;
  }
  return impulses;
}

std::vector<ContactPoint> ImpulseCache::without_jumps(std::span<const ContactPoint> contacts,
                                                      std::span<const BodyProperties> bodies,
                                                      std::span<const BodyState> states, double dt) const {
  constexpr double kCounts = 0.1, kSameWay = 0.7;
  std::vector<ContactPoint> all(contacts.begin(), contacts.end());
  std::vector<ContactPoint> known;
  std::vector<double> moved;
  std::size_t old = 0;
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    const auto pair = pair_of(all[begin]);
    while (end < all.size() && pair_of(all[end]) == pair) ++end;
    while (old < entries_.size() && pair_of(entries_[old]) < pair) ++old;
    known.clear(), moved.clear();
    for (; old < entries_.size() && pair_of(entries_[old]) == pair; ++old) {
      known.push_back(moved_with_bodies(entries_[old], states));
      moved.push_back(apart(entries_[old], states).norm());
    }
    const BodyState &a = states[pair.first], &b = states[pair.second];
    const double by_speed =
        dt * ((b.velocity - a.velocity).norm() + a.angular_velocity.norm() * bodies[pair.first].radius +
              b.angular_velocity.norm() * bodies[pair.second].radius);
    const double near = kNear * std::min(bodies[pair.first].radius, bodies[pair.second].radius);
    for (std::size_t i = begin; i < end; ++i) {
      std::size_t deepest = known.size();
      for (std::size_t k = 0; k < known.size(); ++k) {
        const bool is_there = (known[k].position - all[i].position).norm() <= near &&
                              known[k].normal.dot(all[i].normal) >= kSameWay;
        if (is_there && (deepest == known.size() || known[k].depth > known[deepest].depth)) deepest = k;
      }
      if (deepest == known.size()) continue;
      const double explained = std::max(known[deepest].depth, 0.0) + moved[deepest] + by_speed;
      if (all[i].depth > explained) all[i].depth = explained + kCounts * (all[i].depth - explained);
    }
  }
  return all;
}

KeptContacts ImpulseCache::with_those_just_lost(std::span<const ContactPoint> contacts,
                                                std::span<const BodyProperties> bodies,
                                                std::span<const BodyState> states,
                                                std::span<const std::uint8_t> idle, double gap,
                                                double slop) const {
  constexpr double kHair = 0.1;
  constexpr std::uint32_t kLife = 8;  // steps; boxes side by side would keep all that ever touched
  KeptContacts all;
  auto next = contacts.begin();
  for (std::size_t begin = 0, end = 0; begin < entries_.size(); begin = end) {
    const auto pair = pair_of(entries_[begin]);
    while (end < entries_.size() && pair_of(entries_[end]) == pair) ++end;
    while (next != contacts.end() && pair_of(*next) < pair) all.add(*next++, KeptContacts::kFound);
    const std::size_t first = all.contacts.size();
    while (next != contacts.end() && pair_of(*next) == pair) all.add(*next++, KeptContacts::kFound);
    if (!idle.empty() && idle[pair.first] && idle[pair.second]) continue;
    const double near = kNear * std::min(bodies[pair.first].radius, bodies[pair.second].radius);
    for (std::size_t i = begin; i < end; ++i) {
      if (entries_[i].lost >= kLife) continue;
      const ContactPoint moved = moved_with_bodies(entries_[i], states);
      if (moved.depth > kHair * slop || moved.depth < -gap || across(entries_[i], moved, states) > near)
        continue;
      const auto is_near = [&](const ContactPoint& one) {
        return (one.position - moved.position).norm() <= near;
      };
      const auto others = std::span(all.contacts).subspan(first);
      if (std::none_of(others.begin(), others.end(), is_near)) all.add(moved, static_cast<std::uint32_t>(i));
    }
  }
  while (next != contacts.end()) all.add(*next++, KeptContacts::kFound);
  return all;
}

void ImpulseCache::remember(const KeptContacts& kept, std::span<const ContactImpulse> impulses,
                            std::span<const BodyState> states, std::span<const std::uint8_t> idle) {
  std::vector<CachedImpulse> asleep, fresh;
  for (const CachedImpulse& entry : entries_) {
    if (!idle.empty() && idle[entry.body_a] && idle[entry.body_b]) asleep.push_back(entry);
  }
  fresh.reserve(kept.contacts.size());
  for (std::size_t i = 0; i < kept.contacts.size(); ++i) {
    if (kept.entry[i] != KeptContacts::kFound) {
      fresh.push_back(entries_[kept.entry[i]]);
      fresh.back().impulse = impulses[i];
      fresh.back().lost = impulses[i].normal > 0 ? 0 : fresh.back().lost + 1;
      continue;
    }
    const ContactPoint& contact = kept.contacts[i];
    const BodyState &a = states[contact.body_a], &b = states[contact.body_b];
    fresh.push_back({contact.body_a, contact.body_b, contact.feature, into_body(a, contact.position),
                     into_body(b, contact.position), a.orientation.conjugate() * contact.normal,
                     contact.depth, 0, impulses[i]});
  }
  const auto by_pair = [](const auto& x, const auto& y) { return pair_of(x) < pair_of(y); };
  entries_.resize(asleep.size() + fresh.size());
  std::merge(asleep.begin(), asleep.end(), fresh.begin(), fresh.end(), entries_.begin(), by_pair);
}

}  // namespace tandem::simulation
