#include "contact_table.h"

#include <algorithm>

#include "columns.h"

namespace tandem::bench {

std::vector<ObjectPair> normalised(std::span<const ObjectPair> pairs) {
  std::vector<ObjectPair> sorted(pairs.begin(), pairs.end());
  for (ObjectPair& pair : sorted) {
    if (pair.b < pair.a) std::swap(pair.a, pair.b);
  }
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return sorted;
}

ContactTable make_table(std::span<const ObjectPair> pairs, std::vector<FaceContact> contacts) {
  for (FaceContact& contact : contacts) {
    const bool itself = pairs[contact.pair].a == pairs[contact.pair].b;
    if (itself && contact.face_b < contact.face_a) std::swap(contact.face_a, contact.face_b);
  }
  std::sort(contacts.begin(), contacts.end());
  ContactTable table;
  table.pairs.assign(pairs.begin(), pairs.end());
  for (const auto& [pair, face_a, face_b] : contacts) {
    table.pair.push_back(pair);
    table.face_a.push_back(face_a);
    table.face_b.push_back(face_b);
  }
  return table;
}

std::uint64_t hash_of(const ContactTable& table) {
  return hash_of_columns(flat(table.pairs), table.pair, table.face_a, table.face_b);
}

}  // namespace tandem::bench
