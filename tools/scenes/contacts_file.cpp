#include "contacts_file.h"

#include <algorithm>
#include <tuple>

#include "common/number_words.h"
#include "hdf5_file.h"
#include "tandem/formats/hash.h"

namespace tandem::bench {
namespace {

std::vector<std::uint32_t> flat(std::span<const ObjectPair> pairs) {
  std::vector<std::uint32_t> numbers;
  numbers.reserve(2 * pairs.size());
  for (const ObjectPair& pair : pairs) numbers.insert(numbers.end(), {pair.a, pair.b});
  return numbers;
}

}  // namespace

std::vector<ObjectPair> normalised(std::span<const ObjectPair> pairs) {
  std::vector<ObjectPair> sorted(pairs.begin(), pairs.end());
  const auto key = [](const ObjectPair& pair) { return std::tie(pair.a, pair.b); };
  for (ObjectPair& pair : sorted) {
    if (pair.b < pair.a) std::swap(pair.a, pair.b);
  }
  std::sort(sorted.begin(), sorted.end(), [&](const auto& x, const auto& y) { return key(x) < key(y); });
  const auto same = [&](const auto& x, const auto& y) { return key(x) == key(y); };
  sorted.erase(std::unique(sorted.begin(), sorted.end(), same), sorted.end());
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
  std::vector<std::uint32_t> all = flat(table.pairs);
  for (const auto* column : {&table.pair, &table.face_a, &table.face_b}) {
    all.insert(all.end(), column->begin(), column->end());
  }
  return xxh64(all.data(), all.size() * sizeof(std::uint32_t));
}

void write_contacts(const std::string& path, const ContactTable& table, const QueryRecord& record) {
  const QueryCounters& counters = record.counters;
  Hdf5Output file(path);
  file.add("/pairs", {table.pairs.size(), 2}, flat(table.pairs));
  file.add("/contacts/pair", {table.pair.size()}, table.pair);
  file.add("/contacts/face_a", {table.face_a.size()}, table.face_a);
  file.add("/contacts/face_b", {table.face_b.size()}, table.face_b);
  file.attribute("tandem_version", std::string(TANDEM_VERSION));
  file.attribute("mode", record.mode);
  file.attribute("backend", record.backend);
  file.attribute("first_contact", std::uint64_t{record.first_contact});
  file.attribute("self_pairs", std::uint64_t{record.self_pairs});
  file.attribute("given_pairs", std::uint64_t{record.given_pairs});
  file.attribute("threads", record.threads);
  file.attribute("repeats", std::uint64_t{record.seconds.size()});
  file.attribute("best_seconds", best_of(record.seconds));
  file.attribute("median_seconds", median_of(record.seconds));
  file.attribute("object_pairs", counters.object_pairs);
  file.attribute("block_pairs", counters.block_pairs);
  file.attribute("candidates", counters.candidates);
  file.attribute("decided_by_float32", counters.decided_by_float32);
  file.attribute("decided_by_float64", counters.decided_by_float64);
  file.attribute("decided_exactly", counters.decided_exactly);
  file.attribute("contacts", counters.contacts);
  file.attribute("hash", hexadecimal(hash_of(table)));
  file.write();
}

}  // namespace tandem::bench
