#include "dynamics/contact_cache.h"

#include <algorithm>

namespace tandem::dynamics {
namespace {

const ObjectPair& pair_of(const ObjectPair& pair) {
  return pair;
}

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
  for (const CachedContact& entry : made_.entries) {
    if (pairs.empty() || pairs.back() != entry.pair) pairs.push_back(entry.pair);
  }
  return pairs;
}

void ContactCache::update(std::span<const ContactPoint> found, std::span<const ObjectPair> kept,
                          const BodiesAhead& of, Threads& threads) {
  before_.swap(made_.entries);
  is_cold_ = before_.empty();
  update_again(found, kept, of, threads);
}

// Parts of the lists, cut where a pair begins, are made side by side and then joined.
void ContactCache::update_again(std::span<const ContactPoint> found, std::span<const ObjectPair> kept,
                                const BodiesAhead& of, Threads& threads) {
  constexpr std::size_t kLeast = 256, kForEach = 4;  // contacts of a part; parts for each thread
  const std::span<const CachedContact> before = before_;
  const std::size_t longest = std::max(found.size(), before.size());
  const std::size_t most = threads.count() > 1 ? kForEach * threads.count() : 1;
  const std::size_t count = std::clamp(longest / kLeast, std::size_t{1}, most);
  if (count == 1) return made_.make(before, found, kept, of);
  const auto part_of = [&](auto list, std::size_t part) {
    const auto place = [&](std::size_t i) {
      if (i == 0 || i == count) return i == 0 ? 0 : list.size();
      const std::size_t at = longest * i / count;
      const ObjectPair cut = longest == found.size() ? pair_of(found[at]) : pair_of(before[at]);
      const auto begins =
          std::ranges::lower_bound(list, cut, {}, [](const auto& contact) { return pair_of(contact); });
      return static_cast<std::size_t>(begins - list.begin());
    };
    return list.subspan(place(part), place(part + 1) - place(part));
  };
  parts_.resize(count);
  threads.for_each(count, [&](std::size_t i) {
    parts_[i].make(part_of(before, i), part_of(found, i), part_of(kept, i), of);
  });
  join_parts(threads);
}

void ContactCache::join_parts(Threads& threads) {
  struct Begin {
    std::size_t entry, contact;
  };
  std::vector<Begin> begin(parts_.size() + 1);
  for (std::size_t i = 0; i < parts_.size(); ++i)
    begin[i + 1] = {begin[i].entry + parts_[i].entries.size(), begin[i].contact + parts_[i].contacts.size()};
  made_.resize(begin.back().entry, begin.back().contact);
  threads.for_each(parts_.size(), [&](std::size_t i) {
    const Made& part = parts_[i];
    std::ranges::copy(part.entries, made_.entries.begin() + static_cast<std::ptrdiff_t>(begin[i].entry));
    std::ranges::copy(part.contacts, made_.contacts.begin() + static_cast<std::ptrdiff_t>(begin[i].contact));
    for (std::size_t k = 0; k < part.place.size(); ++k)
      made_.place[begin[i].contact + k] = part.place[k] + static_cast<std::uint32_t>(begin[i].entry);
  });
}

void ContactCache::Made::make(std::span<const CachedContact> rest, std::span<const ContactPoint> found,
                              std::span<const ObjectPair> kept, const BodiesAhead& of) {
  resize(0, 0);
  while (!rest.empty() || !found.empty()) {
    const ObjectPair pair = rest.empty()    ? pair_of(found.front())
                            : found.empty() ? pair_of(rest.front())
                                            : std::min(pair_of(rest.front()), pair_of(found.front()));
    const auto old = head_of(rest, pair);
    const auto fresh = head_of(found, pair);
    rest = rest.subspan(old.size()), found = found.subspan(fresh.size());
    if (of.is_idle(pair.a) && of.is_idle(pair.b)) {
      entries.insert(entries.end(), old.begin(), old.end());
      continue;
    }
    while (!kept.empty() && kept.front() < pair) kept = kept.subspan(1);
    const bool keeps = !kept.empty() && kept.front() == pair;
    add(old.size() + (keeps ? 0 : fresh.size()), [&](const PairContacts& to) {
      if (keeps) return keep_contacts(old, of, to);
      marks.assign(2 * old.size() + fresh.size(), 0);
      return renew_contacts(pair, old, fresh, of, to, marks.data());
    });
  }
}

template <typename Make>
void ContactCache::Made::add(std::size_t room, const Make& make) {
  const std::size_t first = entries.size(), first_contact = contacts.size();
  resize(first + room, first_contact + room);
  const PairContactCounts counts = make(
      PairContacts{entries.data() + first, contacts.data() + first_contact, place.data() + first_contact});
  for (std::uint32_t i = 0; i < counts.contacts; ++i)
    place[first_contact + i] += static_cast<std::uint32_t>(first);
  resize(first + counts.remembered, first_contact + counts.contacts);
}

void ContactCache::Made::resize(std::size_t entry_count, std::size_t contact_count) {
  entries.resize(entry_count), contacts.resize(contact_count), place.resize(contact_count);
}

std::vector<ContactImpulse> ContactCache::impulses() const {
  std::vector<ContactImpulse> impulses;
  impulses.reserve(made_.place.size());
  for (const std::uint32_t i : made_.place) impulses.push_back(made_.entries[i].impulse);
  return impulses;
}

void ContactCache::restore(std::vector<CachedContact> entries) {
  made_ = {std::move(entries), {}, {}, {}};
}

void ContactCache::remember(std::span<const ContactImpulse> impulses) {
  for (std::size_t i = 0; i < impulses.size(); ++i) {
    dynamics::remember(made_.entries[made_.place[i]], impulses[i]);
  }
}

}  // namespace tandem::dynamics
