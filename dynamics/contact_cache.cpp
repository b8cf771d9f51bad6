#include "dynamics/contact_cache.h"

#include <algorithm>

namespace tandem::dynamics {
namespace {

// The contacts of a pair that a list by ascending pair begins with.
template <typename Contact>
std::span<const Contact> head_of(std::span<const Contact> contacts, const ObjectPair& pair) {
  std::size_t count = 0;
  while (count < contacts.size() && pair_of(contacts[count]) == pair) ++count;
  return contacts.first(count);
}

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
    const bool keeps = !kept.empty() && kept.front() == pair;
    add(old.size() + (keeps ? 0 : fresh.size()), [&](const PairContacts& to) {
      if (keeps) return keep_contacts(old, of, to);
      marks_.assign(2 * old.size() + fresh.size(), 0);
      return renew_contacts(pair, old, fresh, of, to, marks_.data());
    });
  }
}

template <typename Make>
void ContactCache::add(std::size_t room, const Make& make) {
  const std::size_t first = entries_.size(), first_contact = contacts_.size();
  entries_.resize(first + room), contacts_.resize(first_contact + room), place_.resize(first_contact + room);
  const PairContactCounts counts = make(
      PairContacts{entries_.data() + first, contacts_.data() + first_contact, place_.data() + first_contact});
  for (std::uint32_t i = 0; i < counts.contacts; ++i)
    place_[first_contact + i] += static_cast<std::uint32_t>(first);
  entries_.resize(first + counts.remembered);
  contacts_.resize(first_contact + counts.contacts), place_.resize(first_contact + counts.contacts);
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
    dynamics::remember(entries_[place_[i]], impulses[i]);
  }
}

}  // namespace tandem::dynamics
