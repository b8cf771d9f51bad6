#include "contacts_file.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <type_traits>

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

// One number of each element.
template <typename Element, typename Member>
auto numbers(std::span<const Element> elements, const Member& member) {
  std::vector<std::decay_t<decltype(member(elements[0]))>> all;
  all.reserve(elements.size());
  for (const Element& element : elements) all.push_back(member(element));
  return all;
}

// A vector of each element, one after the other.
template <typename Element>
std::vector<double> vectors(std::span<const Element> elements, double (Element::*member)[3]) {
  std::vector<double> all;
  all.reserve(3 * elements.size());
  for (const Element& element : elements) all.insert(all.end(), element.*member, element.*member + 3);
  return all;
}

double area_of(const Manifold& manifold) {
  const double(&v)[3] = manifold.area_vector, (&n)[3] = manifold.normal;
  return std::fabs(v[0] * n[0] + v[1] * n[1] + v[2] * n[2]);
}

void add_manifolds(Hdf5Output& file, const ManifoldTable& table) {
  const auto manifolds = table.manifolds;
  const auto points = table.points;
  const std::size_t m = manifolds.size(), k = points.size();
  std::vector<std::uint32_t> first = numbers(manifolds, [](const Manifold& x) { return x.first_point; });
  first.push_back(static_cast<std::uint32_t>(k));
  file.add("/manifolds/pair", {m}, numbers(manifolds, [](const Manifold& x) { return x.pair; }));
  file.add("/manifolds/normal", {m, 3}, vectors(manifolds, &Manifold::normal));
  file.add("/manifolds/area", {m}, numbers(manifolds, area_of));
  file.add("/manifolds/depth", {m}, numbers(manifolds, [](const Manifold& x) { return x.depth; }));
  file.add("/manifolds/centre", {m, 3}, vectors(manifolds, &Manifold::centre));
  file.add("/manifolds/first", {m + 1}, first);
  file.add("/points/position", {k, 3}, vectors(points, &ManifoldPoint::position));
  file.add("/points/depth", {k}, numbers(points, [](const ManifoldPoint& x) { return x.depth; }));
  file.add("/points/id", {k}, numbers(points, [](const ManifoldPoint& x) { return x.id; }));
  file.add("/points/face_a", {k}, numbers(points, [](const ManifoldPoint& x) { return x.face_a; }));
  file.add("/points/face_b", {k}, numbers(points, [](const ManifoldPoint& x) { return x.face_b; }));
  file.attribute("manifolds", table.counters.manifolds);
  file.attribute("points", table.counters.points);
  file.attribute("segments", table.counters.segments);
  file.attribute("open_curves", table.counters.open_curves);
  file.attribute("ambiguous_touches", table.counters.ambiguous_touches);
  file.attribute("best_manifold_seconds", best_of(table.seconds));
  file.attribute("median_manifold_seconds", median_of(table.seconds));
}

void add_contained(Hdf5Output& file, const ContainedTable& table) {
  const auto rows = table.rows;
  const auto flag = [&](std::uint32_t wanted) {
    return numbers(rows,
                   [=](const Containment& x) { return static_cast<std::uint8_t>((x.flags & wanted) != 0); });
  };
  file.add("/contained/pair", {rows.size()}, numbers(rows, [](const Containment& x) { return x.pair; }));
  file.add("/contained/inner", {rows.size()},
           numbers(rows, [](const Containment& x) { return static_cast<std::uint8_t>(x.inner); }));
  file.add("/contained/component", {rows.size()},
           numbers(rows, [](const Containment& x) { return x.component; }));
  file.add("/contained/inside", {rows.size()}, flag(kInside));
  file.add("/contained/open", {rows.size()}, flag(kOuterOpen));
  file.attribute("best_contained_seconds", best_of(table.seconds));
  file.attribute("median_contained_seconds", median_of(table.seconds));
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

void write_contacts(const std::string& path, const ContactTable& table, const QueryRecord& record,
                    const ManifoldTable* manifolds, const ContainedTable* contained) {
  const ContactCounters& counters = record.counters;
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
  file.attribute("within", record.within);
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
  if (manifolds != nullptr) add_manifolds(file, *manifolds);
  if (contained != nullptr) add_contained(file, *contained);
  file.write();
}

}  // namespace tandem::bench
